//! The program under test.
//!
//! Cargo tells the path of a program only to the tests of its own package. It lies beside the folder of this
//! executable, whatever the target folder and the profile; where it is missing or older than its sources (as under
//! `cargo test -p tests`, which builds no program), cargo is asked for it.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::SystemTime;

/// The folders whose sources make the program.
const SOURCES: [&str; 5] = ["engine", "solver-dem", "solver-fem", "store", "workflows"];

/// The path of `femdem-flow`, built before it is returned for the first time if that is needed.
pub fn femdem_flow() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let folder = profile_folder();
        let program = folder.join(format!("femdem-flow{}", env::consts::EXE_SUFFIX));
        if built(&program).is_none_or(|built| built < newest_source()) {
            build(&folder);
        }
        assert!(program.is_file(), "cargo built no {}", program.display());
        program
    })
}

/// `target/release` or its like: this executable lies in it, or in its folder `deps`.
pub(crate) fn profile_folder() -> PathBuf {
    let this = env::current_exe().expect("the system knows what it runs");
    let folder = this.parent().expect("an executable lies in a folder");
    let folder = if folder.ends_with("deps") {
        folder.parent()
    } else {
        Some(folder)
    };
    folder
        .expect("`deps` lies in the folder of the profile")
        .to_owned()
}

fn build(folder: &Path) {
    let target = folder
        .parent()
        .expect("the folder of a profile lies in the target folder");
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(profile) => profile,
    };
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args([
            "build",
            "--package",
            "workflows",
            "--bin",
            "femdem-flow",
            "--profile",
            profile,
        ])
        .arg("--target-dir")
        .arg(target)
        .current_dir(crate::root())
        .status()
        .expect("cargo can be started");
    assert!(
        status.success(),
        "cargo could not build femdem-flow: {status}"
    );
}

fn built(program: &Path) -> Option<SystemTime> {
    fs::metadata(program)
        .and_then(|metadata| metadata.modified())
        .ok()
}

/// When a source of the program was changed last.
fn newest_source() -> SystemTime {
    let mut newest = SystemTime::UNIX_EPOCH;
    for folder in SOURCES {
        let mut folders = vec![crate::root().join(folder).join("src")];
        while let Some(folder) = folders.pop() {
            let entries = fs::read_dir(&folder).expect("a crate has a folder of sources");
            for entry in entries.flatten() {
                let path = entry.path();
                match built(&path) {
                    _ if path.is_dir() => folders.push(path),
                    Some(changed) => newest = newest.max(changed),
                    None => {}
                }
            }
        }
    }
    newest
}
