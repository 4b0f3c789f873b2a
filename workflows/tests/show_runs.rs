//! What is said of runs: also while another process owns the store, and when the one that computed a run is gone.

mod common;

use common::Bench;
use store::{RunName, RunState, Store};

#[test]
fn looking_needs_no_lock() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    let owner = Store::open(&bench.store()).unwrap();
    for args in [
        &["runs"][..],
        &["show", "block"],
        &["show", "block@last"],
        &["show", "block@0"],
        &["status"],
        &["status", "block"],
        &["store", "info"],
        &["store", "check"],
    ] {
        bench.run(args).good();
        let mut json = args.to_vec();
        json.push("--json");
        bench.run(&json).good().json();
    }
    bench
        .run(&["export", "block", "--into", &bench.arg("out")])
        .good();
    let refused = bench.run(&["resume", "block", "--alone"]);
    assert_eq!(refused.code, 3);
    assert!(
        refused.err.contains(&std::process::id().to_string()),
        "{}",
        refused.err
    );
    drop(owner);
    bench.run(&["resume", "block"]).good();
}

#[test]
fn a_run_shows_for_machines_what_scripts_rely_on() {
    let bench = Bench::new();
    let ended = bench.submit("block.yaml").json();
    let show = bench.run(&["show", "block", "--json"]).good().json();
    for key in ["name", "state", "steps", "digest"] {
        assert_eq!(show[key], ended[key], "{key}");
    }
    assert_eq!(
        (show["state"].as_str(), show["steps"].as_u64()),
        (Some("completed"), Some(3))
    );
    let digest = show["digest"].as_str().unwrap();
    assert!(
        digest.len() == 64 && digest.bytes().all(|b| b.is_ascii_hexdigit()),
        "{digest}"
    );
    assert!(show["cpu_s"].as_f64().unwrap() > 0.0);
    assert_eq!(
        (show["elements"].as_u64(), show["gauss_points"].as_u64()),
        (Some(4), Some(16))
    );
    let steps = show["per_step"].as_array().unwrap();
    assert_eq!(steps.len(), 4);
    assert_eq!(steps[3]["digest"], show["digest"]);
    assert_eq!(
        (steps[2]["step"].as_u64(), steps[2]["stage"].as_str()),
        (Some(2), Some("press"))
    );
    assert!((steps[2]["loads"][0].as_f64().unwrap() + 0.002).abs() < 1e-15);
    let residuals = steps[2]["residuals"].as_array().unwrap();
    assert_eq!(
        residuals.len() as u64,
        steps[2]["iterations"].as_u64().unwrap()
    );
    assert_eq!(residuals.last(), Some(&steps[2]["residual"]));
    let work = steps[2]["work"].as_f64().unwrap();
    assert!((work / (1.18 * 0.001) - 1.0).abs() < 2e-3, "{work}");
    assert_eq!([&steps[2]["released"], &steps[2]["damped"]], [0.0, 0.0]);
    assert_eq!(show["stages_ended"], serde_json::json!([]));

    let step = bench.run(&["show", "block@2", "--json"]).good().json();
    assert_eq!(step["digest"], steps[2]["digest"]);
    assert_eq!(step["sweeps"].as_array().unwrap().len(), residuals.len());
    let top = step["forces"]
        .as_array()
        .unwrap()
        .iter()
        .find(|f| f["on"] == "top")
        .unwrap()
        .clone();
    // The support presses down, and held sides bear no shear.
    assert!(top["support_force"][1].as_f64().unwrap() < -1.0);
    assert!((top["mean_displacement"][1].as_f64().unwrap() + 0.002).abs() < 1e-15);
}

#[test]
fn a_run_whose_process_died_is_not_called_running() {
    let bench = Bench::new();
    let before = bench.submit("block.yaml").json();
    let store = Store::open(&bench.store()).unwrap();
    let name = RunName::new("block").unwrap();
    store.set_run_state(&name, RunState::Running, "").unwrap();
    // This process owns the store and computed the run: it might be at it again.
    assert_eq!(
        bench.run(&["show", "block", "--json"]).good().json()["state"],
        "running"
    );
    drop(store);
    let show = bench.run(&["show", "block", "--json"]).good().json();
    assert_eq!(
        (show["state"].as_str(), show["killed"].as_bool()),
        (Some("interrupted"), Some(true))
    );
    assert!(
        bench
            .run(&["runs"])
            .good()
            .out
            .contains("interrupted (killed)")
    );
    assert!(bench.run(&["status"]).good().out.contains(" resume block`"));
    let after = bench.run(&["resume", "block", "--json"]).good().json();
    assert_eq!(
        (&after["state"], &after["digest"]),
        (&before["state"], &before["digest"])
    );
}

#[test]
fn a_complete_run_is_left_as_it_is() {
    let bench = Bench::new();
    let digest = bench.submit("block.yaml").json()["digest"].clone();
    let again = bench.run(&["resume", "block"]).good();
    assert!(again.out.contains("complete") && again.out.contains(digest.as_str().unwrap()));
    assert_eq!(
        bench.run(&["show", "block", "--json"]).json()["digest"],
        digest
    );
}

#[test]
fn a_mistyped_name_is_answered_with_those_that_exist() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    bench.submit("block.yaml");
    for args in [
        &["show", "blok"][..],
        &["resume", "blok"],
        &["status", "blok"],
        &["export", "blok"],
    ] {
        let outcome = bench.run(args);
        assert_eq!(outcome.code, 2, "{args:?}");
        assert!(
            outcome.err.contains("`block`, `block-2`"),
            "{}",
            outcome.err
        );
    }
    let outcome = bench.run(&["show", "block@9"]);
    assert_eq!(outcome.code, 2);
    assert!(outcome.err.contains("0 to 3"), "{}", outcome.err);
}

#[test]
fn nothing_is_made_of_a_store_that_is_not_there() {
    let bench = Bench::new();
    for args in [
        &["runs"][..],
        &["show", "block"],
        &["status"],
        &["store", "info"],
        &["store", "rebuild"],
    ] {
        assert_eq!(bench.run(args).code, 3, "{args:?}");
    }
    assert!(!bench.store().exists());
}

#[test]
fn a_step_that_cannot_be_solved_ends_the_run_in_order_and_can_be_tried_again() {
    let bench = Bench::new();
    // Pressed flat: beyond the last step the elements are inside out.
    let input = common::BLOCK.replace("-0.003", "-3.0") + "solver: { smallest_step: 1.0 }\n";
    std::fs::write(bench.path("flat.yaml"), input).unwrap();
    let failed = bench.run(&["submit", &bench.arg("flat.yaml"), "--json"]);
    assert_eq!(failed.code, 1, "{}", failed.err);
    let report = failed.json();
    assert_eq!(report["state"], "failed");
    assert_eq!(report["error"]["kind"], "run");
    let kept = report["steps"].clone();
    let again = bench.run(&["resume", "block", "--json"]);
    assert_eq!((again.code, &again.json()["steps"]), (1, &kept));
    let show = bench.run(&["show", "block", "--json"]).good().json();
    assert_eq!((&show["state"], &show["steps"]), (&report["state"], &kept));
    assert!(
        show["note"].as_str().unwrap().contains("cannot be solved"),
        "{show}"
    );
}
