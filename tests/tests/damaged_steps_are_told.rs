//! A damaged load step that `show` passes over, or that takes the whole export with it, costs a thesis its curves: what is
//! damaged is left out and said loudly, what is not is there.

use std::fs;
use std::path::PathBuf;

use tests::inputs;
use tests::workplace::{Outcome, Workplace};

fn submitted() -> Workplace {
    let place = Workplace::new();
    let file = place.write("input.yaml", &inputs::biaxial("slope", 20, 4));
    place.run(["submit", file.to_str().unwrap()]).success();
    place
}

fn pack(place: &Workplace, step: u32) -> PathBuf {
    place.store().join(format!("packs/slope/{step:08}.pack"))
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

fn rows(place: &Workplace) -> Vec<u32> {
    let text = fs::read_to_string(place.dir().join("slope/curves.csv")).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.skip(1)
        .map(|line| line.split(',').next().unwrap().parse::<f64>().unwrap() as u32)
        .collect()
}

/// A pack flipped somewhere in its states, which no list notices.
fn flip(path: &PathBuf) {
    let mut bytes = fs::read(path).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 8;
    fs::write(path, bytes).unwrap();
}

#[test]
fn an_export_leaves_a_damaged_step_out_and_says_so() {
    let place = submitted();
    let sound = place.run(["export", "slope"]).success();
    assert_eq!(rows(&place), [0, 1, 2, 3, 4], "{sound:?}");
    flip(&pack(&place, 2));
    let told = place.run(["export", "slope"]).ended_with(3);
    assert!(told.err.contains("left out: load step 2"), "{told:?}");
    assert!(told.err.contains("00000002.pack"), "{told:?}");
    assert!(told.err.contains("without 1 damaged load step"), "{told:?}");
    assert_eq!(rows(&place), [0, 1, 3, 4]);
    // Cut short, which a list does notice.
    let bytes = fs::read(pack(&place, 3)).unwrap();
    fs::write(pack(&place, 3), &bytes[..bytes.len() / 2]).unwrap();
    let told = json(&place.run(["export", "slope", "--json"]).ended_with(3));
    let steps: Vec<u64> = told["damaged"]
        .as_array()
        .unwrap()
        .iter()
        .map(|damaged| damaged["step"].as_u64().unwrap())
        .collect();
    assert_eq!(steps, [2, 3], "{told}");
    assert_eq!(rows(&place), [0, 1, 4]);
    let pvd = fs::read_to_string(place.dir().join("slope/fields.pvd")).unwrap();
    assert!(
        !pvd.contains("fields-0002") && pvd.contains("fields-0004"),
        "{pvd}"
    );
}

#[test]
fn an_element_test_is_exported_without_its_damaged_step() {
    let place = Workplace::new();
    let input = "name: slope\nelement_test: { path: biaxial }\nmaterials: { sand: { rev: { grains: 20 } } }\n\
                 programme: [ { name: load, ramp: { axial: -0.002 }, steps: 4 } ]\n";
    let file = place.write("input.yaml", input);
    place.run(["submit", file.to_str().unwrap()]).success();
    flip(&pack(&place, 3));
    place.run(["export", "slope"]).ended_with(3);
    assert_eq!(rows(&place), [0, 1, 2, 4]);
}

#[test]
fn a_run_whose_end_is_lost_is_not_called_complete() {
    let place = submitted();
    let whole = fs::read(pack(&place, 4)).unwrap();
    for missing in [false, true] {
        match missing {
            true => fs::remove_file(pack(&place, 4)).unwrap(),
            false => fs::write(pack(&place, 4), &whole[..100]).unwrap(),
        }
        for verb in [
            ["show", "slope"].as_slice(),
            &["runs"],
            &["status", "slope"],
        ] {
            let told = place.run(verb).success();
            let head: String = told.out.lines().take(2).collect();
            assert!(head.contains("damaged"), "{verb:?}: {told:?}");
            assert!(!head.contains("completed"), "{verb:?}: {told:?}");
        }
        let show = json(&place.run(["show", "slope", "--json"]).success());
        assert_eq!(show["state"], "damaged");
        assert_eq!(show["damaged"], serde_json::json!([4]));
        let refused = place.run(["resume", "slope"]).ended_with(3);
        assert!(
            refused.err.contains("store set-back slope@3"),
            "{refused:?}"
        );
        assert!(refused.err.contains("00000004.pack"), "{refused:?}");
    }
    place.run(["store", "set-back", "slope@3"]).success();
    place.run(["resume", "slope"]).success();
    let show = place.run(["show", "slope"]).success();
    assert!(show.out.contains("completed"), "{show:?}");
}

#[test]
fn a_plan_counts_the_disk_that_pruned_steps_took() {
    let place = submitted();
    let needed = |place: &Workplace| {
        let plan = json(&place.run(["plan", "rerun", "slope@0", "--json"]).success());
        plan["bytes"].as_f64().unwrap()
    };
    let before = needed(&place);
    place.run(["prune", "slope", "--keep-every", "2"]).success();
    let after = needed(&place);
    assert!(
        (after / before - 1.0).abs() < 0.1,
        "{before} bytes before, {after} after"
    );
}
