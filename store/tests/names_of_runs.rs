//! A name that means another run today than it did yesterday sends a `delete` or a `branch` to the wrong one. A run
//! answers to its label and to the name it was born with; no other run gets either of them.

mod common;

use std::fs;

use common::*;
use store::{Depth, NewRun, RenameError, RunName, Severity, Store, rename_run};

fn shown(store: &Store) -> Vec<String> {
    let names = store.names().unwrap().all_shown();
    names.iter().map(ToString::to_string).collect()
}

fn resolve(store: &Store, text: &str) -> Option<RunName> {
    store.names().unwrap().resolve(&name(text))
}

#[test]
fn a_renamed_run_answers_to_both_names_and_keeps_its_steps() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    // A process computes it meanwhile.
    let store = Store::open(dir.path()).unwrap();
    rename_run(dir.path(), &name("a"), &name("dense")).unwrap();
    assert_eq!(shown(&store), ["dense", "b"]);
    assert_eq!(resolve(&store, "dense"), Some(name("a")));
    assert_eq!(resolve(&store, "a"), Some(name("a")));
    assert_eq!(store.run(&name("a")).unwrap().shown(), &name("dense"));
    commit(&store, &name("a"), 4);
    assert_step(&store, &name("b"), 3);
    drop(store);

    let store = Store::open(dir.path()).unwrap();
    assert_eq!(store.opening_report(), []);
    assert!(store.check(Depth::Deep).unwrap().is_sound());
    let parent = store.run(&name("b")).unwrap().parent.unwrap();
    let names = store.names().unwrap();
    assert_eq!(names.shown_address(&parent).to_string(), "dense@2");
    // Errors call it what people call it.
    let error = store.delete_run(&name("a")).unwrap_err().to_string();
    assert!(error.contains("`b` takes up dense@2"), "{error}");
    let error = store.step(&name("a"), store::StepIndex(9)).unwrap_err();
    assert_eq!(error.to_string(), "find the step dense@9");
}

#[test]
fn no_run_gets_a_name_that_another_answers_to() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let rename = |run: &str, label: &str| rename_run(dir.path(), &name(run), &name(label));
    rename("a", "dense").unwrap();
    for taken in ["dense", "a"] {
        let refused = rename("b", taken);
        assert!(
            matches!(&refused, Err(RenameError::Taken { by, .. }) if *by == name("dense")),
            "{taken}: {refused:?}"
        );
    }
    let store = Store::open(dir.path()).unwrap();
    let create = |wanted: &str| store.create_run(NewRun { ..new_run(wanted) }).unwrap().name;
    assert_eq!(create("dense"), name("dense-2"));
    assert_eq!(create("a"), name("a-2"));
    // A label that was given up is free; the first name never is.
    rename("a", "denser").unwrap();
    assert_eq!(create("dense"), name("dense"));
    rename("a", "a").unwrap();
    assert_eq!(store.run(&name("a")).unwrap().label, None);
    assert!(rename("nobody", "x").is_err());
    assert!(!dir.path().join("packs/nobody").exists());
}

#[test]
fn a_damaged_label_is_reported_and_never_believed() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    rename_run(dir.path(), &name("a"), &name("dense")).unwrap();
    let path = dir.path().join("packs/a/label.rmp");
    let sound = fs::read(&path).unwrap();
    let reported = |what: &str| {
        let store = Store::open(dir.path()).unwrap();
        let check = store.check(Depth::Quick).unwrap();
        for findings in [store.opening_report(), &check.findings] {
            let found = findings
                .iter()
                .any(|f| f.severity == Severity::Damage && f.path == path);
            assert!(found, "{what}: {findings:?}");
        }
        assert_eq!(shown(&store), ["a", "b"], "{what}");
        assert_step(&store, &name("a"), 3);
    };
    for at in 0..sound.len() {
        let mut bad = sound.clone();
        bad[at] ^= 1;
        fs::write(&path, &bad).unwrap();
        if at % 8 == 0 {
            reported(&format!("byte {at}"));
        }
        let label = Store::open_read_only(dir.path())
            .unwrap()
            .run(&name("a"))
            .unwrap()
            .label;
        assert_eq!(label, None, "byte {at}");
    }
    for len in [0, 8, sound.len() - 1] {
        fs::write(&path, &sound[..len]).unwrap();
        reported(&format!("{len} bytes"));
    }
    // The label of another run, put here.
    rename_run(dir.path(), &name("b"), &name("loose")).unwrap();
    fs::copy(dir.path().join("packs/b/label.rmp"), &path).unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(shown(&store), ["a", "loose"]);
    // The way out.
    rename_run(dir.path(), &name("a"), &name("dense")).unwrap();
    assert_eq!(shown(&store), ["dense", "loose"]);
    assert!(store.check(Depth::Quick).unwrap().is_sound());
}

#[test]
fn renaming_at_the_same_time_gives_a_name_once() {
    let dir = tempfile::tempdir().unwrap();
    {
        let store = Store::open(dir.path()).unwrap();
        for run in 0..4 {
            store.create_run(new_run(&format!("r{run}"))).unwrap();
        }
    }
    let given: usize = std::thread::scope(|scope| {
        let rename = |run: u32| {
            let run = name(&format!("r{run}"));
            rename_run(dir.path(), &run, &name("wanted")).is_ok()
        };
        let tries: Vec<_> = (0..4).map(|run| scope.spawn(move || rename(run))).collect();
        let given = tries.into_iter().map(|t| usize::from(t.join().unwrap()));
        given.sum()
    });
    assert_eq!(given, 1);
}
