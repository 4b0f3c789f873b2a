//! An archive is what is left of a run when its store is gone, and what travels to the machine that goes on with it. One that
//! lacks a step, that lets a flipped bit through, or that half arrives is worse than none: nobody looks at the original any
//! more.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use common::*;
use store::{
    ArchiveError, Depth, Digest, Extent, ImportError, Imported, Naming, RunState, StepHealth,
    StepIndex, Store, Taking, rename_run,
};

struct Shop {
    dir: tempfile::TempDir,
}

impl Shop {
    /// `a`: steps 1 to 3, called `dense`; `b`: branches off a@2, step 3.
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        build(&dir.path().join("from"));
        rename_run(&dir.path().join("from"), &name("a"), &name("dense")).unwrap();
        let log = dir.path().join("from/packs/a/events.jsonl");
        fs::write(log, "{\"event\":\"note\"}\n").unwrap();
        let shop = Self { dir };
        let store = shop.from();
        store
            .set_run_state(&name("a"), RunState::Interrupted, "stopped")
            .unwrap();
        drop(store);
        shop
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn from(&self) -> Store {
        Store::open(&self.path("from")).unwrap()
    }

    fn to(&self) -> Store {
        Store::open(&self.path("to")).unwrap()
    }

    fn export(&self, run: &str, extent: Extent) -> PathBuf {
        let file = self.path(&format!("{run}-{extent:?}"));
        let store = Store::open_read_only(&self.path("from")).unwrap();
        store.export_archive(&name(run), extent, &file).unwrap();
        file
    }
}

fn import(store: &Store, file: &Path) -> Imported {
    store.import_archive(file, Naming::AsItIs).unwrap()
}

fn digests(store: &Store, run: &str) -> Vec<(u32, Option<Digest>)> {
    let steps = store.steps(&name(run)).unwrap();
    steps
        .into_iter()
        .map(|step| (step.index.0, step.digest))
        .collect()
}

fn sound(store: &Store) {
    let report = store.check(Depth::Deep).unwrap();
    assert_eq!(report.findings, [], "{report:?}");
}

/// All files of a store beside its database, with their bytes.
fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("meta") {
                found.extend(files(&path));
                found.insert(path, Vec::new());
            }
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    found
}

#[test]
fn a_run_goes_on_elsewhere_as_it_would_have_where_it_was() {
    let shop = Shop::new();
    let file = shop.export("a", Extent::Subtree);
    let to = shop.to();
    let imported = import(&to, &file);
    assert_eq!(imported.root, name("a"));
    let taken: Vec<_> = imported.runs.iter().map(|run| run.taking).collect();
    assert_eq!(taken, [Taking::Whole, Taking::Whole]);
    let from = shop.from();
    for run in ["a", "b"] {
        assert_eq!(digests(&to, run), digests(&from, run));
        // Packs and records are the very bytes.
        for step in to.steps(&name(run)).unwrap() {
            let pack = format!("packs/{}/{:08}.pack", step.run, step.index.0);
            assert_eq!(
                fs::read(shop.path("to").join(&pack)).unwrap(),
                fs::read(shop.path("from").join(&pack)).unwrap()
            );
        }
        let (here, there) = (to.run(&name(run)).unwrap(), from.run(&name(run)).unwrap());
        assert_eq!(here, there);
    }
    assert_eq!(to.run(&name("a")).unwrap().label, Some(name("dense")));
    let log = fs::read_to_string(to.events_path(&name("a"))).unwrap();
    assert_eq!(log, "{\"event\":\"note\"}\n");
    sound(&to);
    let next = commit(&to, &name("a"), 4);
    assert_eq!(next.digest, commit(&from, &name("a"), 4).digest);
    drop(to);
    // The database has it all.
    let again = shop.to();
    assert_eq!(again.opening_report(), []);
    assert_step(&again, &name("b"), 3);
}

#[test]
fn a_branch_takes_what_it_stands_on_along() {
    let shop = Shop::new();
    let file = shop.path("b-Run");
    let onlooker = Store::open_read_only(&shop.path("from")).unwrap();
    let exported = onlooker
        .export_archive(&name("b"), Extent::Run, &file)
        .unwrap();
    assert_eq!(exported.runs, [name("b")]);
    assert_eq!(exported.ancestors[0].to_string(), "dense@2");
    assert_eq!(exported.bytes, fs::metadata(&file).unwrap().len());
    let to = shop.to();
    let imported = import(&to, &file);
    assert_eq!(imported.runs[0].taking, Taking::Part);
    for step in 1..=3 {
        assert_step(&to, &name("b"), step);
    }
    let ancestor = to.run(&name("a")).unwrap();
    assert_eq!(ancestor.last_step, Some(StepIndex(2)));
    assert_eq!(ancestor.state, RunState::Interrupted);
    assert!(ancestor.note.contains("up to 2"), "{ancestor:?}");
    sound(&to);
    // The ancestor is a run like others: it can go on from there.
    let digest = commit(&to, &name("a"), 3).digest;
    assert_eq!(Some(digest), digests(&shop.from(), "a")[2].1);
}

