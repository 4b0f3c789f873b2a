//! What a user meets of femdem-flow: the input language, the load programme, the outputs and the command line; and the
//! runs, which join the finite elements (`solver-fem`), the grains (`solver-dem`), the task graph (`engine`) and the
//! store (`store`).
//!
//! - [`input`]: YAML to a checked [`input::Problem`], or everything that is wrong with it;
//! - [`address`]: `hollow@12:e46.2`, the names of runs, steps and REVs;
//! - [`output`]: files that other programs read (VTU, PVD, CSV);
//! - [`mod@bench`]: what a REV costs on this machine;
//! - [`plot`]: pictures (PNG, SVG): scenes, axes, colours;
//! - [`cli`]: the command `femdem-flow`;
//! - [`run`]: what the verbs of the command line do.

pub mod address;
pub mod bench;
pub mod cli;
pub mod failure;
pub mod input;
pub mod machine;
pub mod output;
pub mod plot;
pub mod progress;
pub mod report;
pub mod run;
