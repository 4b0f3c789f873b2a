//! Results that nobody can check are believed or not. Every answer of every REV of a committed run can be asked again from
//! what the store holds, alone, and must come out to the last bit, also where the run was killed on the way; what was
//! changed afterwards must be found and named.

use std::fs;
use std::path::Path;

use serde_json::Value;
use store::{FrameId, NewRun, RunName, RunState, Seal, StepIndex, Store};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::workplace::{Outcome, Signal, Workplace};

/// Kind of the frame of a Gauss point's state (`workflows/src/run/frames.rs`).
const POINT: u16 = 1;

fn json(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:#?}"))
}

fn computed(input: &str) -> Workplace {
    let place = Workplace::new();
    let file = place.write("input.yaml", input);
    place.run(["submit", file.to_str().unwrap()]).success();
    place
}

fn verify_all(place: &Workplace, run: &str) -> Value {
    let report = json(
        &place
            .run(["verify", run, "--sample", "100%", "--json"])
            .success(),
    );
    assert_eq!(report["sound"], true, "{report:#}");
    report
}

/// Steps that are cut and end in the path phase are built on several waves.
#[test]
fn every_answer_of_a_run_that_was_killed_comes_out_again() {
    let place = Workplace::new();
    let file = place.write("input.yaml", &inputs::biaxial("small", 40, 5));
    let ordeal = Ordeal {
        input: &file,
        run: "small",
        threads: 2,
    };
    let blow = Blow {
        events: 24,
        then: Default::default(),
        signal: Signal::KILL,
    };
    ordeal.hit(&place, blow);
    ordeal.arrive(&place);
    let report = verify_all(&place, "small");
    assert_eq!(report["tasks"], 5 * 32);
    assert_eq!(report["repeated"], 5 * 32);
    assert_eq!(report["not_recorded"], Value::from(Vec::<u32>::new()));

    // A sample is the same for the same seed, and one task at least.
    let sample = [
        "verify",
        "small@last",
        "--sample",
        "0.1%",
        "--seed",
        "3",
        "--json",
    ];
    let report = json(&place.run(sample).success());
    assert_eq!(
        (&report["tasks"], &report["repeated"]),
        (&32.into(), &1.into())
    );
}

#[test]
fn one_rev_is_replayed_with_its_grains() {
    let place = computed(&inputs::biaxial("small", 40, 2));
    let folder = place.dir().join("rev");
    let folder_arg = folder.to_str().unwrap();
    let outcome = place.run(["replay", "small@2:e3.1", "--output", folder_arg, "--json"]);
    let report = json(&outcome.success());
    assert_eq!(report["same_bits"], true);
    assert_eq!(report["stress"], report["stored_stress"]);
    let history = report["history"].as_array().unwrap();
    let residuals: Vec<f64> = history
        .iter()
        .map(|m| m["residual"].as_f64().unwrap())
        .collect();
    assert!(
        residuals.len() > 2 && residuals.is_sorted_by(|a, b| a > b),
        "{residuals:?}"
    );
    for name in ["grains-before.vtp", "grains-after.vtp", "report.json"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
    // The packing after is the one that the store gives out.
    let exported = place.dir().join("export.json");
    place
        .run(["rev", "export", "small@2:e3.1", exported.to_str().unwrap()])
        .success();
    let packing =
        |path: &Path| -> Value { serde_json::from_slice(&fs::read(path).unwrap()).unwrap() };
    assert_eq!(
        packing(&folder.join("packing-after.json")),
        packing(&exported)
    );

    for (what, code) in [
        ("small@2:e8.0", 2),
        ("small@0:e0.0", 2),
        ("small@7:e0.0", 2),
    ] {
        place.run(["replay", what]).ended_with(code);
    }
}

/// An element test records nothing beside its states: control and loads say what was asked.
#[test]
fn an_element_test_is_verified_too() {
    let place = computed(
        "name: one\nelement_test: { path: biaxial }\nmaterials: { sand: { rev: { grains: 40 } } }\n\
         programme:\n  - { name: load, ramp: { axial: -0.002 }, steps: 4 }\n",
    );
    assert_eq!(verify_all(&place, "one")["repeated"], 4);
    let report = json(&place.run(["replay", "one@3:e0.0", "--json"]).success());
    assert_eq!(report["same_bits"], true);
}

#[test]
fn a_flipped_bit_is_damage_and_named() {
    let place = computed(&inputs::biaxial("small", 30, 2));
    let pack = place.store().join("packs/small/00000001.pack");
    let mut bytes = fs::read(&pack).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&pack, bytes).unwrap();
    let report = json(&place.run(["verify", "small", "--json"]).ended_with(3));
    assert_eq!(report["damage"][0]["at"], "small@1");
}

