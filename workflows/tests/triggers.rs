//! Where a band begins must be the user's choice: a study of bands that has no trigger, or one that is lost on a restart, is
//! worthless and does not look it.

mod common;

use common::{Bench, femdem};
use serde_json::Value;

/// A specimen in a homogeneous biaxial test, compressed by 0.6 %.
fn specimen(rev: &str, rest: &str) -> String {
    format!(
        "name: specimen\n\
         mesh: {{ rectangle: {{ size: [1.0, 1.0], elements: [2, 2], element: Q4 }} }}\n\
         materials:\n  sand: {{ rev: {{ grains: 40{rev} }} }}\n  other: {{ like: sand, rev: {{ friction: 0.45 }} }}\n\
         material: sand\nloads: {{ shortening: 0.0 }}\n\
         boundary:\n  - {{ on: bottom, displacement: {{ y: 0 }} }}\n  - {{ on: bottom_mid, displacement: {{ x: 0 }} }}\n  \
         - {{ on: top, displacement: {{ y: shortening }} }}\n  - {{ on: left, pressure: 1 }}\n  \
         - {{ on: right, pressure: 1 }}\n\
         programme: [ {{ name: load, ramp: {{ shortening: -0.006 }}, steps: 3 }} ]\n\
         solver: {{ force_tolerance: 1e-6, rev_tolerance: 1e-8 }}\n{rest}"
    )
}

fn submitted(rev: &str, rest: &str) -> (Bench, Value) {
    let bench = Bench::new();
    std::fs::write(bench.path("specimen.yaml"), specimen(rev, rest)).unwrap();
    let ended = bench.submit("specimen.yaml").json();
    (bench, ended)
}

/// Stresses σ_yy of the REVs at the end, one of each element.
fn stresses(bench: &Bench, run: &str) -> Vec<f64> {
    let of = |element: usize| {
        let address = format!("{run}@last:e{element}.0");
        let picture = bench.arg("rev.svg");
        let args = ["rev", "show", &address, "--output", &picture, "--json"];
        let shown = bench.run(&args).good().json();
        shown["stress"][1][1].as_f64().unwrap()
    };
    (0..4).map(of).collect()
}

/// Friction of a REV, as others get it.
fn friction(bench: &Bench, rev: &str) -> f64 {
    let file = bench.arg("rev.json");
    let _ = std::fs::remove_file(&file);
    bench.run(&["rev", "export", rev, &file]).good();
    let record: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    record["mu_shear"]
        .as_f64()
        .unwrap_or_else(|| panic!("{record}"))
}

fn spread(values: &[f64]) -> f64 {
    let most = values.iter().fold(f64::MIN, |most, &x| most.max(x));
    values
        .iter()
        .fold(0.0, |spread, &x| f64::max(spread, most - x))
}

/// Pressed from all sides alike, which is the one homogeneous problem whatever the assemblies answer: under any other stress
/// they shear a little, and the pressure on the leaning sides is no longer that of a homogeneous field.
#[test]
fn elements_stay_alike_without_a_trigger_and_part_with_one() {
    let pressed = |rev: &str| {
        let biaxial = specimen(&format!(", preparation_friction: 0.5{rev}"), "");
        let text = biaxial
            .replace("shortening: 0.0", "pressure: 1.0")
            .replace("displacement: { y: shortening }", "pressure: pressure")
            .replace("pressure: 1 }", "pressure: pressure }")
            .replace("shortening: -0.006", "pressure: 3");
        let bench = Bench::new();
        std::fs::write(bench.path("specimen.yaml"), text).unwrap();
        bench.submit("specimen.yaml");
        bench
    };
    let alike = stresses(&pressed(""), "specimen");
    assert!((alike[0] + 3.0).abs() < 1e-4, "{alike:?}");
    // The force tolerance.
    assert!(spread(&alike) < 1e-6, "{alike:?}");
    let bench = pressed(", friction_scatter: 0.1");
    let apart = stresses(&bench, "specimen");
    assert!(spread(&apart) > 1e-3, "{apart:?}");
    let mut drawn = Vec::new();
    for element in 0..4 {
        let of = |step, point| friction(&bench, &format!("specimen@{step}:e{element}.{point}"));
        let mine = of("last", 0);
        // One element, one friction, from the beginning on.
        assert_eq!([of("last", 3), of("0", 2), of("1", 0)], [mine; 3]);
        assert!((mine / 0.5 - 1.0).abs() < 0.1 && mine != 0.5, "{mine}");
        drawn.push(mine);
    }
    assert!(spread(&drawn) > 1e-3, "{drawn:?}");
}

