//! Pruning and deleting are the only ways in which the store loses bytes on purpose. They must give the space back,
//! take nothing that something kept still needs, and a crash in the middle must leave a store that knows what it has.

mod common;

use std::fs;

use common::{name, new_run, state};
use store::{
    DeleteError, Depth, FrameId, InUse, NewRun, ReadError, StepAddress, StepHealth, StepIndex,
    Store,
};

fn commit(store: &Store, run: &str, step: u32) {
    common::commit(store, &name(run), step);
}

fn committed_run(store: &Store, run: &str, steps: std::ops::RangeInclusive<u32>) {
    store.create_run(new_run(run)).unwrap();
    for step in steps {
        commit(store, run, step);
    }
}

fn branch(store: &Store, from: &str, step: u32) {
    let run = NewRun {
        parent: Some(StepAddress {
            run: name(from),
            step: StepIndex(step),
        }),
        ..new_run("branch")
    };
    store.create_run(run).unwrap();
}

fn health(store: &Store, run: &str) -> Vec<StepHealth> {
    let steps = store.steps(&name(run)).unwrap();
    steps.into_iter().map(|step| step.health).collect()
}

#[test]
fn pruning_keeps_what_is_needed_and_the_figures_of_the_rest() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    committed_run(&store, "a", 0..=6);
    branch(&store, "a", 3);
    let before = store.steps(&name("a")).unwrap();
    let bytes = || store.info().unwrap().pack_bytes;
    let all = bytes();
    let dry = store.prunable(&name("a"), |step| step.0 == 5).unwrap();
    assert_eq!(bytes(), all, "asking removed something");
    let gone = store.prune(&name("a"), |step| step.0 == 5).unwrap();
    assert_eq!(dry, gone);
    let numbers: Vec<u32> = gone.iter().map(|step| step.index.0).collect();
    assert_eq!(numbers, [1, 2, 4]);
    let freed: u64 = gone.iter().map(|step| step.bytes).sum();
    assert!(all - bytes() > freed / 2, "{all} - {} of {freed}", bytes());
    let check = |store: &Store| {
        let steps = store.steps(&name("a")).unwrap();
        for (step, was) in steps.iter().zip(&before) {
            assert_eq!((step.digest, &step.summary), (was.digest, &was.summary));
            let pruned = numbers.contains(&step.index.0);
            assert_eq!(step.health == StepHealth::Pruned, pruned, "{}", step.index);
            let read = store.step(&name("a"), step.index);
            match read {
                Ok(reader) => {
                    assert!(!pruned);
                    let frame = reader.frame(FrameId::new(common::REV, 0)).unwrap();
                    assert_eq!(frame, state(step.index.0, 0, 40));
                }
                Err(error) => assert!(pruned && matches!(error, ReadError::Pruned(_)), "{error}"),
            }
        }
        let report = store.check(Depth::Deep).unwrap();
        assert!(report.findings.is_empty(), "{:?}", report.findings);
    };
    check(&store);
    // What is kept can be gone on from, in the run and in the branch.
    commit(&store, "a", 7);
    commit(&store, "branch", 4);
    drop(store);
    let store = Store::open(dir.path()).unwrap();
    assert!(
        store.opening_report().is_empty(),
        "{:?}",
        store.opening_report()
    );
    check(&store);
    // Also where the database is lost: the stubs have it all.
    assert_eq!(store.rebuild().unwrap().lost, 0);
    check(&store);
}

#[test]
fn a_crash_between_stub_and_removal_leaves_the_step_whole() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    committed_run(&store, "a", 0..=3);
    let pack = dir.path().join("packs/a/00000001.pack");
    let bytes = fs::read(&pack).unwrap();
    store.prune(&name("a"), |_| false).unwrap();
    drop(store);
    fs::write(&pack, bytes).unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(
        health(&store, "a")[..3],
        [StepHealth::Sound, StepHealth::Sound, StepHealth::Pruned]
    );
    store
        .step(&name("a"), StepIndex(1))
        .unwrap()
        .verify()
        .unwrap();
    assert!(store.check(Depth::Deep).unwrap().is_sound());
    store.prune(&name("a"), |_| false).unwrap();
    assert_eq!(health(&store, "a")[1], StepHealth::Pruned);
}

#[test]
fn a_damaged_stub_is_named_and_never_taken_for_the_step() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    committed_run(&store, "a", 0..=3);
    store.prune(&name("a"), |_| false).unwrap();
    drop(store);
    let stub = dir.path().join("packs/a/00000001.pruned");
    let mut bytes = fs::read(&stub).unwrap();
    bytes[20] ^= 4;
    fs::write(&stub, bytes).unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert!(matches!(health(&store, "a")[1], StepHealth::Damaged(_)));
    let report = store.check(Depth::Quick).unwrap();
    assert!(
        !report.is_sound() && format!("{report:?}").contains("00000001"),
        "{report:?}"
    );
}

#[test]
fn deleting_gives_everything_back_and_nothing_that_others_need() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    committed_run(&store, "a", 0..=3);
    branch(&store, "a", 2);
    let refused = store.delete_run(&name("a"));
    assert!(
        matches!(refused, Err(DeleteError::InUse(InUse::Branch { .. }))),
        "{refused:?}"
    );
    commit(&store, "branch", 3);
    assert!(store.delete_run(&name("branch")).unwrap() > 0);
    store.delete_run(&name("a")).unwrap();
    assert_eq!(store.run_names().unwrap(), []);
    assert!(store.info().unwrap().pack_bytes < 100);
    assert!(matches!(
        store.delete_run(&name("a")),
        Err(DeleteError::Read(ReadError::NoSuchRun(_)))
    ));
    drop(store);
    // A crash after the rename: the next opening finishes it.
    fs::create_dir_all(dir.path().join("packs/.gone-b")).unwrap();
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(
        store.opening_report().len(),
        1,
        "{:?}",
        store.opening_report()
    );
    assert!(!dir.path().join("packs/.gone-b").exists());
    assert!(store.run_names().unwrap().is_empty());
    committed_run(&store, "a", 0..=1);
}
