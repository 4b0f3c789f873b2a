//! Pictures of runs: they show the field that they name, where it is, and nothing that is not a number.

mod common;

use std::fs;

use common::{BLOCK, Bench};

/// The block with one of its four elements twice as stiff, so that fields are not constant.
fn bench(element: &str) -> Bench {
    let bench = Bench::new();
    let input = BLOCK
        .replace(" } }\nmaterials", &format!(", element: {element} }} }}\nmaterials"))
        .replace(
            "materials: { rock:",
            "materials: { hard: { elastic: { young: 200.0, poisson: 0.25, initial_stress: -1.0 } }, rock:",
        )
        .replace("material: rock", "material: rock\nregions: [{ name: h, box: { from: [0, 0], to: [0.5, 0.5] }, material: hard }]");
    fs::write(bench.path("block.yaml"), input).unwrap();
    bench.submit("block.yaml");
    bench
}

fn svg(bench: &Bench, args: &[&str]) -> (String, serde_json::Value) {
    let file = bench.arg("picture.svg");
    let mut all = vec!["plot"];
    all.extend(args);
    all.extend(["--output", &file, "--json"]);
    let report = bench.run(&all).good().json();
    let text = fs::read_to_string(&file).unwrap();
    assert!(!text.contains("NaN") && !text.contains("inf"), "{args:?}");
    (text, report)
}

#[test]
fn every_field_of_every_element_is_drawn() {
    for element in ["Q8", "Q8_full", "Q4", "T6", "T6_full"] {
        let bench = bench(element);
        for field in [
            "shear_strain",
            "volume_strain",
            "stress_ratio",
            "mean_stress",
            "stress_xx",
            "stress_yy",
            "stress_xy",
            "displacement",
            "displacement_x",
            "displacement_y",
            "rev_cost",
            "void_ratio",
        ] {
            for by in ["nodes", "elements", "points"] {
                let (text, report) = svg(&bench, &["block@3", "--field", field, "--by", by]);
                assert!(
                    text.contains("block@3")
                        && text.contains("increment 3 of 3, press, down −0.0030"),
                    "{field}"
                );
                // Elastic elements have no void ratio: they are grey, not black and not left out.
                let grey = text.contains("fill=\"#e3e3e3\"");
                assert_eq!(grey, field == "void_ratio", "{element} {field} {by}");
                assert!(report["least"].as_f64().unwrap() <= report["greatest"].as_f64().unwrap());
            }
        }
    }
}

/// Held on all sides and pressed by 0.3 %, each quarter strains by about that; the hard one by less. By points nothing is
/// smoothed: the range is that of the values as computed.
#[test]
fn a_map_says_the_values_that_were_computed_and_where_the_greatest_is() {
    let bench = bench("Q8");
    let (_, report) = svg(
        &bench,
        &["block", "--field", "volume_strain", "--by", "points"],
    );
    let (least, greatest) = (
        report["least"].as_f64().unwrap(),
        report["greatest"].as_f64().unwrap(),
    );
    assert!(
        least < -0.3 && greatest > -0.3 && least > -0.6 && greatest < 0.0,
        "{report}"
    );
    assert_eq!(report["step"], 3);
    let element: u32 = report["greatest_at"].as_str().unwrap()[1..]
        .split('.')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    assert_eq!(element, 0, "the hard element is compressed least: {report}");
    // Smoothing shows nothing that no point has.
    let (_, smooth) = svg(&bench, &["block", "--field", "volume_strain"]);
    assert!(
        smooth["least"].as_f64().unwrap() >= least
            && smooth["greatest"].as_f64().unwrap() <= greatest
    );
    // The colours of a signed field are symmetric about zero.
    assert_eq!(
        report["colours"][0].as_f64().unwrap(),
        -report["colours"][1].as_f64().unwrap()
    );
    let (_, fixed) = svg(&bench, &["block", "--range=-1,0.5"]);
    assert_eq!(fixed["colours"], serde_json::json!([-1.0, 0.5]));
}

/// The hard quarter alone has one value.
#[test]
fn a_window_shows_what_is_in_it_and_its_colours_span_that() {
    let bench = bench("Q4");
    let ends = |window: &[&str]| {
        let mut args = vec!["block", "--by", "elements", "--deformed", "0"];
        args.extend(window);
        let (_, report) = svg(&bench, &args);
        ["least", "greatest"].map(|end| report[end].as_f64().unwrap())
    };
    let (all, hard) = (ends(&[]), ends(&["--window", "0.4,0.4,0.1,0.1"]));
    assert_eq!(hard[0], hard[1]);
    assert!(all[0] <= hard[0] && hard[0] < all[1], "{hard:?} of {all:?}");
}

