//! Where no equilibrium is near, the body has to be led to the next one, and what leads it must leave no trace.
//!
//! A column of five elements between rollers is shortened; the middle one breaks at a stress of −1 and carries −0.3
//! from then on, no further stiffness, no way back. As soon as it breaks the elements in series with it unload: the
//! stress of the whole column falls to −0.3 at once, whatever the step and the way there.

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;

use solver_fem::elastic::Elastic;
use solver_fem::newton::{
    FailureReason, MacroState, Phase, Relaxation, Request, StepFailure, StepOutcome, StepSettings,
    StepSolver, Strategy, TwoPhase,
};
use solver_fem::problem::Problem;
use solver_fem::tensor::Tensor2;
use solver_fem::{Base, ConstitutiveResponse, GaussPointId, Smoothness, Wave};

const YOUNG: f64 = 100.0;
const STRENGTH: f64 = 1.0;
const RESIDUAL: f64 = 0.3;
const BROKEN_ELEMENT: u32 = 2;

#[derive(Clone, Copy, Default)]
struct Point {
    stress: Tensor2<2>,
    broken: bool,
}

/// Elastic without lateral strain; element [`BROKEN_ELEMENT`] breaks in compression along y.
fn respond(id: GaussPointId, base: &Point, f: &Tensor2<2>) -> (Point, ConstitutiveResponse<2>) {
    let law = Elastic::new(YOUNG, 0.0).expect("stable");
    let response = law.respond(&base.stress, f).expect("regular");
    let mut point = Point {
        stress: response.stress,
        ..*base
    };
    let mut tangent = law.tangent();
    point.broken |= id.0 / 4 == BROKEN_ELEMENT && -point.stress[1][1] > STRENGTH;
    if point.broken && -point.stress[1][1] > RESIDUAL {
        point.stress[1][1] = -RESIDUAL;
        tangent[1][1] = [[0.0; 2]; 2];
    }
    let answer = ConstitutiveResponse {
        stress: point.stress,
        tangent,
        elastic_tangent: law.tangent(),
        smooth: Smoothness::Smooth,
    };
    (point, answer)
}

struct Column {
    problem: Arc<Problem<2>>,
    state: MacroState<2>,
    committed: Vec<Point>,
}

fn column() -> Column {
    let problem = common::column(5);
    let law = Elastic::new(YOUNG, 0.0).expect("stable");
    Column {
        state: common::at_rest(&problem, &law, &[0.0]),
        committed: vec![Point::default(); problem.gauss_point_count()],
        problem,
    }
}

impl Column {
    /// One step; `change` may alter the answers of a wave before they are handed in.
    fn step(
        &mut self,
        load: f64,
        settings: &StepSettings,
        mut change: impl FnMut(&Wave<2>, &mut [ConstitutiveResponse<2>]),
    ) -> Result<StepOutcome<2>, StepFailure> {
        let loads = self.state.loads.clone();
        let mut step =
            StepSolver::begin(&self.problem, &self.state, &loads, &[load], settings).expect("fits");
        let mut ends: BTreeMap<u32, Vec<Point>> = BTreeMap::new();
        let mut request = step.next();
        loop {
            request = match request {
                Request::Evaluate(wave) => {
                    let base = match wave.base {
                        Base::Committed => &self.committed,
                        Base::Wave(k) => &ends[&k],
                    };
                    let answer = |(id, f): &(GaussPointId, _)| respond(*id, &base[id.index()], f);
                    let (points, mut answers): (Vec<_>, Vec<_>) =
                        wave.points.iter().map(answer).unzip();
                    ends.insert(wave.index, points);
                    change(&wave, &mut answers);
                    step.advance(&answers)
                }
                Request::Converged(outcome) => {
                    self.committed = ends.remove(&outcome.wave).expect("kept");
                    self.state = outcome.state.clone();
                    return Ok(*outcome);
                }
                Request::Failed(failure) => return Err(*failure),
            };
        }
    }
}

/// The overdamped motion after `sweeps` Newton sweeps.
fn settings(sweeps: usize) -> StepSettings {
    StepSettings {
        force_tolerance: 1e-6,
        strategy: Strategy::TwoPhase(TwoPhase {
            sweeps,
            relaxation: Relaxation {
                sweeps: 400,
                ..Relaxation::default()
            },
            ..TwoPhase::default()
        }),
        ..StepSettings::default()
    }
}

fn untouched(_: &Wave<2>, _: &mut [ConstitutiveResponse<2>]) {}

/// Force on the top over its width.
fn stress_of(outcome: &StepOutcome<2>) -> f64 {
    outcome.state.stress[3]
}

