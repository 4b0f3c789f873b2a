//! A REV whose grains have come apart is a hole in the material. One that nobody asked for must not pass for a
//! solution, and one that was asked for must not stop the run.

mod common;

use std::fs;

use common::{Bench, curve};

/// Forty grains pulled apart along y and pushed together again.
const PULLED: &str = "\
name: pulled
element_test: { control: { xx: { strain: 0 }, yy: { strain: pull }, xy: { strain: 0 } } }
materials: { sand: { rev: { grains: 40 } } }
loads: { pull: 0.0 }
programme:
  - { name: apart, ramp: { pull: 0.06 }, steps: 3 }
  - { name: together, ramp: { pull: 0.0 }, steps: 3 }
";

/// One element on rollers, its top pulled up.
const LIFTED: &str = "\
name: lifted
mesh: { rectangle: { size: [1.0, 1.0], elements: [1, 1] } }
materials: { sand: { rev: { grains: 40 } } }
loads: { up: 0.0 }
boundary:
  - { on: left, displacement: { x: 0 } }
  - { on: right, displacement: { x: 0 } }
  - { on: bottom, displacement: { y: 0 } }
  - { on: top, displacement: { y: up } }
programme:
  - { name: lift, ramp: { up: 0.06 }, steps: 1 }
solver: { smallest_step: 0.5 }
";

fn allowing(input: &str) -> String {
    format!(
        "{}solver: {{ loss_of_confinement: allow }}\n",
        input.replace("solver: { smallest_step: 0.5 }\n", "")
    )
}

#[test]
fn lost_contacts_end_a_run_with_the_element_and_figures_unless_they_are_allowed() {
    let bench = Bench::new();
    for (input, name) in [(PULLED, "pulled"), (LIFTED, "lifted")] {
        let file = format!("{name}.yaml");
        fs::write(bench.path(&file), input).unwrap();
        let outcome = bench.run(&["submit", &bench.arg(&file)]);
        assert_eq!(outcome.code, 1, "{}", outcome.err);
        for word in [
            "all contacts lost",
            "det F = 1.0",
            "loss_of_confinement: allow",
        ] {
            assert!(outcome.err.contains(word), "{word}: {}", outcome.err);
        }
        assert_eq!(outcome.err.contains("e0.0"), name == "lifted");
    }
}

#[test]
fn an_allowed_void_carries_nothing_until_its_grains_touch_again() {
    let bench = Bench::new();
    fs::write(bench.path("pulled.yaml"), allowing(PULLED)).unwrap();
    bench.submit("pulled.yaml");
    bench
        .run(&["export", "pulled", "--into", &bench.arg("out")])
        .good();
    let (names, rows) = curve(&bench.path("out/curves.csv"));
    let at = |row: usize, name: &str| rows[row][names.iter().position(|n| n == name).unwrap()];
    assert_eq!(
        (at(3, "sxx"), at(3, "syy"), at(3, "coordination")),
        (0.0, 0.0, 0.0)
    );
    assert!(at(0, "syy") < -0.99 && at(6, "syy") < 0.0);
}

/// A void has no stiffness to give to the nodes around it: they hang on what is solid beside it.
#[test]
fn a_body_is_solved_with_a_void_beside_a_solid_element() {
    let bench = Bench::new();
    let rock = "rock: { elastic: { young: 100, poisson: 0.2, initial_stress: -1.0 } }";
    let stacked = allowing(LIFTED)
        .replace("elements: [1, 1] }", "elements: [1, 2] }")
        .replace("grains: 40 } }", &format!("grains: 40 }} }}, {rock}"))
        .replace(
            "loads:",
            "material: sand\nregions: [{ name: foot, elements: [0], material: rock }]\nloads:",
        );
    fs::write(bench.path("lifted.yaml"), stacked).unwrap();
    bench.submit("lifted.yaml");
}
