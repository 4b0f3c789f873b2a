//! Exports: the curves are the mechanics of the body, and the fields are where the input wants them.

mod common;

use common::{Bench, curve};

fn column(names: &[String], name: &str) -> usize {
    names
        .iter()
        .position(|have| have == name)
        .unwrap_or_else(|| panic!("no {name} in {names:?}"))
}

/// Laterally held elastic compression: Δσ_yy = E(1 − ν)/((1 + ν)(1 − 2ν)) ε_yy = 120 ε_yy, Δσ_xx = ν/(1 − ν) Δσ_yy.
#[test]
fn the_curves_of_a_block_are_those_of_the_textbook() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    bench
        .run(&["export", "block", "--into", &bench.arg("out")])
        .good();
    let (names, rows) = curve(&bench.path("out/curves.csv"));
    assert_eq!(rows.len(), 4);
    let at = |name: &str| rows[3][column(&names, name)];
    assert_eq!(
        [at("step"), at("increment"), at("stage"), at("load_down")],
        [3.0, 3.0, 1.0, -0.003]
    );
    let close = |name: &str, expected: f64| {
        // The law is in rate form and the strain finite: the second order shows.
        assert!(
            (at(name) - expected).abs() < 2e-3 * expected.abs() + 1e-12,
            "{name}: {} for {expected}",
            at(name)
        );
    };
    close("uy_top", -0.003);
    close("volume", 0.997);
    close("volume_strain", -0.003);
    close("syy", -1.36);
    close("sxx", -1.12);
    close("fy_top", -1.36);
    close("fy_bottom", 1.36);
    close("fx_left", 1.12 * 0.997);
    // From −1 to −1.36 over −0.003.
    close("work", 0.00354);
    // No iterate starts from another one.
    assert_eq!([at("released"), at("damped")], [0.0, 0.0]);
    assert!(at("sxy").abs() < 1e-9);
    assert_eq!(rows[0][column(&names, "cpu_s")], 0.0);
}

#[test]
fn fields_are_written_as_often_and_as_many_as_the_input_says() {
    let bench = Bench::new();
    let input = common::BLOCK.replace("every: 2", "every: 2, fields: [displacement, stress]");
    std::fs::write(bench.path("block.yaml"), input).unwrap();
    bench.submit("block.yaml");
    let report = bench
        .run(&["export", "block", "--into", &bench.arg("out"), "--json"])
        .good()
        .json();
    let mut files: Vec<String> = std::fs::read_dir(bench.path("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    // Every second step, the first and the last.
    let steps = ["0000", "0002", "0003"];
    let of = |kind: &str| steps.map(|step| format!("{kind}-{step}.vtu"));
    let mut expected: Vec<String> = of("fields").into_iter().chain(of("points")).collect();
    expected.extend(["curves.csv", "fields.pvd", "points.pvd"].map(str::to_owned));
    expected.sort();
    assert_eq!(files, expected);
    assert_eq!(report["files"].as_array().unwrap().len(), files.len());

    let mesh = std::fs::read_to_string(bench.path("out/fields-0003.vtu")).unwrap();
    assert!(mesh.contains("\"displacement\"") && mesh.contains("\"material\""));
    assert!(!mesh.contains("\"strain\"") && !mesh.contains("void_ratio"));
    assert!(mesh.contains(r#"NumberOfPoints="21" NumberOfCells="4""#));
    let points = std::fs::read_to_string(bench.path("out/points-0003.vtu")).unwrap();
    assert!(points.contains(r#"NumberOfPoints="16" NumberOfCells="16""#));
    let film = std::fs::read_to_string(bench.path("out/fields.pvd")).unwrap();
    assert_eq!(film.matches("DataSet").count(), 3);
}

#[test]
fn exporting_twice_gives_the_same_files() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    for folder in ["one", "two"] {
        bench
            .run(&["export", "block", "--into", &bench.arg(folder)])
            .good();
    }
    for name in [
        "curves.csv",
        "fields-0002.vtu",
        "points-0002.vtu",
        "fields.pvd",
    ] {
        let read = |folder: &str| std::fs::read(bench.path(folder).join(name)).unwrap();
        assert_eq!(read("one"), read("two"), "{name}");
    }
}
