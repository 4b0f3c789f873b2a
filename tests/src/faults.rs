//! File operations that fail on demand.
//!
//! `tests/shim/faults.c`, compiled here and loaded before the C library, counts the operations of a process below its store
//! and makes one of them, or all from one on, fail. It is what a dying disk and a full one do, at an instant of
//! our choice; no right to mount anything is needed.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use rustix::io::Errno;

use crate::binary::profile_folder;
use crate::workplace::Workplace;

/// Which operations count and fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calls {
    /// Those that change something: opening for writing, writing, flushing, truncating, renaming, making, removing.
    Changes,
    /// Opening for reading, and reading.
    Reads,
}

/// For how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lasting {
    /// One operation fails.
    Once,
    /// All later ones fail too.
    On,
}

/// What fails.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Which operations.
    pub calls: Calls,
    /// The first of them to fail, counted from 1 over all threads.
    pub at: u64,
    /// With which error.
    pub error: Errno,
    /// For how long.
    pub lasting: Lasting,
}

impl Fault {
    /// What has to be in the environment of a process for the fault to befall it below the store of `place`.
    pub fn environment(&self, place: &Workplace) -> Vec<(&'static str, OsString)> {
        let mut environment = counting(place, self.calls);
        environment.push(("FAULT_AT", self.at.to_string().into()));
        environment.push(("FAULT_ERRNO", self.error.raw_os_error().to_string().into()));
        let lasting = match self.lasting {
            Lasting::Once => "once",
            Lasting::On => "on",
        };
        environment.push(("FAULT_LASTS", lasting.into()));
        environment
    }
}

/// What has to be in the environment of a process for its operations to be counted, none of them failing.
pub fn counting(place: &Workplace, calls: Calls) -> Vec<(&'static str, OsString)> {
    let calls = match calls {
        Calls::Changes => "changes",
        Calls::Reads => "reads",
    };
    // The system tells the path of an open file without links; the store may not exist yet, its folder does.
    let folder = place
        .dir()
        .canonicalize()
        .expect("a temporary folder is there");
    vec![
        ("LD_PRELOAD", shim().into()),
        ("FAULT_UNDER", folder.join("store").into()),
        ("FAULT_CALLS", calls.into()),
        ("FAULT_LOG", log(place).into()),
    ]
}

/// The calls that were noted in `place`, and the log emptied: those that failed, or all that were counted.
pub fn noted(place: &Workplace) -> Vec<String> {
    let text = fs::read_to_string(log(place)).unwrap_or_default();
    let _ = fs::remove_file(log(place));
    text.lines().map(str::to_owned).collect()
}

fn log(place: &Workplace) -> PathBuf {
    place.dir().join("faults")
}

/// The library, compiled when it is asked for first.
fn shim() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let source = crate::root().join("tests/shim/faults.c");
        let library = profile_folder().join("libfaults.so");
        // Tests of several processes compile it at once; each one moves a whole library into place.
        let own = library.with_extension(std::process::id().to_string());
        let status = Command::new("cc")
            .args(["-O1", "-shared", "-fPIC", "-o"])
            .args([&own, &source])
            .arg("-ldl")
            .status()
            .expect("a C compiler is there, as the project requires");
        assert!(status.success(), "{} does not compile", source.display());
        fs::rename(&own, &library).expect("the folder of the profile can be written to");
        library
    })
}