#[test]
fn names_that_are_taken_are_refused_or_given_anew_with_the_same_bits() {
    let shop = Shop::new();
    let file = shop.export("a", Extent::Subtree);
    let from = shop.from();
    let refused = from.import_archive(&file, Naming::AsItIs);
    assert!(
        matches!(&refused, Err(ImportError::Taken { by, .. }) if *by == name("dense")),
        "{refused:?}"
    );
    // Also where it is the label that is taken.
    let to = shop.to();
    to.create_run(new_run("dense")).unwrap();
    let before = files(&shop.path("to"));
    let refused = to.import_archive(&file, Naming::AsItIs);
    assert!(
        matches!(&refused, Err(ImportError::Taken { .. })),
        "{refused:?}"
    );
    assert_eq!(files(&shop.path("to")), before);

    let imported = from
        .import_archive(&file, Naming::Called(name("copy")))
        .unwrap();
    let names: Vec<_> = imported.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names, ["copy", "b-2"]);
    assert_eq!(digests(&from, "copy"), digests(&from, "a"));
    assert_eq!(digests(&from, "b-2"), digests(&from, "b"));
    assert_eq!(
        from.run(&name("b-2")).unwrap().parent.unwrap().to_string(),
        "copy@2"
    );
    for step in 1..=3 {
        assert_step(&from, &name("copy"), step);
        assert_step(&from, &name("b-2"), step);
    }
    // Sealed under their new names: they can do without the runs they were.
    from.delete_run(&name("b")).unwrap();
    from.delete_run(&name("a")).unwrap();
    sound(&from);
    let next = commit(&from, &name("copy"), 4).digest;
    import(&shop_to_empty(&shop), &file);
    let clean = Store::open(&shop.path("empty")).unwrap();
    assert_eq!(next, commit(&clean, &name("a"), 4).digest);
}

fn shop_to_empty(shop: &Shop) -> Store {
    Store::open(&shop.path("empty")).unwrap()
}

#[test]
fn an_ancestor_that_is_there_is_shared() {
    let shop = Shop::new();
    let file = shop.export("b", Extent::Run);
    let from = shop.from();
    from.delete_run(&name("b")).unwrap();
    let imported = import(&from, &file);
    assert_eq!(imported.runs[0].taking, Taking::There);
    assert_eq!(from.run_names().unwrap(), [name("a"), name("b")]);
    assert_step(&from, &name("b"), 3);
    sound(&from);

    // One of the same name that is another run is not.
    let to = shop.to();
    to.create_run(new_run("a")).unwrap();
    for step in 1..=3 {
        commit(&to, &name("a"), step + 10);
    }
    let refused = to.import_archive(&file, Naming::AsItIs);
    assert!(
        matches!(refused, Err(ImportError::Taken { .. })),
        "{refused:?}"
    );
    let imported = to
        .import_archive(&file, Naming::Called(name("mine")))
        .unwrap();
    let names: Vec<_> = imported.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names, ["a-2", "mine"]);
    assert_step(&to, &name("mine"), 1);
    sound(&to);
}

/// Ancestors come in first: one that is called as the run is to be called took its name, and the refusal blamed a run of
/// the store.
#[test]
fn a_name_that_is_asked_for_is_kept_from_the_ancestors_in_the_archive() {
    let shop = Shop::new();
    let file = shop.export("b", Extent::Run);
    for (folder, asked, ancestor, shown) in
        [("one", "a", "a-2", "dense"), ("two", "dense", "a", "a")]
    {
        let to = Store::open(&shop.path(folder)).unwrap();
        let naming = Naming::Called(name(asked));
        let imported = to.import_archive(&file, naming).unwrap();
        let born: Vec<_> = imported.runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(born, [ancestor, asked]);
        assert_eq!(to.names().unwrap().shown(&name(ancestor)), name(shown));
        assert_step(&to, &name(asked), 3);
        sound(&to);
    }
}

