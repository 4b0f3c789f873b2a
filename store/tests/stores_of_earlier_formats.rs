//! A new version that cannot open what last month's computed loses weeks of work, and so does one that opens it and
//! then no version does. A store of format 1 opens, keeps every byte of what it has committed, and can go on.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::*;
use store::{Depth, OpenError, RenameError, Severity, StepIndex, Store, rename_run};

const FORMAT_1: &str = "femdem-flow store format 1\n";

/// A store as format 1 has it. What it lays down of packs, records and journals is held to the byte in
/// `format_to_the_byte.rs`; the rest of it is the line and what is not there yet.
fn build_format_1(dir: &Path) {
    build(dir);
    fs::write(dir.join("FORMAT"), FORMAT_1).unwrap();
    fs::remove_dir(dir.join("queue")).unwrap();
    fs::remove_file(dir.join("NAMES")).unwrap();
}

fn files_below(dir: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files_below(&path, found),
            false => {
                let name = path.to_str().unwrap().to_owned();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
}

fn bulk(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    files_below(&dir.join("packs"), &mut found);
    files_below(&dir.join("cache"), &mut found);
    found
}

#[test]
fn a_store_of_format_1_is_taken_along_with_every_byte_it_committed() {
    let dir = tempfile::tempdir().unwrap();
    build_format_1(dir.path());
    let before = bulk(dir.path());

    // Looking changes nothing, not even the format.
    let onlooker = Store::open_read_only(dir.path()).unwrap();
    assert_eq!(onlooker.runs().unwrap().len(), 2);
    assert!(onlooker.check(Depth::Deep).unwrap().is_sound());
    assert_eq!(
        fs::read_to_string(dir.path().join("FORMAT")).unwrap(),
        FORMAT_1
    );
    let early = rename_run(dir.path(), &name("a"), &name("c"));
    assert!(
        matches!(early, Err(RenameError::EarlierFormat { found: 1 })),
        "{early:?}"
    );

    let store = Store::open(dir.path()).unwrap();
    let upgraded: Vec<_> = store.opening_report().iter().collect();
    assert_eq!(upgraded.len(), 1, "{upgraded:?}");
    assert_eq!(upgraded[0].severity, Severity::Upgraded);
    assert!(upgraded[0].what.contains("format 1"), "{upgraded:?}");
    assert_eq!(
        bulk(dir.path()),
        before,
        "the upgrade touched what is committed"
    );
    for step in 1..=3 {
        assert_step(&store, &name("a"), step);
    }
    // What was journalled goes on where it was.
    commit(&store, &name("a"), 4);
    assert_step(&store, &name("a"), 4);
    drop(store);

    let again = Store::open(dir.path()).unwrap();
    assert_eq!(again.opening_report(), [], "an upgrade is told once");
    assert_step(&again, &name("b"), StepIndex(3).0);
    drop(again);
    rename_run(dir.path(), &name("a"), &name("c")).unwrap();
}

#[test]
fn a_crash_in_the_middle_of_the_upgrade_leaves_one_format_or_the_other() {
    let dir = tempfile::tempdir().unwrap();
    build_format_1(dir.path());
    // Killed while the new line was written beside the old one.
    fs::write(dir.path().join("FORMAT.tmp"), "femdem-flow st").unwrap();
    Store::open_read_only(dir.path()).unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert!(!dir.path().join("FORMAT.tmp").exists());
    assert_step(&store, &name("a"), 3);
}

#[test]
fn a_format_line_that_nobody_wrote_is_no_earlier_format() {
    for line in [
        "femdem-flow store format 0\n",
        "femdem-flow store format 1",
        "femdem-flow store format 1 \n",
        "femdem-flow store format 99\n",
    ] {
        let dir = tempfile::tempdir().unwrap();
        build_format_1(dir.path());
        fs::write(dir.path().join("FORMAT"), line).unwrap();
        for opened in [
            Store::open(dir.path()).map(drop),
            Store::open_read_only(dir.path()).map(drop),
        ] {
            let refused = matches!(
                opened,
                Err(OpenError::UnknownFormat { .. } | OpenError::Damaged(_))
            );
            assert!(refused, "{line:?}: {opened:?}");
        }
        let left = fs::read_to_string(dir.path().join("FORMAT")).unwrap();
        assert_eq!(left, line);
    }
}