/// A run whose hashes are all right and whose content was not computed: one REV has the end state of another.
fn forge(place: &Workplace) {
    let store = Store::open(&place.store()).unwrap();
    let honest = RunName::new("small").unwrap();
    let forged = NewRun {
        name: RunName::new("forged").unwrap(),
        created: 0,
        parent: None,
        manifest: store.run(&honest).unwrap().manifest,
    };
    let forged = store.create_run(forged).unwrap().name;
    for step in 0..=2 {
        let from = store.step(&honest, StepIndex(step)).unwrap();
        let mut extra: Vec<store::Frame> = from
            .frames()
            .into_iter()
            .map(|frame| store::Frame {
                id: frame.id,
                role: frame.role,
                encoding: store::Encoding::Floats,
                payload: from.frame(frame.id).unwrap(),
            })
            .collect();
        if step == 2 {
            // The state of the step before has the same grains.
            let before = store.step(&honest, StepIndex(1)).unwrap();
            let id = FrameId::new(POINT, 13);
            let frame = extra.iter_mut().find(|frame| frame.id == id).unwrap();
            frame.payload = before.frame(id).unwrap();
        }
        let seal = Seal {
            final_wave: None,
            extra,
            summary: from.summary().unwrap(),
        };
        let journal = store.journal(&forged, StepIndex(step)).unwrap();
        journal.commit(seal, |_| false).unwrap();
    }
    store
        .set_run_state(&forged, RunState::Completed, "")
        .unwrap();
}

#[test]
fn what_no_rev_answered_is_found_and_named() {
    let place = computed(&inputs::biaxial("small", 30, 2));
    forge(&place);
    let report = json(
        &place
            .run(["verify", "forged", "--sample", "1", "--json"])
            .ended_with(1),
    );
    assert_eq!(report["damage"], Value::from(Vec::<u32>::new()));
    let mismatches = report["mismatches"].as_array().unwrap();
    assert_eq!(mismatches.len(), 1);
    assert_eq!(mismatches[0]["at"], "forged@2:e3.1");
    let replayed = json(
        &place
            .run(["replay", "forged@2:e3.1", "--json"])
            .ended_with(1),
    );
    assert_eq!(replayed["same_bits"], false);

    let file = place.dir().join("difference.vtu");
    let diff = [
        "diff",
        "small",
        "forged",
        "--output",
        file.to_str().unwrap(),
        "--json",
    ];
    let report = json(&place.run(diff).success());
    assert_eq!(
        (&report["equal"], &report["step"]),
        (&false.into(), &2.into())
    );
    assert_eq!(
        report["contents"],
        Value::from(vec!["states of Gauss points"])
    );
    let revs = report["revs"].as_array().unwrap();
    assert_eq!(revs.len(), 1);
    assert_eq!(revs[0]["rev"], "e3.1");
    assert!(revs[0]["positions"].as_f64().unwrap() > 1e-6);
    assert!(
        fs::read_to_string(file)
            .unwrap()
            .contains("position_difference")
    );
}

