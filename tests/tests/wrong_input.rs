//! A typo found after a night in the queue costs the night, and a store that a refused input has touched is one that
//! nobody trusts. Every wrong input of `workflows/tests/wrong` goes through the real program: exit code 2, the place
//! named, nothing on stdout, no store made and none changed. (What the messages say is kept in `workflows`.)

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use tests::inputs;
use tests::workplace::Workplace;

fn wrong_inputs() -> Vec<PathBuf> {
    let folder = tests::root().join("workflows/tests/wrong");
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "yaml"))
        .collect();
    files.sort();
    assert!(files.len() > 50);
    files
}

/// Every file below a folder, with its content.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.clone(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn no_wrong_input_makes_a_store() {
    let place = Workplace::new();
    for file in wrong_inputs() {
        let outcome = place.run(["submit", file.to_str().unwrap()]).ended_with(2);
        let name = file.file_name().unwrap().to_str().unwrap();
        assert_eq!(outcome.out, "", "{name}");
        assert!(
            outcome.err.contains(name) && outcome.err.contains("error: "),
            "{}",
            outcome.err
        );
        assert!(
            outcome.err.contains("Error: failed to read the input"),
            "{}",
            outcome.err
        );
        assert!(!place.store().exists(), "{name} made a store");
    }
}

#[test]
fn all_problems_of_an_input_are_named_at_once() {
    let place = Workplace::new();
    let file = tests::root().join("workflows/tests/wrong/everything_at_once.yaml");
    let outcome = place.run(["submit", file.to_str().unwrap()]).ended_with(2);
    let problems = ["1:1", "4:64", "8:35", "8:53", "8:58", "16:18", "19:54"];
    for place in problems {
        let place = format!("everything_at_once.yaml:{place}");
        assert!(
            outcome.err.contains(&place),
            "{place} is not in {}",
            outcome.err
        );
    }
    assert!(
        outcome
            .err
            .contains(&format!("{} problems", problems.len())),
        "{}",
        outcome.err
    );
}

#[test]
fn a_wrong_input_leaves_the_store_as_it_is() {
    let place = Workplace::new();
    let good = place.write("good.yaml", &inputs::biaxial("good", 30, 1));
    place.run(["submit", good.to_str().unwrap()]).success();
    let before = contents(&place.store());
    for file in wrong_inputs().into_iter().step_by(10) {
        place.run(["submit", file.to_str().unwrap()]).ended_with(2);
    }
    place
        .run(["resume", "no-such-run", "--threads", "0"])
        .ended_with(2);
    assert_eq!(contents(&place.store()), before);
}

/// A refusal after the run is created would leave a run that can never be resumed, under the name that the corrected
/// input wants.
#[test]
fn a_packing_that_is_none_is_refused_before_there_is_a_run() {
    let place = Workplace::new();
    place.write("packing.json", "{ \"radii\": [1.0] }");
    let text = inputs::biaxial("imported", 30, 1).replace("grains: 30", "import: packing.json");
    let file = place.write("imported.yaml", &text);
    let outcome = place.run(["submit", file.to_str().unwrap()]).ended_with(2);
    assert!(outcome.err.contains("packing.json"), "{}", outcome.err);
    assert!(!place.store().exists(), "a store was made");
}
