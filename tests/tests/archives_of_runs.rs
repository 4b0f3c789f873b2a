//! A run that was carried to another machine as one file must go on there as it would have at home: with the same bits, from
//! every step, with what was noted on it. A copy that computes something else, or that lacks its ancestors, is found out a
//! week later.

use std::fs;
use std::path::PathBuf;

use tests::history;
use tests::inputs;
use tests::workplace::{Outcome, Workplace};

/// A body of 32 REVs, complete; stopped after its step 2 by taking it up there without computing; a note on it.
fn home() -> Workplace {
    let place = Workplace::new();
    let file = place.write("input.yaml", &inputs::biaxial_with_cuts("home", 40, 2));
    place.run(["submit", file.to_str().unwrap()]).success();
    place
        .run(["branch", "home@2", "--prepare-only", "--name", "later"])
        .success();
    place
        .run(["note", "later", "for the big machine"])
        .success();
    place.run(["rename", "home", "dense"]).success();
    place
}

fn archive(place: &Workplace, args: &[&str]) -> PathBuf {
    // A bare name, as people write it: the command works in the folder of the place.
    let file = place.dir().join("archive.runs");
    let args = [args, &["--archive", "archive.runs"]].concat();
    place.run(args).success();
    file
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

#[test]
fn a_run_resumed_elsewhere_ends_in_the_bits_of_the_undisturbed_one() {
    let place = home();
    let calm = history::of(&place.store(), "home").unwrap();
    let file = archive(&place, &["export", "later"]);
    for name in [None, Some("guest")] {
        let away = Workplace::new();
        let mut args = vec!["import", file.to_str().unwrap()];
        args.extend(name.into_iter().flat_map(|name| ["--name", name]));
        let told = json(&away.run([&args[..], &["--json"]].concat()).success());
        let run = name.unwrap_or("later");
        assert_eq!(told["name"], run);
        away.run(["resume", run, "--threads", "1"]).success();
        assert_eq!(history::of(&away.store(), run).unwrap(), calm);
        // The ancestor, cut where it was taken up, comes to the same end too, and so does a branch of it.
        away.run(["resume", "dense"]).success();
        assert_eq!(history::of(&away.store(), "dense").unwrap(), calm);
        away.run(["branch", &format!("{run}@1"), "--name", "again"])
            .success();
        assert_eq!(history::of(&away.store(), "again").unwrap(), calm);
        let show = away.run(["show", run]).success();
        assert!(show.out.contains("for the big machine"), "{show:?}");
        let log = away.run(["log", run]).success();
        assert!(log.out.contains("imported from"), "{log:?}");
        away.run(["verify", run]).success();
        away.run(["export", run]).success();
        let check = away.run(["store", "check", "--deep"]).success();
        assert!(check.out.contains("nothing is wrong"), "{check:?}");
    }
}

#[test]
fn a_tree_of_runs_travels_whole_and_clashes_are_told_before_anything_is_written() {
    let place = home();
    let file = archive(&place, &["export", "dense", "--subtree"]);
    let file = file.to_str().unwrap();
    let refused = place.run(["import", file]).ended_with(2);
    assert!(
        refused.err.contains("`dense`") && refused.err.contains("--name NAME"),
        "{refused:?}"
    );
    let runs = json(&place.run(["runs", "--json"]).success());
    assert_eq!(runs["runs"].as_array().unwrap().len(), 2, "{runs}");

    place.run(["import", file, "--name", "copy"]).success();
    let tree = place.run(["runs"]).success();
    assert!(tree.out.contains("└ later-2"), "{tree:?}");
    assert_eq!(
        history::of(&place.store(), "copy"),
        history::of(&place.store(), "dense")
    );
    place.run(["delete", "later"]).success();
    place.run(["delete", "dense"]).success();
    place.run(["resume", "later-2"]).success();
    assert_eq!(
        history::of(&place.store(), "later-2"),
        history::of(&place.store(), "copy")
    );
}

#[test]
fn files_that_are_no_whole_archive_end_in_words() {
    let place = home();
    let file = archive(&place, &["export", "dense"]);
    // It is not written over.
    let again = ["export", "dense", "--archive", file.to_str().unwrap()];
    place.run(again).ended_with(2);
    let whole = fs::read(&file).unwrap();
    let away = Workplace::new();
    let bad = away.dir().join("bad.runs");
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 16;
    for (bytes, code, words) in [
        (&whole[..whole.len() - 1], 3, "cut off"),
        (&flipped, 3, "damaged"),
        (&b"name: hollow\n"[..], 2, "find an archive"),
    ] {
        fs::write(&bad, bytes).unwrap();
        let refused = away.run(["import", bad.to_str().unwrap()]).ended_with(code);
        assert!(refused.err.contains(words), "{refused:?}");
        assert!(!away.store().exists(), "{words}: a store was made");
    }
    // In a store that is there, nothing stays behind.
    fs::write(&bad, &flipped).unwrap();
    let input = away.write("least.yaml", &inputs::least("least", 1));
    away.run(["submit", input.to_str().unwrap()]).success();
    away.run(["import", bad.to_str().unwrap()]).ended_with(3);
    let left = fs::read_dir(away.store().join("packs")).unwrap().count();
    assert_eq!(left, 1, "something stayed behind");
    away.run(["import", "no/such/file"]).ended_with(2);
    place.run(["export", "dense", "--subtree"]).ended_with(2);
}