#[test]
fn every_way_to_a_load_step_finds_the_same_friction() {
    let (bench, ended) = submitted(", friction_scatter: 0.1", "");
    let digest = |outcome: common::Outcome| outcome.good().json()["digest"].clone();
    let whole = ended["digest"].clone();
    assert!(whole.is_string());
    let branch = bench.run(&["branch", "specimen@1", "--name", "branch", "--json"]);
    assert_eq!(branch.good().json()["runs"][0]["digest"], whole);
    let rerun = bench.run(&["rerun", "specimen@0", "--name", "again", "--json"]);
    assert_eq!(rerun.good().json()["runs"][0]["digest"], whole);
    // Another process takes it up where this one prepared it.
    bench
        .run(&["branch", "specimen@2", "--name", "later", "--prepare-only"])
        .good();
    assert_eq!(digest(bench.run(&["resume", "later", "--json"])), whole);
    bench
        .run(&["verify", "specimen", "--sample", "100%"])
        .good();
    let replay = bench.run(&["replay", "specimen@2:e3.1"]).good();
    assert!(replay.out.contains("to the last bit"), "{}", replay.out);
    let other = Bench::new();
    std::fs::copy(bench.path("specimen.yaml"), other.path("specimen.yaml")).unwrap();
    let (file, store) = (other.arg("specimen.yaml"), other.arg("store"));
    let threads = femdem(&[
        "submit",
        &file,
        "--json",
        "--store",
        &store,
        "--threads",
        "3",
    ]);
    assert_eq!(digest(threads), whole);
}

#[test]
fn a_new_start_can_take_the_scatter_away_and_give_it() {
    let (scattered, with) = submitted(", friction_scatter: 0.1", "");
    let (plain, without) = submitted("", "");
    assert_ne!(with["digest"], without["digest"]);
    let rerun = |bench: &Bench, scatter: &str| {
        let set = format!("materials.sand.rev.friction_scatter={scatter}");
        let name = "--name";
        let args = ["rerun", "specimen@0", name, "new", "--set", &set, "--json"];
        bench.run(&args).good().json()["runs"][0]["digest"].clone()
    };
    assert_eq!(rerun(&scattered, "0"), without["digest"]);
    assert_eq!(rerun(&plain, "0.1"), with["digest"]);
    let nothing = [
        "rerun",
        "specimen@0",
        "--set",
        "materials.sand.rev.friction=0",
    ];
    let refused = scattered.run(&nothing);
    assert_eq!(refused.code, 2);
    assert!(
        refused.err.contains("without a friction to scatter"),
        "{}",
        refused.err
    );
}

#[test]
fn the_summary_of_a_run_names_its_triggers() {
    let region = "regions: [ { name: weak, elements: [3], material: other } ]\n";
    let (bench, _) = submitted(
        ", friction_scatter: 0.05, packings: one_per_element",
        region,
    );
    let shown = bench.run(&["show", "specimen"]).good().out;
    for line in [
        "  trigger    region `weak` (1 element, friction 0.45 against 0.5)\n",
        "  trigger    one packing per element (`sand`)\n",
        "  trigger    friction scattered by ±5 % (`sand`), from 0.",
        "μ = 0.5 ± 5 %",
    ] {
        assert!(shown.contains(line), "{line}: {shown}");
    }
    let data = bench.run(&["show", "specimen", "--json"]).good().json();
    let kinds: Vec<&str> = data["triggers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|trigger| trigger["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["region", "packings", "friction_scatter"]);
    let file = bench.arg("specimen.yaml");
    let plan = bench.run(&["plan", "submit", &file]).good().out;
    assert!(
        plan.contains("  trigger   region `weak` (1 element"),
        "{plan}"
    );
    let plan = bench
        .run(&["plan", "submit", &file, "--json"])
        .good()
        .json();
    assert_eq!(plan["runs"][0]["triggers"], data["triggers"]);
}

#[test]
fn a_run_without_a_trigger_says_that_it_has_none() {
    let (bench, _) = submitted("", "");
    let shown = bench.run(&["show", "specimen"]).good().out;
    let none = "  trigger    none: identical REVs, which in a homogeneous field only the tolerances set apart\n";
    assert!(shown.contains(none), "{shown}");
    let data = bench.run(&["show", "specimen", "--json"]).good().json();
    assert_eq!(data["triggers"], serde_json::json!([]));
    // Nothing localises where there are no grains, and one REV has nobody to differ from.
    for file in ["block", "grains"] {
        bench.submit(&format!("{file}.yaml"));
        let shown = bench.run(&["show", file]).good().out;
        assert!(!shown.contains("trigger"), "{shown}");
        let data = bench.run(&["show", file, "--json"]).good().json();
        assert_eq!(data["triggers"], Value::Null);
    }
}

/// A region that was meant to be weaker and selects nothing is no trigger; who plans first should not learn it from
/// `submit`.
#[test]
fn a_plan_notes_what_submit_would_note() {
    let bench = Bench::new();
    let region = "regions: [ { name: weak, box: { from: [2, 2], to: [3, 3] }, material: rock } ]\n";
    let input = format!("{}{region}", common::BLOCK);
    std::fs::write(bench.path("nowhere.yaml"), input).unwrap();
    let file = bench.arg("nowhere.yaml");
    let plan = bench.run(&["plan", "submit", &file]).good().out;
    let note = "region `weak` selects no element: no element centre lies in its box";
    assert!(plan.contains(&format!("  note      {note}")), "{plan}");
    let plan = bench.run(&["plan", "submit", &file, "--json"]).good();
    assert_eq!(plan.json()["runs"][0]["notes"], serde_json::json!([note]));
}