#[test]
fn runs_part_where_their_settings_do() {
    let place = computed(&inputs::biaxial("small", 30, 3));
    let same = json(&place.run(["diff", "small", "small", "--json"]).success());
    assert_eq!(
        (&same["equal"], &same["common_steps"]),
        (&true.into(), &4.into())
    );

    // The steps up to 1 are shared; the REVs of step 2 are solved otherwise, and those of another branch stretched otherwise.
    let branch = |settings: &[&str]| {
        let mut args = vec!["branch", "small@1", "--json"];
        args.extend(settings);
        let report = json(&place.run(args).success());
        report["runs"][0]["name"]
            .as_str()
            .expect("a branch has a name")
            .to_owned()
    };
    let parting = |other: &str| {
        let report = json(&place.run(["diff", "small", other, "--json"]).success());
        assert_eq!(
            (&report["equal"], &report["step"]),
            (&false.into(), &2.into())
        );
        assert_eq!(report["revs"].as_array().unwrap().len(), 32);
        report["iteration"].clone()
    };
    let tighter = branch(&["--set", "solver.rev_tolerance=1e-5"]);
    assert_eq!(
        parting(&tighter),
        serde_json::json!({ "number": 1, "differs_in": "settings" })
    );
    let further = branch(&["--ramp", "shortening=-0.004", "--steps", "2"]);
    assert_eq!(
        parting(&further),
        serde_json::json!({ "number": 1, "differs_in": "questions" })
    );

    // What a branch shares is verified as its parent's, what it computed as its own.
    let report = verify_all(&place, &tighter);
    assert_eq!(report["repeated"], 3 * 32);

    place.run(["prune", "small", "--keep-last", "1"]).success();
    let report = verify_all(&place, "small");
    assert!(report["pruned"].as_u64().unwrap() > 0, "{report:#}");
}

#[test]
fn a_failed_task_can_be_looked_at_alone() {
    let place = Workplace::new();
    // The cell gets too low for its grains, and the step may not be cut.
    let input = "name: crushed\n\
        mesh: { rectangle: { size: [1.0, 1.0], elements: [1, 1] } }\n\
        materials: { sand: { rev: { grains: 40 } } }\n\
        loads: { down: 0.0 }\n\
        boundary:\n\
        \x20 - { on: left, displacement: { x: 0 } }\n\
        \x20 - { on: right, displacement: { x: 0 } }\n\
        \x20 - { on: bottom, displacement: { y: 0 } }\n\
        \x20 - { on: top, displacement: { y: down } }\n\
        programme:\n\
        \x20 - { name: press, ramp: { down: -0.85 }, steps: 1 }\n\
        solver: { smallest_step: 1.0 }\n";
    let file = place.write("input.yaml", input);
    place.run(["submit", file.to_str().unwrap()]).ended_with(1);
    let kept = place.store().join("failed/crushed/step1-e0.rmp");
    let folder = place.dir().join("rev");
    let kept = kept.to_str().unwrap();
    let replayed = place.run([
        "replay",
        kept,
        "--output",
        folder.to_str().unwrap(),
        "--json",
    ]);
    let report = json(&replayed.success());
    let first = &report["revs"][0];
    assert_eq!(first["rev"], "e0.0");
    assert!(
        first["error"].as_str().unwrap().contains("cell height"),
        "{first:#}"
    );
    assert!(folder.join("e0.0/grains-before.vtp").is_file());

    let torn = place.write("torn.rmp", "no task");
    place.run(["replay", torn.to_str().unwrap()]).ended_with(2);
}

/// Who pruned to save space learns how to come by the step again.
#[test]
fn a_step_whose_base_was_pruned_says_from_where_it_can_be_computed_again() {
    let place = computed(&inputs::least("small", 3));
    place.run(["prune", "small", "--keep-last", "1"]).success();
    let refused = place.run(["replay", "small@3:e0.1"]).ended_with(2);
    assert!(refused.err.contains(" rerun small@0`"), "{refused:?}");
    let rerun = ["rerun", "small@0", "--name", "again"];
    place.run(rerun).success();
    place.run(["replay", "again@3:e0.1"]).success();
}
