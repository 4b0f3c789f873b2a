//! The database can be lost at any time: the packs and records rebuild it, and no step goes missing silently.

mod common;

use std::fs;
use std::path::Path;

use common::*;
use store::{Depth, JournalError, ReadError, RunState, Severity, StepHealth, StepIndex, Store};

fn assert_whole(dir: &Path) {
    let store = Store::open(dir).unwrap();
    assert_eq!(store.run_names().unwrap(), [name("a"), name("b")]);
    for step in 1..=3 {
        assert_step(&store, &name("a"), step);
        assert_step(&store, &name("b"), step);
    }
    let report = store.check(Depth::Deep).unwrap();
    assert_eq!(report.findings, [], "after the repair");
    assert_eq!(report.packs, 5);
}

#[test]
fn a_deleted_emptied_or_garbled_database_is_rebuilt() {
    let original = tempfile::tempdir().unwrap();
    build(original.path());
    type Harm = fn(&Path);
    let harms: [(&str, Harm); 5] = [
        ("deleted", |meta| fs::remove_dir_all(meta).unwrap()),
        ("emptied", |meta| {
            fs::remove_dir_all(meta).unwrap();
            fs::create_dir(meta).unwrap();
        }),
        ("a file", |meta| {
            fs::remove_dir_all(meta).unwrap();
            fs::write(meta, "x").unwrap();
        }),
        ("log emptied", |meta| {
            fs::write(meta.join("db"), "").unwrap()
        }),
        ("log garbled", |meta| {
            let len = fs::metadata(meta.join("db")).unwrap().len() as usize;
            fs::write(meta.join("db"), vec![0xa5; len]).unwrap();
        }),
    ];
    for (what, harm) in harms {
        let dir = tempfile::tempdir().unwrap();
        copy_folder(original.path(), dir.path());
        harm(&dir.path().join("meta"));
        let store = Store::open(dir.path()).unwrap();
        assert!(
            !store.opening_report().is_empty(),
            "{what}: nothing reported"
        );
        drop(store);
        assert_whole(dir.path());
        let again = Store::open(dir.path()).unwrap();
        assert_eq!(again.opening_report(), [], "{what}: rebuilt twice");
    }
}

#[test]
fn rebuilding_on_demand_finds_everything() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let store = Store::open(dir.path()).unwrap();
    store
        .set_run_state(&name("a"), RunState::Completed, "")
        .unwrap();
    let before = store.steps(&name("b")).unwrap();
    let report = store.rebuild().unwrap();
    assert_eq!((report.runs, report.steps, report.lost), (2, 4, 0));
    assert_eq!(store.steps(&name("b")).unwrap(), before);
    commit(&store, &name("b"), 4);
    drop(store);
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(store.opening_report(), []);
    assert_eq!(store.run(&name("a")).unwrap().state, RunState::Completed);
}

#[test]
fn a_lost_pack_is_listed_as_missing_with_or_without_the_database() {
    for (lost, database) in [
        (1, true),
        (2, true),
        (3, true),
        (1, false),
        (2, false),
        (3, false),
    ] {
        let dir = tempfile::tempdir().unwrap();
        build(dir.path());
        let store = Store::open(dir.path()).unwrap();
        store
            .set_run_state(&name("a"), RunState::Running, "")
            .unwrap();
        drop(store);
        fs::remove_file(dir.path().join(format!("packs/a/0000000{lost}.pack"))).unwrap();
        if !database {
            fs::remove_dir_all(dir.path().join("meta")).unwrap();
        }
        let store = Store::open(dir.path()).unwrap();
        let steps = store.steps(&name("a")).unwrap();
        assert_eq!(steps.len(), 3, "step {lost} vanished, database {database}");
        assert_eq!(steps[lost - 1].health, StepHealth::Missing);
        assert_eq!(steps[lost - 1].digest.is_some(), database);
        let error = store.step(&name("a"), StepIndex(lost as u32)).unwrap_err();
        assert!(matches!(error, ReadError::PackMissing { .. }), "{error}");
        assert!(!store.check(Depth::Quick).unwrap().is_sound());
        let onlooker = Store::open_read_only(dir.path()).unwrap();
        assert!(!onlooker.check(Depth::Quick).unwrap().is_sound());
    }
}

#[test]
fn a_run_with_a_damaged_last_step_can_be_set_back_and_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let pack = dir.path().join("packs/a/00000003.pack");
    let bytes = fs::read(&pack).unwrap();
    fs::write(&pack, &bytes[..bytes.len() - 9]).unwrap();
    let store = Store::open(dir.path()).unwrap();
    let report = store.opening_report();
    assert!(
        report
            .iter()
            .any(|f| f.severity == Severity::Damage && f.path == pack),
        "{report:?}"
    );
    let a = name("a");
    let refused = store.journal(&a, StepIndex(4)).unwrap_err();
    assert!(
        matches!(refused, JournalError::PredecessorDamaged { .. }),
        "{refused}"
    );
    assert!(
        store.set_back(&a, StepIndex(2)).is_err(),
        "b branches off a@2"
    );
    assert_eq!(store.set_back(&a, StepIndex(3)).unwrap(), 1);
    assert_eq!(store.run(&a).unwrap().last_step, Some(StepIndex(2)));
    commit(&store, &a, 3);
    assert_step(&store, &a, 3);
    drop(store);
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(store.opening_report(), []);
    assert_eq!(store.steps(&a).unwrap().len(), 3);
    assert!(store.check(Depth::Deep).unwrap().is_sound());
}

#[test]
fn a_run_whose_record_is_lost_is_named_and_takes_no_other_with_it() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    for file in ["run.rmp", "run.copy.rmp"] {
        fs::write(dir.path().join("packs/b").join(file), "x").unwrap();
    }
    let store = Store::open(dir.path()).unwrap();
    assert_eq!(store.run_names().unwrap(), [name("a"), name("b")]);
    let error = store.run(&name("b")).unwrap_err().to_string();
    assert!(error.contains("packs/b/run.rmp"), "{error}");
    assert!(store.runs().is_err(), "the run vanished from the list");
    let report = store.opening_report();
    assert!(
        report
            .iter()
            .any(|finding| finding.severity == Severity::Damage)
    );
    assert_step(&store, &name("a"), 3);
    assert!(!store.check(Depth::Quick).unwrap().is_sound());
    assert!(dir.path().join("packs/b/00000003.pack").exists());
}

#[test]
fn a_cache_entry_written_by_many_at_once_is_one_of_theirs() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let key = store::Digest::of(b"packing");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..5 {
                    store.cache_put(&key, state(1, 1, 500)).unwrap();
                }
            });
        }
    });
    assert_eq!(store.cache_get(&key), Some(state(1, 1, 500)));
    assert!(store.check(Depth::Deep).unwrap().findings.is_empty());
}