#[test]
fn a_column_that_breaks_comes_to_rest_at_the_residual_strength() {
    for (sweeps, load) in [(1, -0.06), (4, -0.06), (12, -0.06), (1, -0.2)] {
        let mut column = column();
        let before = column
            .step(-0.049, &settings(sweeps), untouched)
            .expect("elastic");
        assert!(
            (stress_of(&before) + 0.98).abs() < 0.02,
            "{}",
            stress_of(&before)
        );
        assert!(before.released.abs() < 1e-9, "nothing broke");
        let after = column
            .step(load, &settings(sweeps), untouched)
            .expect("comes to rest");
        assert!(
            (stress_of(&after) + RESIDUAL).abs() < 1e-5,
            "{} after {} sweeps",
            stress_of(&after),
            after.sweeps.len()
        );
        if sweeps == 1 {
            let last = after.sweeps.last().expect("there are sweeps");
            assert_eq!(last.phase, Phase::Relaxation);
            // The motion starts from the elastic guess, the whole column shortened alike: no more than that stores.
            let stored = 0.5 * YOUNG * (load / 5.0) * (load / 5.0) * 5.0;
            assert!(
                after.released > 0.0 && after.released < stored,
                "{}",
                after.released
            );
            assert_eq!(
                after.damped, after.released,
                "all sweeps but the first were motion"
            );
        }
        assert!(
            before.damped == 0.0 && after.damped <= after.released,
            "{} of {}",
            after.damped,
            after.released
        );
    }
}

/// Nothing viscous is left at the end: where Newton converges, the motion ends at the same place.
#[test]
fn the_motion_ends_where_newton_does() {
    let mut by_newton = column();
    let mut by_motion = column();
    for load in [-0.01, -0.03, -0.045] {
        let newton = by_newton
            .step(load, &settings(12), untouched)
            .expect("elastic");
        let motion = by_motion
            .step(load, &settings(1), untouched)
            .expect("elastic");
        assert!(newton.sweeps.iter().all(|sweep| sweep.phase == Phase::Pure));
        let pairs = newton
            .state
            .coordinates
            .iter()
            .zip(&motion.state.coordinates);
        let apart = pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(apart < 1e-7, "{apart}");
    }
}

/// Forces in balance with a point that will not stay as it is are no end of a step.
#[test]
fn a_point_without_lasting_equilibrium_does_not_end_a_step() {
    let mark = |until: u32| {
        move |wave: &Wave<2>, answers: &mut [ConstitutiveResponse<2>]| {
            if wave.index < until {
                answers[3].smooth = Smoothness::Provisional;
            }
        }
    };
    let outcome = column()
        .step(-0.03, &settings(4), mark(6))
        .expect("the point settles in the end");
    assert_eq!(outcome.sweeps.len(), 7);
    assert_eq!(outcome.sweeps[5].provisional, 1);
    let failure = column()
        .step(-0.03, &settings(4), mark(u32::MAX))
        .expect_err("it never settles");
    let FailureReason::Provisional { points, .. } = &failure.reason else {
        panic!("{failure}");
    };
    assert_eq!(points, &[GaussPointId(3)]);
    // The forces balance from the first sweeps on: there is nothing to wait 400 for.
    assert!(failure.sweeps.len() < 60, "{}", failure.sweeps.len());
}

/// A wild correction must not cost the step: half of it may do.
#[test]
fn a_correction_that_a_point_cannot_follow_is_halved() {
    let column = column();
    let begin = || {
        let mut step = StepSolver::begin(
            &column.problem,
            &column.state,
            &[0.0],
            &[-0.2],
            &settings(4),
        )
        .expect("fits");
        let Request::Evaluate(first) = step.next() else {
            panic!("a predictor");
        };
        let answer = |(id, f): &(GaussPointId, _)| respond(*id, &Point::default(), f).1;
        let answers: Vec<_> = first.points.iter().map(answer).collect();
        let second = step.advance(&answers);
        (step, second)
    };
    let failed = || vec![(GaussPointId(8), "torn apart".to_owned())];
    let stretch = |request: &Request<2>| match request {
        Request::Evaluate(wave) => wave.points[8].1[1][1] - 1.0,
        other => panic!("{other:?}"),
    };
    let (mut step, second) = begin();
    let whole = stretch(&second);
    let predicted = -0.2 / 5.0;
    let halved = step.advance_failed(failed());
    let expected = predicted + 0.5 * (whole - predicted);
    assert!((stretch(&halved) - expected).abs() < 1e-12);
    for _ in 0..3 {
        assert!(matches!(
            step.advance_failed(failed()),
            Request::Evaluate(_)
        ));
    }
    match step.advance_failed(failed()) {
        Request::Failed(failure) => assert!(failure.to_string().contains("torn apart")),
        other => panic!("{other:?}"),
    }
}
