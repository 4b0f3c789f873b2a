//! The examples are the first thing a user runs: they must be right, and what is published about the language must
//! agree with what the program takes.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use workflows::input::problem::{Amount, Control, Law, Model, Origin};
use workflows::input::{self, Mesh, Problem};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name)
}

fn load(name: &str) -> Problem {
    input::load(path(name)).unwrap_or_else(|errors| panic!("{errors}"))
}

#[test]
fn the_hollow_cylinder_is_the_one_the_readme_promises() {
    let problem = load("hollow.yaml");
    let Model::Body(body) = &problem.model else {
        panic!("no body")
    };
    assert!(body.mesh.element_count() >= 40);
    let Law::Rev(rev) = &problem.materials[body.material].law else {
        panic!("no REV")
    };
    assert!(matches!(&rev.origin, Origin::Prepared(preparation) if preparation.grains == 100));
    let steps = problem.programme.steps();
    assert_eq!(steps.first().unwrap().from, [Some(rev.confining_stress)]);
    // The pressure is lowered, not taken away: without any the wall cannot stand.
    let last = steps.last().unwrap().to[0].unwrap();
    assert!(0.0 < last && last < rev.confining_stress, "{last}");
}

#[test]
fn the_biaxial_test_is_that_of_the_standard_problem() {
    for (name, cohesion) in [("biaxial.yaml", 0.0), ("biaxial-cohesive.yaml", 1.0)] {
        let problem = load(name);
        let Model::Body(body) = &problem.model else {
            panic!("no body")
        };
        let Mesh::Rectangle(rectangle) = &body.mesh else {
            panic!("no rectangle")
        };
        assert_eq!((rectangle.size, rectangle.elements), ([1.0, 2.0], [8, 16]));
        let laws =
            [body.material, body.regions[0].material].map(|index| &problem.materials[index].law);
        let [Law::Rev(sand), Law::Rev(weak)] = laws else {
            panic!("no REVs")
        };
        assert_eq!((sand.friction, weak.friction), (0.5, 0.45));
        assert_eq!(
            (sand.cohesion_ratio, weak.cohesion_ratio),
            (cohesion, cohesion)
        );
        assert_eq!(
            (&sand.origin, sand.seed),
            (&weak.origin, weak.seed),
            "the weak element differs in friction only"
        );
        let steps = problem.programme.steps();
        assert_eq!(steps.len(), 20);
        assert!(steps.iter().all(|step| {
            ((step.from[0].unwrap() - step.to[0].unwrap()) / 2.0 - 1e-3).abs() < 1e-12
        }));
    }
}

#[test]
fn the_element_test_path_is_written_out() {
    let problem = load("rev-biaxial.yaml");
    let Model::ElementTest(test) = &problem.model else {
        panic!("no element test")
    };
    assert_eq!(problem.loads, ["axial"]);
    assert_eq!(test.xx, Control::Stress(Amount::Constant(-1.0)));
    assert_eq!(test.yy, Control::Strain(Amount::Load(0)));
    assert_eq!(test.xy, Control::Strain(Amount::Constant(0.0)));
}

#[test]
fn the_boreholes_are_of_the_size_of_published_work() {
    for (name, elements, modulus) in [
        ("borehole.yaml", 400, None),
        ("borehole-second-gradient.yaml", 1230, Some(5e-2)),
    ] {
        let Model::Body(body) = load(name).model else {
            panic!("no body")
        };
        assert_eq!(body.mesh.element_count(), elements);
        let found = body.second_gradient.map(|gradient| gradient.modulus);
        assert_eq!(found, modulus, "{name}");
    }
}

#[test]
fn the_gallery_is_dug_under_a_far_stress_that_stays() {
    let problem = load("gallery.yaml");
    let Model::Body(body) = &problem.model else {
        panic!("no body")
    };
    assert_eq!(body.mesh.element_count(), 384);
    assert_eq!(problem.loads, ["support", "vertical"]);
    // The far stress comes first and stays while the gallery is dug.
    let steps = problem.programme.steps();
    let (first, last) = (&steps[0], steps.last().unwrap());
    assert_eq!(first.from, [Some(1.0), Some(1.0)]);
    assert_eq!(last.to, [Some(0.3), Some(1.5)]);
}

#[test]
fn the_principal_stresses_turn_at_constant_mean_stress_and_ratio() {
    let problem = load("rev-rotation.yaml");
    assert_eq!(problem.loads, ["sxx", "sxy", "syy"]);
    let steps = problem.programme.steps();
    let (approach, turns) = steps.split_at(20);
    assert_eq!(approach[19].to, [Some(-0.75), Some(0.0), Some(-1.25)]);
    let mut angles = Vec::new();
    for corner in turns.iter().skip(5).step_by(6) {
        let [Some(xx), Some(xy), Some(yy)] = corner.to[..] else {
            panic!("three loads with values")
        };
        let q = (0.5 * (xx - yy)).hypot(xy);
        assert!((0.5 * (xx + yy) + 1.0).abs() < 1e-5 && (q - 0.25).abs() < 1e-5);
        angles.push(xy.atan2(0.5 * (xx - yy)).rem_euclid(std::f64::consts::TAU));
    }
    assert_eq!(angles.len(), 48);
    // Each side of the polygon turns the stress by 11.25°, twice as much on the circle.
    for pair in angles.windows(2) {
        let turned = (pair[1] - pair[0]).rem_euclid(std::f64::consts::TAU);
        assert!((turned.to_degrees() - 22.5).abs() < 1e-2, "{turned}");
    }
}

