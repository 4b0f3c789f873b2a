//! Whoever updates the program in the middle of a month of computing must find the runs of last week: listed, readable to the
//! last bit, and able to go on. The store under test was written by femdem-flow 0.1.0 with format 1.

use std::fs;
use std::path::Path;

use tests::history;
use tests::workplace::{Outcome, Workplace};

/// Digests of the steps of `parent`, as the version that computed them reported them.
const LAST_DIGEST: &str = "1aaa2eb9933ab180be1174c1f2f20a3aba10376b87e6d6ec0aa0ea8f9538a96e";

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}

fn old_store() -> Workplace {
    let place = Workplace::new();
    copy(
        &tests::root().join("tests/fixtures/format-1"),
        &place.store(),
    );
    place
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

#[test]
fn looking_at_an_old_store_works_and_leaves_it_as_it_is() {
    let place = old_store();
    let runs = json(&place.run(["runs", "--json"]).success());
    assert_eq!(runs["runs"].as_array().unwrap().len(), 2, "{runs}");
    let show = json(&place.run(["show", "parent", "--json"]).success());
    assert_eq!(
        (show["steps"].as_u64(), &show["state"]),
        (Some(4), &"completed".into())
    );
    assert_eq!(show["digest"], LAST_DIGEST);
    // Figures are stored field by field: a new one in the midst of the old ones would lose them all.
    let last = &show["per_step"][4];
    assert!(last["increment"].as_u64() > Some(0), "{last}");
    assert!(last["revs"]["solves"].as_u64() > Some(0), "{last}");
    place.run(["export", "parent"]).success();
    let format = fs::read_to_string(place.store().join("FORMAT")).unwrap();
    assert_eq!(format, "femdem-flow store format 1\n");
}

#[test]
fn an_old_store_is_taken_along_by_the_first_command_that_writes_and_goes_on() {
    let place = old_store();
    let before = history::of(&place.store(), "parent").unwrap();
    let resumed = place.run(["resume", "same"]).success();
    assert!(
        resumed.err.contains("format 1") && resumed.err.contains("format 2"),
        "the upgrade is not reported: {resumed:?}"
    );
    assert_eq!(history::of(&place.store(), "parent").unwrap(), before);
    assert_eq!(before.steps[4].1.to_string(), LAST_DIGEST);
    let same = history::of(&place.store(), "same").unwrap();
    assert_eq!(same.steps.len(), 5);
    assert_eq!(same.steps[..3], before.steps[..3]);
    place.run(["rename", "parent", "first"]).success();
    let check = place.run(["store", "check", "--deep"]).success();
    assert!(check.out.contains("nothing is wrong"), "{check:?}");
}

#[test]
fn a_store_of_a_later_version_is_refused_by_its_number() {
    let place = old_store();
    fs::write(place.store().join("FORMAT"), "femdem-flow store format 3\n").unwrap();
    for verb in [["runs"].as_slice(), &["resume", "same"]] {
        let refused = place.run(verb).ended_with(3);
        assert!(refused.err.contains("its format is 3"), "{refused:?}");
        assert!(
            refused.err.contains("use the femdem-flow version"),
            "{refused:?}"
        );
    }
}
