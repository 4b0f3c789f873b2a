//! What an earlier answer is good for as a start.

mod common;

use common::{SHEARED, UNIT, distance};
use solver_dem::{
    Method, Rev, Settings, Start, Started, Trust, respond,
    tensor::{invert, product},
};

const FAR: [[f64; 2]; 2] = [[1.0 + 2e-3, 0.0], [1e-4, 1.0 - 3e-3]];
const NEAR: [[f64; 2]; 2] = [[1.0 + 2.02e-3, 0.0], [1e-4, 1.0 - 3.03e-3]];

#[test]
fn going_on_is_the_answer_of_the_remaining_deformation() {
    let settings = Settings::default();
    let earlier = respond(&SHEARED, None, &FAR, &settings).unwrap();
    let start = Start {
        state: &earlier.state,
        rotations: &earlier.rotations,
        trust: Trust::Reference,
    };
    let on = respond(&SHEARED, Some(start), &NEAR, &settings).unwrap();

    let reference = Rev {
        state: earlier.state.clone(),
        ..SHEARED.clone()
    };
    let rest = product(&NEAR, &invert(&FAR).1.unwrap());
    let alone = respond(&reference, None, &rest, &settings).unwrap();
    // The rest of F is rounded differently, which a solve to 1e-4 amplifies.
    assert!(distance(&on.stress, &alone.stress) < 1e-4);
    assert_eq!(on.state.contacts.len(), alone.state.contacts.len());
    assert_eq!(on.gradient, NEAR);
    assert_eq!(on.report.method, Method::Rebased);
    for ((on, alone), before) in on
        .rotations
        .iter()
        .zip(&alone.rotations)
        .zip(&earlier.rotations)
    {
        assert!((on - alone - before).abs() < 1e-4);
    }
}

#[test]
fn guess_changes_the_price_and_not_the_answer() {
    let settings = common::tight();
    let f = [[1.0 + 1e-4, 0.0], [0.0, 1.0 - 2e-4]];
    let cold = respond(&SHEARED, None, &f, &settings).unwrap();
    let beside = respond(&SHEARED, None, &UNIT, &settings).unwrap();
    let start = Start {
        state: &beside.state,
        rotations: &beside.rotations,
        trust: Trust::Guess,
    };
    let warm = respond(&SHEARED, Some(start), &f, &settings).unwrap();
    assert!(distance(&warm.stress, &cold.stress) < 1e-6);
}

/// Friction mobilised by a first guess at F that goes too far would stay.
#[test]
fn only_a_warm_answer_that_depends_on_its_way_is_gone_on_from() {
    let mut report = respond(&SHEARED, None, &UNIT, &Settings::default())
        .unwrap()
        .report;
    for (method, started, trust) in [
        (Method::ReturnMapping, Started::Warm, Trust::Guess),
        (Method::Rebased, Started::Cold, Trust::Guess),
        (Method::Path, Started::Cold, Trust::Guess),
        (Method::Rebased, Started::Warm, Trust::Reference),
        (Method::Path, Started::Warm, Trust::Reference),
    ] {
        report.method = method;
        assert_eq!(Trust::in_answer(&report, started), trust);
    }
}
