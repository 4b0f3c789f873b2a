//! A second gradient from the input to the files: what is committed, shown, exported, and refused.

mod common;

use common::{Bench, curve, femdem};

/// Four elements of rock clamped below and pushed aside above: strain gradients everywhere.
const SHEARED: &str = "\
name: sheared
mesh: { rectangle: { size: [1.0, 1.0], elements: [2, 2] } }
materials: { rock: { elastic: { young: 100.0, poisson: 0.25 } } }
regions: [ { name: roof, material: rock, elements: [2, 3] } ]
material: rock
second_gradient: { D: 5.0 }
loads: { aside: 0.0 }
boundary:
  - { on: bottom, displacement: { x: 0, y: 0 } }
  - { on: top, displacement: { x: aside, y: 0 }, gradient: { held: [xx, xy, yx] } }
programme:
  - { name: push, ramp: { aside: 0.02 }, steps: 2 }
solver: { force_tolerance: 1e-8 }
";

fn with(change: &[(&str, &str)]) -> String {
    change.iter().fold(SHEARED.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

fn submitted(bench: &Bench, name: &str, text: &str) {
    std::fs::write(
        bench.path("input.yaml"),
        text.replace("name: sheared", &format!("name: {name}")),
    )
    .unwrap();
    bench.submit("input.yaml");
}

#[test]
fn the_fields_of_a_second_gradient_are_exported_and_shown() {
    let bench = Bench::new();
    submitted(&bench, "sheared", SHEARED);
    bench
        .run(&["export", "sheared", "--into", &bench.arg("out")])
        .good();
    let mesh = std::fs::read_to_string(bench.path("out/fields-0002.vtu")).unwrap();
    for name in [
        "gradient",
        "multiplier",
        "double_stress",
        "gradient_mismatch",
    ] {
        assert!(mesh.contains(&format!("Name=\"{name}\"")), "{name}");
    }
    let points = std::fs::read_to_string(bench.path("out/points-0002.vtu")).unwrap();
    assert!(points.contains("Name=\"double_stress\""));

    let show = bench.run(&["show", "sheared@2", "--json"]).good().json();
    let second = &show["second_gradient"];
    assert!(second["mismatch"].as_f64().unwrap() > 0.0);
    assert!(second["spread_between"].as_f64().unwrap() > 0.0);
    let sweeps = show["sweeps"].as_array().unwrap();
    assert!(sweeps.last().unwrap()["mismatch"].as_f64().unwrap() < 1e-8);
    let text = bench.run(&["show", "sheared@2"]).good().out;
    assert!(
        text.contains("second gradient") && text.contains("mismatch of v"),
        "{text}"
    );
}

#[test]
fn a_modulus_of_zero_is_a_plain_run_to_the_last_bit() {
    let bench = Bench::new();
    let gradient = (", gradient: { held: [xx, xy, yx] }", "");
    let digest = |name: &str, text: &str| {
        submitted(&bench, name, text);
        bench.run(&["show", name, "--json"]).good().json()["digest"].clone()
    };
    let plain = digest(
        "plain",
        &with(&[("second_gradient: { D: 5.0 }\n", ""), gradient]),
    );
    let zero = digest("zero", &with(&[("D: 5.0", "D: 0, regions: { roof: 0 }")]));
    let second = digest("second", SHEARED);
    assert_eq!(plain, zero);
    assert_ne!(plain, second);
    let text = bench.run(&["show", "plain@2"]).good().out;
    assert!(
        !text.contains("second gradient") && !text.contains("mismatch"),
        "{text}"
    );
    // Two runs, one with and one without, can still be compared.
    let compared = bench.run(&[
        "diff",
        "plain",
        "second",
        "--output",
        &bench.arg("apart.vtu"),
    ]);
    assert!(
        bench.path("apart.vtu").exists(),
        "{}{}",
        compared.out,
        compared.err
    );
}

#[test]
fn a_region_can_have_its_own_modulus_and_a_row_alone_can_be_plain() {
    let bench = Bench::new();
    submitted(
        &bench,
        "regions",
        &with(&[("D: 5.0", "D: 5.0, regions: { roof: 0 }")]),
    );
    bench
        .run(&["export", "regions", "--into", &bench.arg("out")])
        .good();
    let show = bench.run(&["show", "regions@last", "--json"]).good().json();
    assert!(show["second_gradient"]["mismatch"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_branch_takes_the_double_stresses_along_and_cannot_change_the_modulus() {
    let bench = Bench::new();
    submitted(&bench, "sheared", SHEARED);
    let whole = with(&[(
        "steps: 2",
        "steps: 2 }\n  - { name: on, ramp: { aside: 0.03 }, steps: 1",
    )]);
    submitted(&bench, "whole", &whole);
    let programme = "[{ name: on, ramp: { aside: 0.03 }, steps: 1 }]";
    let branch = [
        "branch",
        "sheared@2",
        "--programme",
        programme,
        "--name",
        "later",
    ];
    bench.run(&branch).good();
    let force = |run: &str| {
        let show = bench
            .run(&["show", &format!("{run}@3"), "--json"])
            .good()
            .json();
        show["forces"]
            .as_array()
            .unwrap()
            .iter()
            .map(|f| f["support_force"].to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(force("later"), force("whole"));
    let refused = bench.run(&["branch", "sheared@2", "--set", "second_gradient.D=1.0"]);
    assert!(
        refused.code != 0 && refused.err.contains("second_gradient"),
        "{}",
        refused.err
    );
}

#[test]
fn the_width_of_a_band_is_measured_on_a_biaxial_test() {
    let bench = Bench::new();
    let test = common::GRAINS
        .replace("grains: 30", "grains: 100")
        .replace("axial: -0.001 }, steps: 2", "axial: -0.06 }, steps: 30")
        .replace(
            "  - { name: back, ramp: { axial: -0.0005 }, steps: 1 }\n",
            "",
        );
    std::fs::write(bench.path("peak.yaml"), test).unwrap();
    let input = bench.arg("peak.yaml");
    let found = femdem(&[
        "rev",
        "test",
        &input,
        "--internal-length",
        "6.4e-3",
        "--json",
    ])
    .good();
    let length = &found.json()["internal_length"];
    let figure = |key: &str| length[key].as_f64().unwrap();
    // Width and modulus go together as w² and D.
    let width = figure("width");
    assert!(width > 0.0);
    assert!((figure("modulus_of_unit_width") * width * width / 6.4e-3 - 1.0).abs() < 1e-12);
    // Beside it, the output is the curve and nothing else.
    let plain = femdem(&["rev", "test", &input, "--internal-length", "6.4e-3"]).good();
    std::fs::write(bench.path("curve.csv"), &plain.out).unwrap();
    assert_eq!(curve(&bench.path("curve.csv")).1.len(), 31);

    let grains = bench.arg("grains.yaml");
    let early = femdem(&["rev", "test", &grains, "--internal-length", "1", "--json"]).good();
    assert!(early.json()["internal_length"].is_null());
    let negative = femdem(&["rev", "test", &input, "--internal-length", "-1"]);
    assert_eq!(negative.code, 2);
}
