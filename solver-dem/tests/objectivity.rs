//! What must not change the answer: a rigid rotation, another choice of cell vectors. The same for random packings, and
//! for the order of the grains, is in random_rev.rs.

mod common;

use common::{SHEARED, SMALL, UNIT, distance, tight};
use solver_dem::{
    Response, Rev, Settings, respond,
    tensor::{rotated2, rotation},
};

fn answer(rev: &Rev<2, 1>, f: &[[f64; 2]; 2], settings: &Settings) -> Response {
    respond(rev, None, f, settings).unwrap()
}

/// Grains that do not turn with the REV roll on each other and lose their friction.
#[test]
fn stress_of_a_loaded_rev_turns_with_it_by_30_and_90_degrees() {
    let still = answer(&SHEARED, &UNIT, &tight());
    for degrees in [30.0f64, 90.0, -170.0] {
        let r = rotation(degrees.to_radians());
        let turned = answer(&SHEARED, &r, &tight());
        let expected = rotated2(&r, &still.stress);
        assert!(
            distance(&turned.stress, &expected) < 1e-8,
            "{degrees}°: {:?} for {expected:?}",
            turned.stress
        );
    }
}

#[test]
fn another_choice_of_cell_vectors_changes_nothing() {
    let mut slanted = SHEARED.clone();
    let h = &mut slanted.state.cell.h;
    for row in h.iter_mut() {
        row[1] += row[0];
    }
    assert_ne!(slanted.state.cell, SHEARED.state.cell);
    let f = [[1.0, 2e-4], [0.0, 1.0 - 1e-4]];
    let a = answer(&SHEARED, &f, &tight());
    let b = answer(&slanted, &f, &tight());
    assert!(distance(&a.stress, &b.stress) < 1e-7);
    assert!(common::relative(&a.tangent, &b.tangent) < 1e-4);
    assert_eq!(a.report.contacts, b.report.contacts);
    // The end state comes with the short vectors again.
    assert!((b.state.cell.smallest_height() / a.state.cell.smallest_height() - 1.0).abs() < 1e-9);
}

/// A shear of 1.2 passes the point where the cell is described anew; the answer to a further increment is
/// that of the cell as it came.
#[test]
fn lattice_reduction_on_the_way_keeps_the_state() {
    let mut rev = SMALL.clone();
    let step = [[1.0, 0.02], [0.0, 1.0]];
    let settings = Settings::default();
    let mut unreduced = rev.state.cell;
    let mut reduced_once = false;
    for _ in 0..60 {
        unreduced = unreduced.deformed(&step);
        rev.state = answer(&rev, &step, &settings).state;
        reduced_once |= (rev.state.cell.h[0][1] - unreduced.h[0][1]).abs() > 1.0;
    }
    assert!(reduced_once, "γ = 1.2 must have reduced the cell");
    let mut long = rev.clone();
    long.state.cell = unreduced;
    let a = answer(&rev, &UNIT, &tight());
    let b = answer(&long, &UNIT, &tight());
    assert!(distance(&a.stress, &b.stress) < 1e-7);
    assert!(a.report.contacts.abs_diff(b.report.contacts) <= 1);
}
