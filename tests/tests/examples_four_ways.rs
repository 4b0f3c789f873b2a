//! The examples are what users copy, and what they are told of restarts holds for them first: each one comes to the same
//! bits when nobody disturbs it, when it is stopped half way and resumed, when it is killed at random, and on
//! another number of threads. A new example is taken up by lying in the folder.

use std::path::Path;
use std::time::Duration;

use tests::examples::{self, Branches, Example};
use tests::history::{self, History};
use tests::ordeal::{Blow, Ordeal};
use tests::random::Random;
use tests::workplace::{Signal, Workplace};

/// One example in a place of its own.
fn place_of(example: &Example) -> Workplace {
    let place = Workplace::new();
    place.write("input.yaml", &example.text);
    for mesh in examples::meshes() {
        let name = mesh.file_name().expect("a file has a name");
        std::fs::copy(&mesh, place.dir().join(name)).expect("a temporary folder can be written to");
    }
    place
}

fn ordeal(run: &str, threads: u32) -> Ordeal<'_> {
    Ordeal {
        input: Path::new("input.yaml"),
        run,
        threads,
    }
}

fn of(place: &Workplace, run: &str) -> History {
    history::of(&place.store(), run).expect("the run has the name of its example")
}

/// Stops the run in order about half way and resumes it. A signal may come too late for a short one: then earlier.
fn stopped_and_resumed(run: &str, events: u64, begin: impl Fn() -> Workplace) -> Workplace {
    for (earlier, (signal, code)) in [
        (Signal::INT, 130),
        (Signal::TERM, 143),
        (Signal::INT, 130),
        (Signal::TERM, 143),
    ]
    .into_iter()
    .enumerate()
    {
        let place = begin();
        let blow = Blow {
            events: events / (2 + 2 * earlier as u64),
            then: Duration::ZERO,
            signal,
        };
        let outcome = ordeal(run, 2).hit(&place, blow);
        if outcome.code == Some(code) {
            assert!(outcome.err.contains("resume"), "{}", outcome.err);
            ordeal(run, 1).arrive(&place);
            return place;
        }
        // It was at its end before.
        outcome.success();
    }
    panic!("{run}: no signal stopped it, the test shows nothing");
}

/// Kills the run at random instants, resumes it, and lets it arrive.
fn killed_at_random(run: &str, seed: u64, events: u64, begin: impl Fn() -> Workplace) -> Workplace {
    let mut random = Random::new(seed);
    for _ in 0..4 {
        let place = begin();
        let mut hits = 0;
        for _ in 0..2 {
            let left = events.saturating_sub(ordeal(run, 2).events(&place)).max(4);
            let mut blow = Blow::random(&mut random, left * 3 / 4);
            blow.then /= 8;
            hits += u32::from(ordeal(run, 2).hit(&place, blow).signal == Some(9));
        }
        ordeal(run, 2).arrive(&place);
        if hits > 0 {
            return place;
        }
    }
    panic!("{run}: no kill hit it, the test shows nothing");
}

fn assert_same_four_ways(example: &Example, seed: u64) {
    let run = &example.name;
    let calm_place = place_of(example);
    let outcome = ordeal(run, 2).arrive(&calm_place);
    assert!(outcome.out.contains("is complete"), "{outcome:?}");
    let calm = of(&calm_place, run);
    let events = ordeal(run, 2).events(&calm_place);
    assert!(calm.steps.len() >= 5, "{run}: hardly anything was computed");

    let begin = || place_of(example);
    let stopped = stopped_and_resumed(run, events, begin);
    assert_eq!(of(&stopped, run), calm, "{run}, stopped and resumed");
    let killed = killed_at_random(run, seed, events, begin);
    assert_eq!(of(&killed, run), calm, "{run}, killed at random");
    let alone = begin();
    ordeal(run, 1).arrive(&alone);
    assert_eq!(of(&alone, run), calm, "{run}, on one thread");
}

#[test]
fn every_body_comes_to_the_same_bits_four_ways() {
    let examples = examples::all();
    let bodies = examples.iter().filter(|example| !example.is_element_test());
    for (seed, example) in bodies.enumerate() {
        assert_same_four_ways(example, seed as u64);
    }
}

#[test]
fn every_element_test_comes_to_the_same_bits_four_ways() {
    let examples = examples::all();
    let tests = examples.iter().filter(|example| example.is_element_test());
    for (seed, example) in tests.enumerate() {
        assert_same_four_ways(example, seed as u64);
    }
}

/// The branches of a file in the store of their parent, not yet computed; their names.
fn prepared(parent: &Workplace, branches: &Branches) -> (Workplace, Vec<String>) {
    let place = parent.copy();
    let file = format!("{}-branches.yaml", branches.name);
    place.write(&file, &branches.text);
    let at = format!("{}@{}", branches.name, branches.step);
    let made = place.run(["branch", &at, &file, "--prepare-only", "--json"]);
    let made = made.success();
    let made: serde_json::Value = serde_json::from_str(&made.out).expect("--json is JSON");
    let runs = made["runs"].as_array().expect("it lists the branches");
    let names = runs
        .iter()
        .map(|run| run["name"].as_str().expect("each has a name").to_owned());
    let names = names.collect();
    (place, names)
}

#[test]
fn every_branch_of_an_example_comes_to_the_same_bits_four_ways() {
    let examples = examples::all();
    for branches in examples::branches(&examples) {
        let parent = examples
            .iter()
            .find(|example| example.name == branches.name);
        let parent_place = place_of(parent.expect("it has a parent"));
        ordeal(&branches.name, 2).arrive(&parent_place);
        let (calm, names) = prepared(&parent_place, &branches);
        for (seed, run) in names.iter().enumerate() {
            let before = ordeal(run, 2).events(&calm);
            ordeal(run, 2).arrive(&calm);
            let history = of(&calm, run);
            let events = ordeal(run, 2).events(&calm) - before;
            let begin = || prepared(&parent_place, &branches).0;
            let stopped = stopped_and_resumed(run, events, begin);
            assert_eq!(of(&stopped, run), history, "{run}, stopped and resumed");
            let killed = killed_at_random(run, seed as u64, events, begin);
            assert_eq!(of(&killed, run), history, "{run}, killed at random");
            let alone = begin();
            ordeal(run, 1).arrive(&alone);
            assert_eq!(of(&alone, run), history, "{run}, on one thread");
        }
    }
}

/// At their full size they are not computed here, but each is taken, and planned as a whole.
#[test]
fn every_example_is_taken_as_it_stands() {
    let place = Workplace::new();
    for file in examples::inputs() {
        let file = file.to_str().expect("a plain name");
        place.run(["plan", "submit", file]).success();
    }
}
