//! Pictures of REVs: drawn from the state that was asked for, readable by others, refused with a reason.

mod common;

use common::{Bench, femdem};
use resvg::{
    tiny_skia::Pixmap,
    usvg::{Options, Tree},
};

/// The text of the SVG group of this class.
fn group<'a>(svg: &'a str, class: &str) -> &'a str {
    let start = svg.find(&format!("class=\"{class}\"")).unwrap();
    let end = svg[start..].find("</g>").unwrap();
    &svg[start..start + end]
}

#[test]
fn a_picture_shows_every_grain_and_contact_of_the_state_once() {
    let bench = Bench::new();
    bench.submit("grains.yaml");
    let svg_file = bench.arg("pictures/rev.svg");
    let report = bench
        .run(&["rev", "show", "grains@2:e0.0", "-o", &svg_file, "--json"])
        .good()
        .json();
    let svg = std::fs::read_to_string(&svg_file).unwrap();
    Tree::from_str(&svg, &Options::default()).unwrap();
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");

    let packing = bench.arg("rev.json");
    let export = bench
        .run(&["rev", "export", "grains@2:e0.0", &packing, "--json"])
        .good()
        .json();
    let statistics = &report["statistics"];
    assert_eq!(statistics["contacts"], export["contacts"]);
    let count = |class, shape: &str| group(&svg, class).matches(shape).count() as u64;
    assert_eq!(count("grains", "<circle"), 30);
    assert_eq!(
        Some(count("contacts", "<line")),
        export["contacts"].as_u64()
    );
    let sliding =
        statistics["sliding_fraction"].as_f64().unwrap() * statistics["contacts"].as_f64().unwrap();
    assert_eq!(count("sliding", "<circle"), sliding.round() as u64);
    let dashed = group(&svg, "grains").matches("stroke-dasharray").count() as u64;
    assert_eq!(Some(dashed), statistics["rattlers"].as_u64());

    // The packing file holds the same REV.
    let png_file = bench.arg("rev.PNG");
    let again = bench
        .run(&["rev", "show", &packing, "--output", &png_file, "--json"])
        .good()
        .json();
    for key in ["pressure", "coordination", "sliding_fraction"] {
        let [a, b] = [&report, &again].map(|r| r["statistics"][key].as_f64().unwrap());
        assert!((a - b).abs() < 1e-9, "{key}: {a} for {b}");
    }
    let picture = Pixmap::load_png(&png_file).unwrap();
    let inked = |p: &&resvg::tiny_skia::PremultipliedColorU8| p.red() < 250;
    let share = picture.pixels().iter().filter(inked).count() as f64;
    assert!(share / picture.pixels().len() as f64 > 0.2, "an empty page");
}

#[test]
fn a_picture_that_cannot_be_is_refused_with_the_reason() {
    let bench = Bench::new();
    bench.submit("grains.yaml");
    bench.submit("block.yaml");
    std::fs::write(bench.path("wall"), "").unwrap();
    let behind = bench.arg("wall/a.png");
    let out = bench.arg("a.png");
    let torn = bench.arg("torn.json");
    std::fs::write(&torn, "{").unwrap();
    for (args, code, word) in [
        (["grains@2:e0.0", "-o", "a.pdf"], 2, ".svg"),
        (["grains@2:e0.0", "-o", "picture"], 2, ".png"),
        (["grains@2:e0.1", "-o", &out], 2, "e0.0 to e0.0"),
        (["grains@9:e0.0", "-o", &out], 2, "0 to 3"),
        (["grains@2", "-o", &out], 2, "e46.2"),
        (["gravel@2:e0.0", "-o", &out], 2, "gravel"),
        (["block@2:e3.3", "-o", &out], 2, "no grains"),
        (["nowhere.json", "-o", &out], 2, "nowhere.json"),
        ([&torn, "-o", &out], 2, "torn.json"),
        (["grains@2:e0.0", "-o", &behind], 1, "wall"),
    ] {
        let outcome = bench.run(&[&["rev", "show"], &args[..]].concat());
        assert_eq!(outcome.code, code, "{args:?}: {}", outcome.err);
        assert!(outcome.err.contains(word), "{args:?}: {}", outcome.err);
    }
    assert!(!bench.path("a.png").exists());
}

#[test]
fn every_kind_of_element_test_is_drawn_and_its_curve_not_lost_with_the_picture() {
    let bench = Bench::new();
    let tests = [
        ("biaxial", "axial: -0.001", "axial shortening"),
        ("isotropic", "mean_stress: -1.5", "mean stress"),
        ("simple_shear", "shear: 0.001", "shear strain"),
        ("constant_volume", "axial: -0.001", "axial shortening"),
    ];
    for (path, ramp, axis) in tests {
        let input = format!(
            "name: {path}\nelement_test: {{ path: {path} }}\nmaterials: {{ sand: {{ rev: {{ grains: 30 }} }} }}\nprogramme:\n  - {{ name: load, ramp: {{ {ramp} }}, steps: 2 }}\n"
        );
        std::fs::write(bench.path("test.yaml"), input).unwrap();
        let (file, picture) = (bench.arg("test.yaml"), bench.arg("test.svg"));
        let drawn = femdem(&["rev", "test", &file, "--plot", &picture, "--quiet"]).good();
        let plain = femdem(&["rev", "test", &file, "--quiet"]).good();
        assert_eq!(drawn.out, plain.out, "{path}");
        let svg = std::fs::read_to_string(&picture).unwrap();
        Tree::from_str(&svg, &Options::default()).unwrap();
        assert!(svg.contains(axis), "{path}");
        assert!(!svg.contains("NaN"), "{path}");
        // Three points of a curve in each panel.
        assert_eq!(svg.matches("<polyline").count(), 2, "{path}");
        assert_eq!(svg.matches("<circle").count(), 6, "{path}");
    }
    std::fs::write(bench.path("wall"), "").unwrap();
    let behind = bench.arg("wall/a.svg");
    let lost = femdem(&["rev", "test", &bench.arg("grains.yaml"), "--plot", &behind]);
    assert_eq!(lost.code, 1);
    assert!(
        lost.err.contains("wall") && lost.out.contains("stress_ratio"),
        "{}",
        lost.err
    );
}
