//! Two processes writing one store would destroy it: the second is refused and told who the first is.

mod common;

use std::env;
use std::fs;
use std::process::Command;

use common::*;
use store::{OpenError, Store};

const CHILD: &str = "STORE_TEST_LOCK_CHILD";

/// Does nothing unless started by the test below, as another process.
#[test]
fn child_that_tries_to_open() {
    let Ok(dir) = env::var(CHILD) else { return };
    match Store::open(dir.as_ref()) {
        Err(error @ OpenError::Held { .. }) => println!("REFUSED {error}"),
        other => println!("NOT REFUSED {other:?}"),
    }
}

#[test]
fn a_second_process_is_refused_with_the_holders_pid() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let output = Command::new(env::current_exe().unwrap())
        .args(["child_that_tries_to_open", "--exact", "--nocapture"])
        .env(CHILD, dir.path())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let pid = format!("process {} on ", std::process::id());
    assert!(
        text.contains("REFUSED open the store") && text.contains(&pid),
        "{text}"
    );
    drop(store);
    Store::open(dir.path()).unwrap();
}

#[test]
fn a_second_opening_in_one_process_is_refused_and_a_garbled_lock_file_is_no_obstacle() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    fs::write(dir.path().join("LOCK"), b"\xff\xfepid x\n").unwrap();
    let store = Store::open(dir.path()).unwrap();
    let held = Store::open(dir.path()).unwrap_err();
    assert!(matches!(held, OpenError::Held { pid: Some(pid), .. } if pid == std::process::id()));
    // The journal keeps the store as well: a forgotten one must not let a second owner in.
    let journal = store.journal(&name("b"), store::StepIndex(4)).unwrap();
    drop(store);
    assert!(matches!(
        Store::open(dir.path()),
        Err(OpenError::Held { .. })
    ));
    drop(journal);
    Store::open(dir.path()).unwrap();
}

#[test]
fn a_folder_with_other_things_is_not_made_a_store() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("thesis.tex"), "x").unwrap();
    assert!(matches!(
        Store::open(dir.path()),
        Err(OpenError::NotAStore { .. })
    ));
    assert_eq!(
        fs::read_dir(dir.path()).unwrap().count(),
        1,
        "something was left behind"
    );
    let missing = dir.path().join("none");
    assert!(matches!(
        Store::open_read_only(&missing),
        Err(OpenError::Missing { .. })
    ));
    assert!(!missing.exists());
}

#[test]
fn a_store_of_a_later_format_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    fs::write(dir.path().join("FORMAT"), "femdem-flow store format 3\n").unwrap();
    let error = Store::open(dir.path()).unwrap_err();
    assert!(matches!(error, OpenError::UnknownFormat { found: 3, .. }));
    assert!(
        error
            .to_string()
            .contains("its format is 3, femdem-flow 0.1.0 knows formats 1 to 2; use the femdem-flow version that wrote it"),
        "{error}"
    );
}
