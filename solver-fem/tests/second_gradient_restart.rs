//! Second gradient: a step that was stored on its way.

mod common;

use common::elastic_answers;
use common::second_gradient::{YOUNG, law, loaded, sheared};
use solver_fem::newton::{MacroState, Request, StepSettings, StepSolver};

/// A step stored between two waves and restored goes on with the same bits, second gradient
/// included; and a plain state is stored as it always was.
#[test]
fn a_stored_step_goes_on_with_the_same_bits() {
    let problem = sheared([2, 4], 0.05 * YOUNG);
    let state = loaded(&problem);
    let loads = [-0.2, 0.12, 4.0];
    let settings = StepSettings::smooth(1e-10);
    let begin = || StepSolver::begin(&problem, &state, &state.loads, &loads, &settings);
    let finish = |mut step: StepSolver<2>, stored: bool| loop {
        let Request::Evaluate(wave) = step.next() else {
            let Request::Converged(outcome) = step.next() else {
                panic!("does not converge")
            };
            return outcome.state;
        };
        if stored {
            let bytes = rmp_serde::to_vec(step.state()).expect("plain values");
            let back = rmp_serde::from_slice(&bytes).expect("the same type");
            step = StepSolver::restore(&problem, back).expect("fits");
        }
        step.advance(&elastic_answers(&law(), &state, &wave.points));
    };
    let straight = finish(begin().expect("fits"), false);
    let resumed = finish(begin().expect("fits"), true);
    let bytes = |state: &MacroState<2>| rmp_serde::to_vec(state).expect("plain values");
    assert_eq!(bytes(&straight), bytes(&resumed));
    let back: MacroState<2> = rmp_serde::from_slice(&bytes(&straight)).expect("the same type");
    assert_eq!(back, straight);
    assert_eq!(back.check(&problem), Ok(()));

    let mut plain = straight.clone();
    plain.second_gradient = None;
    assert_eq!(bytes(&straight)[0], 0x98, "an array of eight");
    assert_eq!(
        bytes(&plain)[0],
        0x97,
        "seven, as before there was a second gradient"
    );
    let back: MacroState<2> = rmp_serde::from_slice(&bytes(&plain)).expect("the same type");
    assert_eq!(back, plain);
    let error = plain.check(&problem).expect_err("refused");
    assert!(error.to_string().contains("the state none"));
}
