//! A body under its own weight, from the input to the figures of the run.

mod common;

use common::Bench;

const COLUMN: &str = "\
name: column
mesh: { rectangle: { size: [1.0, 2.0], elements: [2, 3] } }
materials: { soil: { elastic: { young: 100.0, poisson: 0.3 } } }
loads: { weight: 0.0 }
boundary:
  - { on: left, displacement: { x: 0 } }
  - { on: right, displacement: { x: 0 } }
  - { on: bottom, displacement: { y: 0 } }
body_force: { y: weight }
programme:
  - { name: fill, ramp: { weight: -3.0 }, steps: 2 }
solver: { force_tolerance: 1e-12 }
";

#[test]
fn the_floor_bears_the_weight_and_a_run_can_be_taken_up_from_any_step() {
    let bench = Bench::new();
    std::fs::write(bench.path("column.yaml"), COLUMN).unwrap();
    let ended = bench.submit("column.yaml").json();
    for (step, weight) in [("1", 3.0), ("2", 6.0)] {
        let shown = bench.run(&["show", &format!("column@{step}"), "--json"]);
        let shown = shown.good().json();
        let forces = shown["forces"].as_array().unwrap();
        let floor = forces.iter().find(|force| force["on"] == "bottom").unwrap();
        let force = floor["support_force"][1].as_f64().unwrap();
        assert!((force - weight).abs() < 1e-11, "{force}");
    }
    let branch = bench.run(&["branch", "column@1", "--name", "again", "--json"]);
    assert_eq!(branch.good().json()["runs"][0]["digest"], ended["digest"]);
    // It decided what came before.
    let refused = bench.run(&["rerun", "column@1", "--set", "body_force.y=0"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("`body_force`"), "{}", refused.err);
    let plan = COLUMN.replace("y: weight }", "x: 0.5, y: weight }");
    std::fs::write(bench.path("leaning.yaml"), plan).unwrap();
    let plan = bench.run(&["plan", "submit", &bench.arg("leaning.yaml")]);
    let plan = plan.good().out;
    assert!(plan.contains("body_force.x: 0.0 (default) → 0.5"), "{plan}");
}
