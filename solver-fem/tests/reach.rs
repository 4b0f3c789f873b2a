//! A stiffness that is nearly singular must not send the body where no grains can follow.

mod common;

use common::{at_rest, column};
use solver_fem::elastic::Elastic;
use solver_fem::newton::{Request, StepSettings, StepSolver};

/// Largest compressive strain of the first wave of a column of 30 elements that is shortened by 2e-3, one element being a
/// hundred times softer than the others in the stored tangents.
fn largest_strain(settings: &StepSettings) -> f64 {
    let problem = column(30);
    let law = Elastic::new(100.0, 0.0).expect("stable");
    let mut state = at_rest(&problem, &law, &[0.0]);
    let soft = 7 * 4 * 16..8 * 4 * 16;
    state.predictor_tangents[soft]
        .iter_mut()
        .for_each(|c| *c *= 0.01);
    let step = StepSolver::begin(&problem, &state, &[0.0], &[-0.06], settings).expect("fits");
    let Request::Evaluate(wave) = step.next() else {
        panic!("a wave")
    };
    let strains = wave.points.iter().map(|(_, f)| 1.0 - f[1][1]);
    strains.fold(0.0, f64::max)
}

#[test]
fn a_predictor_strains_no_point_by_more_than_ten_times_the_elastic_one() {
    let free = largest_strain(&StepSettings::smooth(1e-6));
    assert!((free - 0.06 / (1.0 + 0.29)).abs() < 1e-3, "{free}");
    let bounded = largest_strain(&StepSettings::default());
    // The elastic column strains by 2e-3 throughout. Made viscous by 0.03 E, the soft element takes 13 times that, by 0.1 E
    // seven times.
    assert!(bounded > 2e-3 && bounded < 2e-2, "{bounded}");
}
