//! What may end a stage early: each condition at the step that it is met with, said wherever a run is reported, and at the
//! same step for whoever takes the run up before it.

mod common;

use std::fs;

use common::{BLOCK, Bench};
use serde_json::{Value, json};

/// The support force on `top` is −1 + 120 `down`, up to the second order of the strain.
const STAGES: &str = "\
programme:
  - { name: push, ramp: { down: -0.003 }, steps: 3, until: [{ displacement: top_mid, along: y, below: -0.0015 }] }
  - { name: press, ramp: { down: -0.006 }, steps: 4, until: [{ force: top, along: y, below: -1.45 }] }
  - { name: and back, cycle: { down: [-0.006, 0.0] }, steps: 4, until: [{ shear_strain: 0.1 }, { force: top, along: y, drop: 0.15 }] }
  - { name: once more, cycle: { down: [-0.004, 0.0] }, steps: 2, until: [{ load: down, drop: 0.4 }] }
  - { name: rest, hold: {}, steps: 1 }
";

fn stages(bench: &Bench) -> Value {
    let (body, _) = BLOCK.split_once("programme:").unwrap();
    fs::write(
        bench.path("stages.yaml"),
        format!("{body}{STAGES}").replace("name: block", "name: stages"),
    )
    .unwrap();
    bench.submit("stages.yaml").json()
}

fn loads(bench: &Bench, run: &str) -> Vec<f64> {
    let show = bench.run(&["show", run, "--json"]).good().json();
    let steps = show["per_step"].as_array().unwrap();
    steps
        .iter()
        .map(|step| step["loads"][0].as_f64().unwrap())
        .collect()
}

fn digests(bench: &Bench, run: &str) -> Vec<Value> {
    let show = bench.run(&["show", run, "--json"]).good().json();
    let steps = show["per_step"].as_array().unwrap();
    steps.iter().map(|step| step["digest"].clone()).collect()
}

#[test]
fn every_condition_ends_its_stage_and_every_report_says_so() {
    let bench = Bench::new();
    let ended = stages(&bench);
    let expected = [
        (
            2,
            "push",
            "the displacement of `top_mid` along y is below -0.0015",
        ),
        (
            4,
            "press",
            "the support force on `top` along y is below -1.45",
        ),
        (
            10,
            "and back",
            "the support force on `top` along y has dropped by 0.15 of its largest value",
        ),
        (
            13,
            "once more",
            "`down` has dropped by 0.4 of its largest value",
        ),
    ];
    let found = ended["stages_ended"].as_array().unwrap();
    let expected: Vec<Value> = expected
        .iter()
        .map(|(step, stage, ended)| json!({ "step": step, "stage": stage, "ended": ended }))
        .collect();
    assert_eq!(*found, expected);
    let show = bench.run(&["show", "stages", "--json"]).good().json();
    assert_eq!(show["stages_ended"], ended["stages_ended"]);
    let events = fs::read_to_string(bench.store().join("packs/stages/events.jsonl")).unwrap();
    assert_eq!(events.matches(r#""event":"stage_ended""#).count(), 4);
    let log = bench.run(&["log", "stages"]).good().out;
    assert!(
        log.contains("stage `push` ends with step 2: the displacement of `top_mid`"),
        "{log}"
    );

    // Each stage goes on from where the one before came to.
    let down = loads(&bench, "stages");
    for (step, expected) in [
        (2, -0.002),
        (4, -0.004),
        (8, -0.006),
        (10, -0.003),
        (12, -0.004),
        (13, -0.002),
        (14, -0.002),
    ] {
        assert!((down[step] - expected).abs() < 1e-12, "{step}: {down:?}");
    }
    assert_eq!(down.len(), 15);
}

/// The peak lies before the step that is taken up: whoever forgets it ends the stage later.
#[test]
fn a_peak_is_remembered_by_whoever_takes_the_run_up_behind_it() {
    let bench = Bench::new();
    stages(&bench);
    let calm = digests(&bench, "stages");
    for step in [6, 8, 9, 12] {
        let (at, name) = (format!("stages@{step}"), format!("from-{step}"));
        bench.run(&["rerun", &at, "--name", &name]).good();
        assert_eq!(digests(&bench, &name), calm, "{name}");
    }
    // Another stage has peaks of its own.
    let stage = "{ back: { ramp: { down: 0.0 }, steps: 3, until: [{ force: top, along: y, drop: 0.15 }] } }";
    let branch = [
        "branch",
        "stages@9",
        "--programme",
        stage,
        "--name",
        "anew",
        "--json",
    ];
    let ended = bench.run(&branch).good().json();
    // From −1.54 at −0.0045: −1.36 at −0.003 is not enough, −1.18 at −0.0015 is.
    assert_eq!(ended["runs"][0]["stages_ended"][2]["step"], 11, "{ended}");
    let branch = ["branch", "stages@9", "--programme", "back: 3"];
    let refused = bench.run(&branch);
    let told = "`programme[0]` must be a map `{key: …}`, not the number 3";
    assert!(
        refused.code != 0 && refused.err.contains(told),
        "{}",
        refused.err
    );
}

/// What counts is whether a support is there, not by which name the condition calls it: every column of the curves that can
/// be other than 0 can end a stage.
#[test]
fn a_support_is_found_by_its_nodes() {
    let bench = Bench::new();
    let (body, _) = BLOCK.split_once("programme:").unwrap();
    let held = [
        ("bottom", "y"),
        ("bottom", "x"),
        ("bottom_mid", "y"),
        ("bottom_left", "x"),
        ("bottom_left", "y"),
        ("left", "y"),
        ("corners", "y"),
    ];
    let free = [("bottom_mid", "x"), ("top_mid", "x")];
    for (on, along) in held.into_iter().chain(free) {
        let until = format!("[{{ force: {on}, along: {along}, below: -1000 }}]");
        let stage = format!("- {{ name: a, ramp: {{ down: -0.003 }}, steps: 3, until: {until} }}");
        fs::write(
            bench.path("held.yaml"),
            format!("{body}programme:\n  {stage}\n"),
        )
        .unwrap();
        let read = workflows::input::load(bench.path("held.yaml"));
        let is_held = held.contains(&(on, along));
        match read {
            Ok(_) => assert!(is_held, "{on} {along}"),
            Err(errors) => {
                let text = errors.to_string();
                assert!(
                    !is_held && text.contains("it is on `left`, `right`"),
                    "{text}"
                );
            }
        }
    }
}