/// What comes about between two steps adds up to the whole, as logarithmic strains without rotation do.
#[test]
fn an_increment_is_what_comes_about_in_between() {
    let bench = bench("Q4");
    let least = |span: &str| {
        let (text, report) = svg(
            &bench,
            &[span, "--field", "volume_strain", "--by", "points"],
        );
        assert_eq!(
            text.contains("increment of volume strain"),
            span.contains(".."),
            "{span}"
        );
        report["least"].as_f64().unwrap()
    };
    let (first, rest, whole) = (least("block@0..1"), least("block@1..3"), least("block@3"));
    assert!(
        (first + rest - whole).abs() < 1e-3 * whole.abs(),
        "{first} {rest} {whole}"
    );
    assert!(first.abs() < 0.5 * whole.abs());
    assert!((least("block@0..3") - whole).abs() < 1e-12);
}

#[test]
fn curves_of_several_runs_share_their_axes() {
    let bench = bench("Q8");
    bench.submit("block.yaml");
    let (text, report) = svg(
        &bench,
        &["block", "block-2@1..2", "--curve=-uy_top,-fy_top"],
    );
    assert_eq!(report["points"], serde_json::json!([4, 2]));
    assert_eq!(text.matches("<polyline").count(), 2);
    assert!(text.contains("−fy_top (force per thickness)") && text.contains("block-2@1..2"));
    let unknown = bench.run(&[
        "plot",
        "block",
        "--curve",
        "uy_top,fy_tpo",
        "-o",
        &bench.arg("x.svg"),
    ]);
    assert_eq!(unknown.code, 2);
    assert!(
        unknown.err.contains("no curve `fy_tpo`") && unknown.err.contains("fy_top"),
        "{}",
        unknown.err
    );
}

#[test]
fn what_cannot_be_drawn_is_refused_before_anything_is_written() {
    let bench = bench("Q8");
    bench.submit("grains.yaml");
    for args in [
        &["block", "block"][..],
        &["block@3..1"],
        &["block@9"],
        &["grains"],
        &["block", "--field", "colour"],
        &["block", "--range", "2,1"],
        &["block", "--window", "0,0,1"],
        &["block", "--window", "0,0,0,1"],
        &["block", "--window", "2,2,3,3"],
        &["block", "--curve=-uy_top,-fy_top", "--window", "0,0,1,1"],
        &["block", "--deformed", "nan"],
        &["block", "--curve", "uy_top"],
        &["block", "--curve", "step,syy", "--field", "displacement"],
    ] {
        let file = bench.arg("never.png");
        let mut all = vec!["plot"];
        all.extend(args);
        all.extend(["--output", &file]);
        let outcome = bench.run(&all);
        assert_eq!(outcome.code, 2, "{args:?}: {}", outcome.err);
        assert!(!bench.path("never.png").exists(), "{args:?}");
    }
    // An element test has curves.
    svg(&bench, &["grains", "--curve=-eyy,stress_ratio"]);
}

#[test]
fn a_png_is_one_and_the_same_twice() {
    let bench = bench("T6");
    let draw = |name: &str| {
        bench
            .run(&[
                "plot",
                "block@2",
                "--deformed",
                "50",
                "-o",
                &bench.arg(name),
            ])
            .good();
        fs::read(bench.path(name)).unwrap()
    };
    let first = draw("one.png");
    assert_eq!(&first[1..4], b"PNG");
    assert_eq!(first, draw("two.png"));
}

#[test]
fn the_revs_to_look_into_are_ranked() {
    let bench = Bench::new();
    let input = BLOCK
        .replace(
            "rock: { elastic: { young: 100.0, poisson: 0.25, initial_stress: -1.0 } }",
            "rock: { rev: { grains: 30, packings: { gallery: 3 } } }",
        )
        .replace("-0.003 }, steps: 3", "-0.001 }, steps: 1");
    fs::write(bench.path("block.yaml"), input).unwrap();
    bench.submit("block.yaml");
    let report = bench
        .run(&["show", "block@last", "--revs", "3", "--json"])
        .good()
        .json();
    let value = |list: &str, k: usize, key: &str| report[list][k][key].as_f64().unwrap();
    for (list, key) in [
        ("most_strained", "shear_strain"),
        ("least_converged", "residual"),
        ("slowest", "cpu_s"),
    ] {
        assert_eq!(report[list].as_array().unwrap().len(), 3, "{list}");
        assert!(
            value(list, 0, key) >= value(list, 1, key)
                && value(list, 1, key) >= value(list, 2, key)
        );
        assert!(value(list, 0, key) > 0.0, "{list}");
    }
    // Converged is what the solver calls so.
    assert!(value("least_converged", 0, "residual") <= 1e-3, "{report}");
    let text = bench.run(&["show", "block", "--revs"]).good().out;
    assert!(
        text.contains("most strained") && text.contains("rev show block@1:e"),
        "{text}"
    );
    let elements: Vec<&serde_json::Value> = report["slowest"]
        .as_array()
        .unwrap()
        .iter()
        .map(|line| &line["element"])
        .collect();
    assert!(
        elements[0] != elements[1] && elements[1] != elements[2],
        "one REV an element"
    );
}