#[test]
fn pruned_steps_travel_as_what_is_left_of_them_and_lost_ones_stop_the_export() {
    let shop = Shop::new();
    let from = shop.from();
    commit(&from, &name("a"), 4);
    from.prune(&name("a"), |_| false).unwrap();
    let file = shop.export("a", Extent::Run);
    let to = shop.to();
    for naming in [Naming::AsItIs, Naming::Called(name("copy"))] {
        let imported = to.import_archive(&file, naming).unwrap();
        let steps = to.steps(&imported.root).unwrap();
        assert_eq!(steps[2].health, StepHealth::Pruned);
        assert_eq!(steps[2].summary, summary(3));
        assert_step(&to, &imported.root, 4);
    }
    sound(&to);

    let pack = shop.path("from/packs/a/00000002.pack");
    let whole = fs::read(&pack).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    let onlooker = Store::open_read_only(&shop.path("from")).unwrap();
    let target = shop.path("never");
    for bytes in [&whole[..whole.len() / 2], &flipped] {
        fs::write(&pack, bytes).unwrap();
        let refused = onlooker.export_archive(&name("a"), Extent::Run, &target);
        assert!(refused.is_err(), "{refused:?}");
        assert!(!target.exists());
        assert!(!shop.path("never.tmp").exists());
    }
    fs::remove_file(&pack).unwrap();
    let refused = onlooker.export_archive(&name("a"), Extent::Run, &target);
    assert!(
        matches!(&refused, Err(ArchiveError::Lost { step, .. }) if step.to_string() == "dense@2"),
        "{refused:?}"
    );
    fs::write(&target, "mine").unwrap();
    let refused = onlooker.export_archive(&name("b"), Extent::Run, &target);
    assert!(
        matches!(refused, Err(ArchiveError::Exists { .. })),
        "{refused:?}"
    );
}

#[test]
fn no_damaged_or_foreign_file_leaves_anything_behind() {
    let shop = Shop::new();
    let file = shop.export("a", Extent::Subtree);
    let whole = fs::read(&file).unwrap();
    let to = shop.to();
    to.create_run(new_run("other")).unwrap();
    let before = files(&shop.path("to"));
    let bad = shop.path("bad");
    let refuse = |bytes: &[u8], what: &str| {
        fs::write(&bad, bytes).unwrap();
        let refused = to.import_archive(&bad, Naming::AsItIs);
        let error = refused.expect_err(what);
        assert!(error.to_string().contains("bad"), "{what}: {error}");
        assert_eq!(files(&shop.path("to")), before, "{what}");
        assert_eq!(to.run_names().unwrap(), [name("other")], "{what}");
    };
    for at in (0..whole.len())
        .step_by(409)
        .chain(whole.len() - 60..whole.len())
    {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        refuse(&flipped, &format!("byte {at}"));
    }
    for len in (0..whole.len())
        .step_by(2003)
        .chain([7, 8, whole.len() - 1])
    {
        refuse(&whole[..len], &format!("{len} bytes"));
    }
    refuse(&[&whole[..], b"x"].concat(), "a byte more");
    refuse(b"", "empty");
    refuse(b"name: hollow\nmesh: {}\n", "another file");
    let mut later = whole.clone();
    later[7] = b'2';
    refuse(&later, "a later format");
    assert!(
        to.import_archive(&shop.path("none"), Naming::AsItIs)
            .is_err()
    );
    // What was refused so often still comes in.
    fs::write(&bad, &whole).unwrap();
    import(&to, &bad);
    sound(&to);
}

#[test]
fn a_crash_leaves_all_of_an_import_or_nothing() {
    let shop = Shop::new();
    let file = shop.export("a", Extent::Subtree);
    {
        let to = shop.to();
        import(&to, &file);
    }
    let packs = shop.path("to/packs");
    // Killed before it was decided: both runs still aside.
    let (aside, decided) = (packs.join(".import-new"), packs.join(".import-done"));
    fs::create_dir(&aside).unwrap();
    for run in ["a", "b"] {
        fs::rename(packs.join(run), aside.join(run)).unwrap();
    }
    fs::remove_dir_all(shop.path("to/meta")).unwrap();
    copy_folder(&aside, &shop.path("kept"));
    let looking = Store::open_read_only(&shop.path("to")).unwrap();
    assert_eq!(looking.run_names().unwrap(), []);
    let to = shop.to();
    assert!(to.run_names().unwrap().is_empty() && !aside.exists());
    drop(to);
    // Killed after it was decided, with one run in its place.
    copy_folder(&shop.path("kept"), &decided);
    fs::rename(decided.join("a"), packs.join("a")).unwrap();
    let to = shop.to();
    assert_eq!(to.run_names().unwrap(), [name("a"), name("b")]);
    let told = to.opening_report().iter();
    assert!(
        told.clone().any(|f| f.what.contains("finished an import")),
        "{:?}",
        to.opening_report()
    );
    assert!(!decided.exists());
    assert_step(&to, &name("b"), 3);
    sound(&to);
}
