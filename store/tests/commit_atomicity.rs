//! A step is wholly committed or it never happened, wherever the process dies.

mod common;

use std::env;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use common::*;
use store::{Depth, StepIndex, Store};

const PACK: &str = "packs/a/00000004.pack";
const PART: &str = "packs/a/00000004.wave000000.part";

/// Opens the store and checks that step 4 of `a` is there, or that it can be committed from its journal.
fn assert_commits_to(dir: &Path, digest: store::Digest, committed: bool, stage: &str) {
    let store = Store::open(dir).unwrap_or_else(|error| panic!("{stage}: {error}"));
    let a = name("a");
    let there = store.steps(&a).unwrap().len() == 4;
    assert_eq!(there, committed, "{stage}");
    if !there {
        let mut journal = store.journal(&a, StepIndex(4)).unwrap();
        let wave = journal.read_wave(WAVE).unwrap().unwrap();
        assert_eq!(wave.frames.len(), 10, "{stage}: the journal lost frames");
        journal.commit(seal(4), |_| true).unwrap();
    }
    assert_step(&store, &a, 4);
    assert_eq!(
        store.step(&a, StepIndex(4)).unwrap().digest(),
        digest,
        "{stage}"
    );
    let findings = store.check(Depth::Deep).unwrap().findings;
    assert_eq!(findings, [], "{stage}");
    drop(store);
    let again = Store::open(dir).unwrap();
    assert_eq!(
        again.opening_report(),
        [],
        "{stage}: the repair does not last"
    );
}

/// Every state of the folder between two file operations of a commit, and some within one, made by hand.
#[test]
fn a_crash_between_any_two_file_operations_of_a_commit_loses_nothing() {
    let (before, after) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    build(before.path());
    copy_folder(before.path(), after.path());
    let store = Store::open(after.path()).unwrap();
    let journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    let digest = journal.commit(seal(4), |_| true).unwrap().digest;
    drop(store);
    let pack = fs::read(after.path().join(PACK)).unwrap();

    let stage = |what: &str, committed: bool, change: &dyn Fn(&Path)| {
        let dir = tempfile::tempdir().unwrap();
        copy_folder(before.path(), dir.path());
        change(dir.path());
        assert_commits_to(dir.path(), digest, committed, what);
    };
    stage("before the commit", false, &|_| {});
    for cut in [
        0,
        7,
        100,
        pack.len() / 2,
        pack.len() - 93,
        pack.len() - 1,
        pack.len(),
    ] {
        let what = format!("{cut} of {} bytes written", pack.len());
        stage(&what, false, &|dir| {
            fs::write(dir.join(PACK).with_extension("pack.tmp"), &pack[..cut]).unwrap();
        });
    }
    stage("renamed, not in the database", true, &|dir| {
        fs::write(dir.join(PACK), &pack).unwrap()
    });
    stage("in the database, parts not deleted", true, &|dir| {
        fs::remove_dir_all(dir).unwrap();
        copy_folder(after.path(), dir);
        fs::copy(before.path().join(PART), dir.join(PART)).unwrap();
    });
    stage("all done", true, &|dir| {
        fs::remove_dir_all(dir).unwrap();
        copy_folder(after.path(), dir);
    });
    stage("all done, database from before", true, &|dir| {
        fs::write(dir.join(PACK), &pack).unwrap();
        fs::remove_file(dir.join(PART)).unwrap();
    });
}

#[test]
fn a_crash_while_a_run_or_a_store_is_created_leaves_no_half_of_it() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("LOCK"), "").unwrap();
    fs::write(dir.path().join("FORMAT.tmp"), "femdem").unwrap();
    drop(Store::open(dir.path()).unwrap());
    let half = dir.path().join("packs/.new-a");
    fs::create_dir(&half).unwrap();
    fs::write(half.join("run.rmp.tmp"), "x").unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert!(store.run_names().unwrap().is_empty());
    assert!(!half.exists());
    assert_eq!(store.create_run(new_run("a")).unwrap().name, name("a"));
}

const CHILD: &str = "STORE_TEST_COMMIT_CHILD";

/// Does nothing unless started by the test below: commits steps until it is killed.
#[test]
fn child_that_commits_until_killed() {
    let Ok(dir) = env::var(CHILD) else { return };
    let store = Store::open(dir.as_ref()).unwrap();
    let run = name("a");
    if store.run(&run).is_err() {
        store.create_run(new_run("a")).unwrap();
    }
    let mut step = store
        .run(&run)
        .unwrap()
        .last_step
        .map_or(0, |last| last.0 + 1);
    loop {
        commit(&store, &run, step);
        step += 1;
    }
}

#[test]
fn killed_at_any_instant_the_store_keeps_every_step_it_had() {
    let dir = tempfile::tempdir().unwrap();
    let mut steps = 0;
    for round in 0..12_u64 {
        let mut child = Command::new(env::current_exe().unwrap())
            .args(["child_that_commits_until_killed", "--exact"])
            .env(CHILD, dir.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        thread::sleep(Duration::from_millis(40 + round * 37 % 200));
        child.kill().unwrap();
        child.wait().unwrap();
        let store = Store::open(dir.path()).unwrap();
        if store.run_names().unwrap().is_empty() {
            continue;
        }
        let found = store.steps(&name("a")).unwrap();
        assert!(
            found.len() >= steps,
            "round {round}: {} of {steps} steps",
            found.len()
        );
        assert!(
            found.iter().all(store::StepRecord::is_sound),
            "round {round}"
        );
        steps = found.len();
        if steps > 0 {
            assert_step(&store, &name("a"), steps as u32 - 1);
        }
        assert!(
            store.check(Depth::Deep).unwrap().is_sound(),
            "round {round}"
        );
    }
    assert!(steps > 0, "nothing was ever committed");
}
