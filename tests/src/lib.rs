//! Helpers of the black-box tests: they find the real `femdem-flow`, run it in folders of their own, kill it, and
//! read what it committed through the `store` crate.
//!
//! - [`binary`]: the program under test;
//! - [`faults`]: file operations that fail on demand, as those of a dying or full disk;
//! - [`crash`]: a store that is killed in whatever it does;
//! - [`damage`]: bytes flipped and files cut, and how that ended;
//! - [`examples`]: the examples of the repository, made small;
//! - [`fault_sweep`]: every one of them in turn, verb by verb;
//! - [`folder`]: folders listed, copied, compared;
//! - [`workplace`]: a folder with a store, commands run in it, sessions that can be signalled;
//! - [`history`]: what a run has committed, as digests and as macro states;
//! - [`inputs`]: small problems that take seconds;
//! - [`ordeal`]: a run that is killed again and again and still has to arrive;
//! - [`patience`]: waiting for what another process does;
//! - [`random`]: seeded numbers, so that a failure can be repeated.
//!
//! These functions panic where something is not as it should be: a panic here is a failing test.

pub mod binary;
pub mod crash;
pub mod damage;
pub mod examples;
pub mod fault_sweep;
pub mod faults;
pub mod folder;
pub mod history;
pub mod inputs;
pub mod ordeal;
pub mod patience;
pub mod random;
pub mod workplace;

use std::path::Path;

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("this crate is a folder of the workspace")
}
