//! A run is renamed when people have understood what it is; from then on a list that says the old name, a branch drawn under a run
//! that nobody finds, or an address that means another run than yesterday costs them the wrong experiment.

use std::thread::sleep;
use std::time::{Duration, Instant};

use tests::history;
use tests::inputs;
use tests::workplace::{Outcome, Workplace};

const TEST: &str = "name: trial\nelement_test: { path: biaxial }\nmaterials: { sand: { rev: { grains: 20 } } }\n\
                    programme: [ { name: load, ramp: { axial: -0.002 }, steps: 4 } ]\n";

fn submitted() -> Workplace {
    let place = Workplace::new();
    let file = place.write("input.yaml", TEST);
    place.run(["submit", file.to_str().unwrap()]).success();
    place
        .run(["branch", "trial@2", "--name", "child"])
        .success();
    place
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

#[test]
fn the_new_name_stands_wherever_people_look() {
    let place = submitted();
    let before = history::of(&place.store(), "trial").unwrap();
    let renamed = place.run(["rename", "trial", "dense"]).success();
    assert!(
        renamed.out.contains("`trial` is called `dense` now"),
        "{renamed:?}"
    );
    assert_eq!(history::of(&place.store(), "dense").unwrap(), before);

    // No word of the old name, but where it says that it still works.
    for verb in [
        ["runs"].as_slice(),
        &["show", "dense"],
        &["show", "trial"],
        &["show", "dense@2"],
        &["show", "child"],
        &["status", "dense"],
        &["resume", "trial"],
        &["verify", "trial"],
        &["diff", "trial", "child"],
        &["plan", "branch", "trial@1"],
        &["branch", "trial@3", "--prepare-only", "--name", "late"],
        &["export", "trial"],
    ] {
        let told = place.run(verb).success();
        assert!(told.out.contains("dense"), "{verb:?}: {told:?}");
        assert!(
            !told.out.contains("trial") && !told.err.contains("trial"),
            "{verb:?}: {told:?}"
        );
    }
    assert!(place.dir().join("dense/curves.csv").exists());
    let log = place.run(["log", "trial"]).success();
    assert!(
        log.out.contains("renamed from `trial` to `dense`"),
        "{log:?}"
    );
    let show = json(&place.run(["show", "child", "--json"]).success());
    assert_eq!(show["parent"], "dense@2");
    let show = json(&place.run(["show", "dense", "--json"]).success());
    assert_eq!(
        (&show["name"], &show["born_as"]),
        (&"dense".into(), &"trial".into())
    );
    assert_eq!(show["children"][0]["name"], "child");

    // Refusals say it too.
    let refused = place.run(["delete", "trial"]).ended_with(2);
    assert!(refused.err.contains("takes up dense@2"), "{refused:?}");
    let refused = place.run(["show", "dense@77"]).ended_with(2);
    assert!(refused.err.contains("of run `dense`"), "{refused:?}");
    let refused = place.run(["show", "nobody"]).ended_with(2);
    assert!(refused.err.contains("`dense`"), "{refused:?}");
}

#[test]
fn a_name_that_somebody_answers_to_is_not_given_twice() {
    let place = submitted();
    place.run(["rename", "trial", "dense"]).success();
    for taken in ["dense", "trial"] {
        let refused = place.run(["rename", "child", taken]).ended_with(2);
        assert!(
            refused.err.contains("belongs to the run `dense`"),
            "{refused:?}"
        );
    }
    // A new run that wants the first name of another one does not get it.
    let file = place.dir().join("input.yaml");
    let again = place.run(["submit", file.to_str().unwrap()]).success();
    assert!(again.out.contains("`trial-2`"), "{again:?}");
    let planned = place.run(["plan", "submit", file.to_str().unwrap(), "--name", "dense"]);
    assert!(planned.out.contains("`dense-2`"), "{planned:?}");
    let back = place.run(["rename", "dense", "trial"]).success();
    assert!(!back.out.contains("still finds it"), "{back:?}");
    place.run(["show", "dense"]).ended_with(2);
}

#[test]
fn a_run_is_renamed_while_it_is_computed_and_ends_where_it_would_have() {
    let place = Workplace::new();
    let file = place.write("input.yaml", &inputs::biaxial("long", 40, 12));
    let session = place.start(["submit", file.to_str().unwrap()]);
    let begun = Instant::now();
    while history::told(&place.store(), "long").is_none_or(|long| long.steps.is_empty()) {
        assert!(begun.elapsed() < Duration::from_secs(120), "{session:?}");
        sleep(Duration::from_millis(20));
    }
    place.run(["rename", "long", "slow"]).success();
    let ended = session.wait().success();
    assert!(ended.out.contains("Run `slow` is complete"), "{ended:?}");
    let calm = Workplace::new();
    let file = calm.write("input.yaml", &inputs::biaxial("long", 40, 12));
    calm.run(["submit", file.to_str().unwrap()]).success();
    assert_eq!(
        history::of(&place.store(), "slow"),
        history::of(&calm.store(), "long")
    );
    let check = place.run(["store", "check", "--deep"]).success();
    assert!(check.out.contains("nothing is wrong"), "{check:?}");
}

/// Somebody who asked for a name looks for the run under it, and takes the older one for the new.
#[test]
fn a_run_that_does_not_get_the_name_that_was_asked_for_it_says_so() {
    let place = submitted();
    let told = "the name `child` is taken: this run is called `child-2`";
    let outcome = place
        .run(["branch", "trial@2", "--name", "child"])
        .success();
    assert!(outcome.err.contains(told), "{outcome:?}");
    let told = "the name `trial` is taken: this run is called `trial-2`";
    let input = place.dir().join("input.yaml");
    let input = input.to_str().unwrap();
    let outcome = place.run(["submit", input, "--name", "trial"]).success();
    assert!(outcome.err.contains(told), "{outcome:?}");
    // The input's own name is a wish that many runs have.
    let outcome = place.run(["submit", input]).success();
    assert!(!outcome.err.contains("is taken"), "{outcome:?}");
    let outcome = place.run(["submit", input, "--name", "new"]).success();
    assert!(!outcome.err.contains("is taken"), "{outcome:?}");
    let queued = ["submit", input, "--name", "new", "--queue"];
    let outcome = place.run(queued).success();
    assert!(
        outcome
            .out
            .contains("`new-2` is queued as number 1, at position 1 (`new` is taken)"),
        "{outcome:?}"
    );
}

#[test]
fn a_run_that_only_waits_is_told_from_one_that_is_not_there() {
    let place = submitted();
    let input = place.dir().join("input.yaml");
    let queued = [
        "submit",
        input.to_str().unwrap(),
        "--name",
        "late",
        "--queue",
    ];
    place.run(queued).success();
    let refused = place.run(["rename", "late", "later"]).ended_with(2);
    assert!(
        refused
            .err
            .contains("it is queued as number 1 and not begun"),
        "{refused:?}"
    );
    let refused = place.run(["rename", "never", "later"]).ended_with(2);
    assert!(!refused.err.contains("queued"), "{refused:?}");
    // One that is there and waits to be gone on with can be renamed, and is found all the same.
    place
        .run(["branch", "trial@1", "--name", "part", "--prepare-only"])
        .success();
    place.run(["resume", "part", "--queue"]).success();
    let renamed = place.run(["rename", "part", "whole"]).success();
    assert!(
        renamed.out.contains("it is queued as number 2"),
        "{renamed:?}"
    );
    place.run(["queue", "run"]).success();
    let shown = json(&place.run(["show", "whole", "--json"]).success());
    assert_eq!(shown["state"], "completed");
}