#[test]
fn the_anisotropic_packing_is_free_to_shear_under_an_angle() {
    let problem = load("rev-anisotropic.yaml");
    let Model::ElementTest(test) = &problem.model else {
        panic!("no element test")
    };
    assert_eq!(test.xx, Control::Stress(Amount::Constant(-1.0)));
    assert_eq!(test.yy, Control::Strain(Amount::Load(0)));
    assert_eq!(test.xy, Control::Stress(Amount::Constant(0.0)));
}

#[test]
fn a_stored_problem_reads_back_the_same() {
    let problem = load("biaxial.yaml");
    let text = serde_json::to_string(&problem).unwrap();
    assert_eq!(serde_json::from_str::<Problem>(&text).unwrap(), problem);
    assert_eq!(
        problem.source,
        std::fs::read_to_string(path("biaxial.yaml")).unwrap()
    );
}

#[test]
fn the_least_input_is_short() {
    let text = "name: a\nelement_test: { path: isotropic }\nmaterials: { sand: { rev: {} } }\n\
                programme: [{ name: up, ramp: { mean_stress: -2 }, steps: 4 }]\n";
    let problem =
        input::parse(text, "a.yaml", Path::new("")).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(problem.programme.initial, [-1.0]);
}

#[test]
fn a_full_ring_can_be_held_on_its_axes() {
    let Model::Body(body) = load("hollow.yaml").model else {
        panic!("no body")
    };
    let Mesh::Annulus(ring) = body.mesh else {
        panic!("no ring")
    };
    let divided = |around: u32| format!("elements: [{around}, {}]", ring.elements[1]);
    let even = ring.elements[0].next_multiple_of(2);
    let held = std::fs::read_to_string(path("hollow.yaml"))
        .unwrap()
        .replace("sector: quarter", "sector: full")
        .replace("symmetry_x", "axis_x")
        .replace("symmetry_y", "axis_y")
        .replace(&divided(ring.elements[0]), &divided(even));
    input::parse(&held, "ring.yaml", Path::new("")).unwrap_or_else(|errors| panic!("{errors}"));
    // With an odd number of elements no node lies on the y axis.
    let odd = held.replace(&divided(even), &divided(even + 1));
    let error = input::parse(&odd, "ring.yaml", Path::new(""))
        .unwrap_err()
        .to_string();
    assert!(error.contains("no boundary `axis_y`"), "{error}");
}

#[test]
fn a_deep_or_long_input_ends_in_an_error() {
    for text in [
        "[".repeat(200_000),
        "{a: ".repeat(200_000),
        "- ".repeat(200_000),
        "a:\n".repeat(100_000),
    ] {
        assert!(input::parse(&text, "deep.yaml", Path::new("")).is_err());
    }
}

#[derive(Debug, Clone)]
enum Edit {
    Delete(usize, usize),
    Insert(usize, String),
    Swap(usize, usize),
}

fn edit() -> impl Strategy<Value = Edit> {
    let word = prop_oneof![
        Just("- "),
        Just(": "),
        Just("{"),
        Just("}"),
        Just("["),
        Just("]"),
        Just("\n"),
        Just("\t"),
        Just("  "),
        Just("-1"),
        Just("1e400"),
        Just("0"),
        Just("~"),
        Just("*a"),
        Just("&a "),
        Just("!!x "),
        Just("\""),
        Just("'"),
        Just("|"),
        Just("#"),
        Just("like: sand"),
        Just("é\u{0}"),
        Just("18446744073709551616"),
        Just("\u{2028}"),
    ];
    prop_oneof![
        (0..2000usize, 1..30usize).prop_map(|(at, count)| Edit::Delete(at, count)),
        (0..2000usize, word).prop_map(|(at, word)| Edit::Insert(at, word.to_owned())),
        (0..60usize, 0..60usize).prop_map(|(a, b)| Edit::Swap(a, b)),
    ]
}

fn apply(text: &str, edit: &Edit) -> String {
    let mut characters: Vec<char> = text.chars().collect();
    match edit {
        Edit::Delete(at, count) => {
            let start = at % characters.len().max(1);
            let end = (start + count).min(characters.len());
            characters.drain(start.min(end)..end);
        }
        Edit::Insert(at, word) => {
            let at = at % (characters.len() + 1);
            characters.splice(at..at, word.chars());
        }
        Edit::Swap(a, b) => {
            let mut lines: Vec<&str> = text.lines().collect();
            let count = lines.len().max(1);
            if lines.len() > 1 {
                lines.swap(a % count, b % count);
            }
            return lines.join("\n");
        }
    }
    characters.into_iter().collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    /// A damaged input is taken or refused with at least one message; it never brings the program down.
    #[test]
    fn no_damage_to_an_input_causes_a_panic(which in 0..3usize, edits in prop::collection::vec(edit(), 1..6)) {
        let name = ["hollow.yaml", "biaxial.yaml", "rev-biaxial.yaml"][which];
        let text = std::fs::read_to_string(path(name)).unwrap();
        let text = edits.iter().fold(text, |text, edit| apply(&text, edit));
        if let Err(errors) = input::parse(&text, name, Path::new("")) {
            prop_assert!(!errors.errors.is_empty());
            prop_assert!(errors.to_string().starts_with("error: "));
        }
    }
}
