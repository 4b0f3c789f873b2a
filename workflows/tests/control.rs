//! A stage may follow a volume or a length, and may end early; what comes after it goes on from where it ended.

mod common;

use std::fs;

use common::{Bench, curve};

const INFLATED: &str = "\
name: inflated
mesh: { annulus: { sector: quarter, inner_radius: 1.0, outer_radius: 3.0, elements: [4, 4] } }
materials: { rock: { elastic: { young: 100.0, poisson: 0.2, initial_stress: 0.0 } } }
loads: { cavity: 0.0, around: 0.0 }
boundary:
  - { on: symmetry_x, displacement: { y: 0 } }
  - { on: symmetry_y, displacement: { x: 0 } }
  - { on: inner, pressure: cavity }
  - { on: outer, pressure: around }
programme:
  - { name: inflation, control: { load: cavity, volume: { inner: 0.04 } }, steps: 8, until: [{ load: cavity, above: 0.9 }] }
  - { name: unloading, ramp: { cavity: 0.0, around: 0.1 }, steps: 2 }
  - { name: path, control: { load: cavity, arc_length: 0.01, at_first: rising }, steps: 4 }
  - { name: rest, hold: {}, steps: 5, until: [{ settled: cavity, within: 1e-9, over: 2 }] }
";

struct Curves {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Curves {
    fn of(bench: &Bench, run: &str) -> Self {
        let into = bench.arg(&format!("out-{run}"));
        bench.run(&["export", run, "--into", &into]).good();
        let (names, rows) = curve(&bench.path(&format!("out-{run}/curves.csv")));
        Curves { names, rows }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let at = self.names.iter().position(|n| n == name).unwrap();
        self.rows.iter().map(|row| row[at]).collect()
    }
}

#[test]
fn a_load_adapts_and_the_next_stage_goes_on_from_where_it_came_to() {
    let bench = Bench::new();
    fs::write(bench.path("inflated.yaml"), INFLATED).unwrap();
    bench.submit("inflated.yaml");
    let shown = bench.run(&["show", "inflated"]).good().out;
    for told in [
        "stage `inflation` ended with step 6: `cavity` is above 0.9",
        "stage `rest` ended with step",
    ] {
        assert!(shown.contains(told), "{shown}");
    }
    let curves = Curves::of(&bench, "inflated");
    let (load, around) = (curves.column("load_cavity"), curves.column("load_around"));
    let (stage, volume) = (curves.column("stage"), curves.column("expansion_inner"));
    let steps_of = |number: f64| stage.iter().filter(|&&stage| stage == number).count();
    let inflation = steps_of(1.0);
    assert!((1..8).contains(&inflation), "{stage:?}");
    // Displacements are right to a hundredth of a step.
    for step in 1..=inflation {
        assert!(
            (volume[step] - 0.005 * step as f64).abs() < 5e-5,
            "{volume:?}"
        );
    }
    assert!(
        load[inflation] >= 0.9 && load[inflation - 1] < 0.9,
        "{load:?}"
    );
    // Half way and all the way, from a value that nobody knew beforehand.
    assert!((load[inflation + 1] - 0.5 * load[inflation]).abs() < 1e-12);
    assert_eq!((load[inflation + 2], around[inflation + 1]), (0.0, 0.05));
    let path = inflation + 2;
    assert!(
        (1..=4).all(|k| load[path + k] > load[path + k - 1]),
        "{load:?}"
    );
    assert_eq!(steps_of(4.0), 2, "two load steps tell that nothing changes");
    assert_eq!(load[path + 6], load[path + 4]);

    // A branch takes the value that the load came to as its beginning.
    let at = format!("inflated@{inflation}");
    let ramp = ["--ramp", "cavity=0.2", "--steps", "4", "--name", "back"];
    bench.run(&[&["branch", &at], &ramp[..]].concat()).good();
    let back = Curves::of(&bench, "back").column("load_cavity");
    assert!(
        (back[inflation + 1] - (0.75 * load[inflation] + 0.05)).abs() < 1e-12,
        "{back:?}"
    );
}

#[test]
fn a_volume_that_cannot_be_measured_is_refused_before_anything_is_stored() {
    let bench = Bench::new();
    let input = INFLATED
        .replace("volume: { inner: 0.04 }", "volume: { symmetry_x: 0.04 }")
        .replace("name: inflated", "name: flat");
    fs::write(bench.path("flat.yaml"), input).unwrap();
    let outcome = bench.run(&["submit", &bench.arg("flat.yaml")]);
    assert_ne!(outcome.code, 0);
    assert!(
        outcome.err.contains("`symmetry_x` encloses no volume")
            && outcome.err.contains("flat.yaml:11:59"),
        "{}",
        outcome.err
    );
    assert!(!bench.store().exists(), "nothing is stored");
}
