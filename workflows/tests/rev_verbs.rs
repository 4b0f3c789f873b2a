//! Packings and element tests by themselves give what runs give.

mod common;

use common::{Bench, curve, femdem};

#[test]
fn a_test_without_a_run_prints_the_curve_of_the_run() {
    let bench = Bench::new();
    let printed = femdem(&["rev", "test", &bench.arg("grains.yaml"), "--threads", "2"]).good();
    bench.submit("grains.yaml");
    bench
        .run(&["export", "grains", "--into", &bench.arg("out")])
        .good();
    assert_eq!(
        printed.out,
        std::fs::read_to_string(bench.path("out/curves.csv")).unwrap()
    );
    let (names, rows) = curve(&bench.path("out/curves.csv"));
    assert_eq!(rows.len(), 4);
    let at = |row: usize, name: &str| rows[row][names.iter().position(|n| n == name).unwrap()];
    // Pressed by 0.1 % and half released, at constant lateral stress.
    assert!((at(2, "eyy") + 0.001).abs() < 1e-12 && (at(3, "eyy") + 0.0005).abs() < 1e-12);
    assert!(at(2, "stress_ratio") > 2.0 * at(3, "stress_ratio"));
    assert!((0..4).all(|row| (at(row, "sxx") + 1.0).abs() < 1e-3));
    // e + 1 goes with the volume.
    let kept = |row: usize| (at(row, "void_ratio") + 1.0) / (at(row, "volume_strain") + 1.0);
    assert!((kept(2) / kept(0) - 1.0).abs() < 1e-12);

    let json = femdem(&["rev", "test", &bench.arg("grains.yaml"), "--json"])
        .good()
        .json();
    assert_eq!(json["rows"][2]["eyy"], at(2, "eyy"));
    let body = femdem(&["rev", "test", &bench.arg("block.yaml")]);
    assert_eq!(body.code, 2);
}

#[test]
fn a_packing_prepared_ahead_is_not_prepared_again() {
    let bench = Bench::new();
    let prepare = |extra: &[&str]| {
        let input = bench.arg("grains.yaml");
        let mut args = vec!["rev", "prepare", &input, "--json"];
        args.extend(extra);
        bench.run(&args)
    };
    let first = prepare(&[]).good().json();
    assert_eq!(
        (
            first["cached"].as_u64(),
            first["packings"].as_array().unwrap().len()
        ),
        (Some(0), 1)
    );
    assert!(
        first["packings"][0]["quality"]["residual"]
            .as_f64()
            .unwrap()
            < 1e-5
    );
    let second = prepare(&["--material", "sand"]).good().json();
    assert_eq!(second["cached"].as_u64(), Some(1));
    assert_eq!(second["packings"], first["packings"]);
    bench.submit("grains.yaml");
    let events = std::fs::read_to_string(bench.store().join("packs/grains/events.jsonl")).unwrap();
    assert!(
        events.contains(r#""data":{"cached":1,"packings":1},"event":"preparing""#),
        "{events}"
    );

    let unknown = prepare(&["--material", "mud"]);
    assert_eq!(unknown.code, 2);
    assert!(unknown.err.contains("`sand`"), "{}", unknown.err);
    let elastic = bench
        .run(&["rev", "prepare", &bench.arg("block.yaml")])
        .good();
    assert!(elastic.out.contains("No packings are needed"));
}

#[test]
fn a_rev_taken_out_of_a_run_is_in_the_state_it_had_there() {
    let bench = Bench::new();
    bench.submit("grains.yaml");
    let file = bench.arg("rev.json");
    bench.run(&["rev", "export", "grains@2:e0.0", &file]).good();
    let import = bench.run(&["rev", "import", &file, "--json"]).good().json();
    bench
        .run(&["export", "grains", "--into", &bench.arg("out")])
        .good();
    let (names, rows) = curve(&bench.path("out/curves.csv"));
    let at = |name: &str| rows[2][names.iter().position(|n| n == name).unwrap()];
    let stress = &import["at_rest"]["stress"];
    assert!(
        (stress[1][1].as_f64().unwrap() - at("syy")).abs() < 1e-4,
        "{stress}"
    );
    assert!((import["void_ratio"].as_f64().unwrap() - at("void_ratio")).abs() < 1e-12);
    assert!(import["residual_as_it_stands"].as_f64().unwrap() < 1e-3);

    let outside = bench.run(&["rev", "export", "grains@2:e0.1", &file]);
    assert_eq!(outside.code, 2);
    bench.submit("block.yaml");
    let elastic = bench.run(&["rev", "export", "block@2:e3.3", &file]);
    assert_eq!(elastic.code, 2);
    assert!(elastic.err.contains("no grains"), "{}", elastic.err);
}

#[test]
fn a_file_that_is_no_packing_is_refused_with_the_reason() {
    let bench = Bench::new();
    std::fs::write(bench.path("torn.json"), "{ \"Lx\": 1.0").unwrap();
    for name in ["torn.json", "missing.json", "block.yaml"] {
        let outcome = bench.run(&["rev", "import", &bench.arg(name)]);
        assert_eq!(outcome.code, 2, "{name}");
        assert!(outcome.err.contains(name), "{}", outcome.err);
    }
}

/// Every option of a preparation at once, and one that cannot be: what comes out must be what was asked for.
#[test]
fn a_packing_is_made_as_its_material_says() {
    let bench = Bench::new();
    let input = |target: &str| {
        format!(
            "\
name: graded
element_test: {{ path: biaxial }}
materials:
  sand:
    rev:
      grains: 100
      sizes: {{ log_normal: {{ deviation: 0.3 }} }}
      preparation_friction: 0.5
      aspect_ratio: 1.5
      anisotropy: {{ stress_ratio: 1.5, direction: 0 }}
      orientation: 30
      target: {target}
programme:
  - {{ name: press, ramp: {{ axial: -0.001 }}, steps: 1 }}
"
        )
    };
    let prepare = |target: &str| {
        std::fs::write(bench.path("graded.yaml"), input(target)).unwrap();
        bench.run(&["rev", "prepare", &bench.arg("graded.yaml"), "--json"])
    };
    let reached = prepare(
        "{ void_ratio: 0.195, tolerance: 0.004, by: { compression_cycles: { ratio: 3 } } }",
    )
    .good()
    .json();
    let packing = &reached["packings"][0];
    let number = |key: &str| packing[key].as_f64().unwrap();
    assert!((number("void_ratio") - 0.195).abs() <= 0.004, "{packing}");
    assert!(number("backbone_coordination") >= number("coordination"));
    assert!(packing["contact_anisotropy"]["amplitude"].as_f64().unwrap() > 0.0);
    assert!(packing["quality"]["densifying_cycles"].as_u64().unwrap() > 0);
    assert!(packing["quality"]["preparation_friction"] == 0.5);
    assert!(reached["cpu_s"][0].as_f64().unwrap() > 0.0);

    let lost = prepare("{ coordination: 5.9, by: { compression_cycles: { ratio: 1.1 } } }");
    assert_eq!(lost.code, 1);
    assert!(
        lost.err.contains("coordination 5.9 is out of reach"),
        "{}",
        lost.err
    );
}
