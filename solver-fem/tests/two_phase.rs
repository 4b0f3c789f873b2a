//! The two-phase machine over laws that behave as badly as a REV does.

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;

use common::{drive, elastic_step, hold};
use solver_fem::boundary::{Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::{
    Acceptance, FailureReason, MacroState, Phase, Relaxation, Request, StepFailure, StepOutcome,
    StepSettings, StepSolver, StepState, Strategy, TwoPhase,
};
use solver_fem::problem::Problem;
use solver_fem::tensor::{self, Tensor2, Tensor4};
use solver_fem::{Base, ConstitutiveResponse, GaussPointId, Smoothness, Wave};

/// Plane-strain elastoplasticity with a pressure-dependent yield limit, no dilation
/// (non-associated) and hardening or softening; the state is stress and plastic strain.
#[derive(Clone, Copy)]
struct Granular {
    elastic: Elastic,
    hardening: f64,
    /// Scatter of the stress over an increment of 1e-3; smaller increments scatter less, which is
    /// what the path phase lives on.
    noise: f64,
}

#[derive(Clone, Copy)]
struct Point {
    stress: Tensor2<2>,
    plastic: f64,
}

impl Granular {
    const FRICTION: f64 = 0.5;

    fn stress(&self, point: &Point, f: &Tensor2<2>) -> Point {
        let trial = self
            .elastic
            .respond(&point.stress, f)
            .expect("regular")
            .stress;
        let mean = 0.5 * tensor::trace(&trial);
        let dev = [
            [trial[0][0] - mean, trial[0][1]],
            [trial[1][0], trial[1][1] - mean],
        ];
        let size = dev.iter().flatten().map(|s| s * s).sum::<f64>().sqrt();
        let limit = (-mean).max(0.0) * Self::FRICTION + self.hardening * point.plastic;
        let excess = size - limit.max(1e-3);
        if excess <= 0.0 {
            return Point {
                stress: trial,
                plastic: point.plastic,
            };
        }
        let multiplier = excess / (2.0 * self.elastic.shear + self.hardening);
        let scale = 1.0 - 2.0 * self.elastic.shear * multiplier / size;
        let mut stress = dev.map(|row| row.map(|s| s * scale));
        stress[0][0] += mean;
        stress[1][1] += mean;
        Point {
            stress,
            plastic: point.plastic + multiplier,
        }
    }

    fn respond(&self, point: &Point, f: &Tensor2<2>) -> (Point, ConstitutiveResponse<2>) {
        let h = 1e-7;
        let mut end = self.stress(point, f);
        let mut tangent: Tensor4<2> = tensor::zero4();
        for k in 0..2 {
            for l in 0..2 {
                let mut step = tensor::identity::<2>();
                step[k][l] += h;
                let moved = self.stress(point, &tensor::product(&step, f)).stress;
                for i in 0..2 {
                    for j in 0..2 {
                        tangent[i][j][k][l] = (moved[i][j] - end.stress[i][j]) / h;
                    }
                }
            }
        }
        let elastic_tangent = self.elastic.tangent_at(&end.stress);
        let size = (0..2)
            .flat_map(|i| (0..2).map(move |j| f[i][j] - if i == j { 1.0 } else { 0.0 }))
            .map(|h| h * h)
            .sum::<f64>()
            .sqrt();
        // Scatter that depends on every bit of F: as good as random, and yet a pure function.
        let mut seed = f.iter().flatten().fold(0u64, |seed, x| {
            (seed ^ x.to_bits())
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .rotate_left(31)
        });
        for i in 0..2 {
            for j in i..2 {
                seed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(17) ^ 0x5bd1;
                let random = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                end.stress[i][j] += self.noise * random * (size / 1e-3).min(1.0);
                end.stress[j][i] = end.stress[i][j];
            }
        }
        let stress = end.stress;
        let smooth = if seed % 7 == 0 && self.noise > 0.0 {
            Smoothness::Rebased
        } else {
            Smoothness::Smooth
        };
        (
            end,
            ConstitutiveResponse {
                stress,
                tangent,
                elastic_tangent,
                smooth,
            },
        )
    }
}

/// Keeps end states by wave, as the engine and the store do, and only those declared live.
struct Engine {
    law: Granular,
    /// Element with a lower strength, the trigger.
    weak: Granular,
    committed: Vec<Point>,
    waves: BTreeMap<u32, Vec<Point>>,
}

impl Engine {
    fn answer(&mut self, wave: &Wave<2>) -> Vec<ConstitutiveResponse<2>> {
        let base = match wave.base {
            Base::Committed => &self.committed,
            Base::Wave(index) => self
                .waves
                .get(&index)
                .expect("a base must have been declared live"),
        };
        if let Some(start) = wave.start {
            assert!(
                self.waves.contains_key(&start),
                "a warm start must have been declared live"
            );
        }
        let (ends, answers) = wave
            .points
            .iter()
            .map(|(id, f)| {
                let law = if id.0 / 4 == 5 { &self.weak } else { &self.law };
                law.respond(&base[id.index()], f)
            })
            .unzip();
        self.waves.insert(wave.index, ends);
        answers
    }

    fn forget(&mut self, live: &[u32]) {
        self.waves.retain(|wave, _| live.contains(wave));
    }

    fn commit(&mut self, wave: u32) {
        self.committed = self
            .waves
            .remove(&wave)
            .expect("the final wave must be live");
        self.waves.clear();
    }
}

fn problem() -> Arc<Problem<2>> {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [3, 6],
    })
    .expect("sound");
    let conditions = vec![
        hold("bottom", 1),
        Condition::displacement(Target::node_set("bottom_mid"), 0, Value::Constant(0.0)),
        drive("top", 1, 0),
        Condition::pressure("left", Value::Constant(1.0)),
        Condition::pressure("right", Value::Constant(1.0)),
    ];
    Arc::new(Problem::plane_strain(mesh, conditions, 1).expect("sound"))
}

const SIGMA0: Tensor2<2> = [[-1.0, 0.0], [0.0, -1.0]];

fn engine(problem: &Problem<2>, hardening: f64, noise: f64) -> (Engine, MacroState<2>) {
    let elastic = Elastic::new(400.0, 0.2).expect("stable");
    let law = Granular {
        elastic,
        hardening,
        noise,
    };
    let weak = Granular {
        elastic: Elastic {
            shear: 0.8 * elastic.shear,
            ..elastic
        },
        ..law
    };
    let points = problem.gauss_point_count();
    let committed = vec![
        Point {
            stress: SIGMA0,
            plastic: 0.0
        };
        points
    ];
    let tangents: Vec<_> = (0..points)
        .map(|p| {
            if p / 4 == 5 { weak } else { law }
                .elastic
                .tangent_at(&SIGMA0)
        })
        .collect();
    let state =
        MacroState::initial(problem, &vec![SIGMA0; points], &tangents, &[0.0]).expect("fits");
    (
        Engine {
            law,
            weak,
            committed,
            waves: BTreeMap::new(),
        },
        state,
    )
}

fn solve(
    problem: &Arc<Problem<2>>,
    engine: &mut Engine,
    state: &MacroState<2>,
    load: f64,
    settings: &StepSettings,
) -> Result<StepOutcome<2>, StepFailure> {
    let mut step =
        StepSolver::begin(problem, state, &state.loads, &[load], settings).expect("fits");
    let mut request = step.next();
    loop {
        request = match request {
            Request::Evaluate(wave) => {
                let answers = engine.answer(&wave);
                let request = step.advance(&answers);
                engine.forget(&step.live_waves());
                request
            }
            Request::Converged(outcome) => {
                engine.commit(outcome.wave);
                return Ok(*outcome);
            }
            Request::Failed(failure) => return Err(*failure),
        };
    }
}

#[test]
fn a_noisy_path_dependent_law_converges_through_yield() {
    let problem = problem();
    let (mut engine, mut state) = engine(&problem, 20.0, 1e-4);
    let settings = StepSettings::default();
    for step in 1..=12 {
        let load = -1e-3 * f64::from(step);
        let outcome = solve(&problem, &mut engine, &state, load, &settings).expect("converges");
        assert_eq!(outcome.accepted, Acceptance::Tolerance);
        assert!(outcome.residual <= settings.force_tolerance);
        assert_eq!(outcome.sweeps[0].phase, Phase::Pure);
        state = outcome.state;
        for id in problem.gauss_points() {
            assert_eq!(state.stress_at(id), engine.committed[id.index()].stress);
        }
    }
    assert!(
        engine.committed.iter().any(|p| p.plastic > 1e-4),
        "the law did yield"
    );
}

/// Pure sweeps scatter too much for the tolerance; path sweeps must bring every step home.
#[test]
fn the_path_phase_goes_below_the_scatter_of_a_whole_step() {
    let problem = problem();
    let (mut engine, mut state) = engine(&problem, 20.0, 5e-3);
    let settings = StepSettings {
        force_tolerance: 1e-5,
        ..StepSettings::default()
    };
    for step in 1..=8 {
        let load = -1.5e-3 * f64::from(step);
        let outcome = solve(&problem, &mut engine, &state, load, &settings).expect("converges");
        assert_eq!(outcome.accepted, Acceptance::Tolerance);
        let pure = outcome
            .sweeps
            .iter()
            .filter(|sweep| sweep.phase == Phase::Pure);
        assert!(pure.clone().count() <= 4);
        assert!(
            pure.clone().all(|sweep| sweep.residual > 1e-4),
            "the test tests the path phase"
        );
        state = outcome.state;
    }
}

/// What cannot be reached is accepted only within the loose tolerance, with the best wave, and the
/// outcome says so.
#[test]
fn a_step_accepted_loosely_says_so_and_commits_its_best_wave() {
    let problem = problem();
    let (mut engine, state) = engine(&problem, 20.0, 5e-3);
    let settings = StepSettings {
        // No correction is as small as that.
        displacement_tolerance: 0.0,
        displacement_floor: 0.0,
        ..StepSettings::default()
    };
    let outcome = solve(&problem, &mut engine, &state, -2e-3, &settings).expect("loosely");
    assert_eq!(outcome.sweeps.len(), 12 + 300);
    let best = outcome
        .sweeps
        .iter()
        .min_by(|a, b| a.residual.total_cmp(&b.residual));
    let best = best.expect("there are sweeps");
    assert_eq!((outcome.wave, outcome.residual), (best.wave, best.residual));
    assert_eq!(
        outcome.accepted,
        Acceptance::LooselyAccepted {
            residual: best.residual
        }
    );
    for id in problem.gauss_points() {
        assert_eq!(
            outcome.state.stress_at(id),
            engine.committed[id.index()].stress
        );
    }
}

/// A killed step must go on with the same bits from any wave it had issued.
#[test]
fn a_step_restored_at_any_wave_ends_with_the_same_bits() {
    let problem = problem();
    let settings = StepSettings {
        // No correction is as small as that.
        displacement_tolerance: 0.0,
        displacement_floor: 0.0,
        strategy: Strategy::TwoPhase(TwoPhase {
            sweeps: 6,
            relaxation: Relaxation {
                sweeps: 3,
                ..Relaxation::default()
            },
            ..TwoPhase::default()
        }),
        ..StepSettings::default()
    };
    let (mut reference, start) = engine(&problem, 20.0, 1e-4);
    let expected =
        solve(&problem, &mut reference, &start, -2e-3, &settings).expect("loosely accepted");
    assert!(expected.sweeps.len() > 6, "all phases are passed");

    let (mut engine, start) = engine(&problem, 20.0, 1e-4);
    let mut step = StepSolver::begin(&problem, &start, &[0.0], &[-2e-3], &settings).expect("fits");
    loop {
        let stored = rmp_serde::to_vec(step.state()).expect("serialisable");
        drop(step);
        let state: StepState<2> = rmp_serde::from_slice(&stored).expect("readable");
        step = StepSolver::restore(&problem, state).expect("fits");
        match step.next() {
            Request::Evaluate(wave) => {
                let answers = engine.answer(&wave);
                step.advance(&answers);
                engine.forget(&step.live_waves());
            }
            Request::Converged(outcome) => {
                assert_eq!(*outcome, expected);
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(
                    bits(&outcome.state.coordinates),
                    bits(&expected.state.coordinates)
                );
                break;
            }
            Request::Failed(failure) => panic!("{failure}"),
        }
    }
    let other = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [1, 1],
    })
    .expect("sound");
    let conditions = vec![hold("bottom", 0), hold("bottom", 1)];
    let other = Arc::new(Problem::plane_strain(other, conditions, 1).expect("sound"));
    assert!(StepSolver::restore(&other, step.state().clone()).is_err());
}

/// One large step of a smooth law: the residual must square itself.
#[test]
fn newton_is_quadratic_for_a_smooth_law_at_large_strain() {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [2, 3],
    })
    .expect("sound");
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        drive("top", 0, 0),
        drive("top", 1, 1),
        Condition::pressure("left", Value::load(2)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 3).expect("sound"));
    let law = Elastic::new(100.0, 0.3).expect("stable");
    let start = common::at_rest(&problem, &law, &[0.0; 3]);
    let outcome =
        elastic_step(&problem, &law, &start, &[0.4, -0.3, 5.0], 1e-12).expect("converges");
    let residuals: Vec<f64> = outcome.sweeps.iter().map(|s| s.residual).collect();
    assert!(outcome.sweeps.len() <= 8, "{residuals:?}");
    let fast = residuals
        .windows(2)
        .filter(|r| r[0] < 1e-2 && r[0] > 1e-7)
        .all(|r| r[1] < 100.0 * r[0] * r[0]);
    assert!(fast, "{residuals:?}");
    assert!(outcome.sweeps.iter().all(|s| s.linear_residual < 1e-12));
}

/// Too few sweeps for the tolerance: the step must end with a reason, elements and no panic.
#[test]
fn an_impossible_step_fails_with_the_elements_that_carry_the_residual() {
    let problem = problem();
    let (mut engine, state) = engine(&problem, 20.0, 0.05);
    let settings = StepSettings {
        force_tolerance: 1e-9,
        strategy: Strategy::TwoPhase(TwoPhase {
            sweeps: 3,
            relaxation: Relaxation {
                sweeps: 1,
                ..Relaxation::default()
            },
            loose_tolerance: 0.0,
            ..TwoPhase::default()
        }),
        ..StepSettings::default()
    };
    let failure = solve(&problem, &mut engine, &state, -1e-3, &settings).expect_err("noise");
    assert!(matches!(
        failure.reason,
        FailureReason::NotConverged { sweeps: 4, .. }
    ));
    assert!(!failure.worst_elements.is_empty());
    assert!(
        failure
            .worst_elements
            .windows(2)
            .all(|w| w[0].share >= w[1].share)
    );
    assert!(failure.to_string().contains("the residual sits in e"));
}

#[test]
fn bad_answers_fail_the_step_instead_of_the_process() {
    let problem = problem();
    let (mut engine, state) = engine(&problem, 20.0, 0.0);
    let begin = || {
        StepSolver::begin(&problem, &state, &[0.0], &[-1e-3], &StepSettings::default())
            .expect("fits")
    };
    let mut step = begin();
    let Request::Evaluate(wave) = step.next() else {
        panic!("a first wave")
    };
    assert_eq!(
        (wave.index, wave.base, wave.start),
        (0, Base::Committed, None)
    );
    let mut answers = engine.answer(&wave);
    let failed = |request| match request {
        Request::Failed(failure) => failure.reason,
        other => panic!("not a failure: {other:?}"),
    };
    let reason = failed(step.advance(&answers[1..]));
    assert!(matches!(reason, FailureReason::WrongResponseCount { .. }));
    answers[3].stress[0][1] = f64::NAN;
    let reason = failed(begin().advance(&answers));
    assert_eq!(
        reason,
        FailureReason::NonFiniteResponse {
            point: GaussPointId(3)
        }
    );
    let points = vec![(GaussPointId(7), "no equilibrium".to_owned())];
    let reason = failed(begin().advance_failed(points));
    assert!(reason.to_string().contains("no equilibrium"));
    let reason = failed(
        StepSolver::begin(&problem, &state, &[0.0], &[-5.0], &StepSettings::default())
            .expect("fits")
            .next(),
    );
    assert!(
        matches!(reason, FailureReason::ElementInverted { .. }),
        "{reason}"
    );
    assert!(StepSolver::begin(&problem, &state, &[0.0], &[], &StepSettings::default()).is_err());
    let nan = [f64::NAN];
    assert!(StepSolver::begin(&problem, &state, &[0.0], &nan, &StepSettings::default()).is_err());
}

/// Holding the load must not fail because a correction is compared with a step of zero.
#[test]
fn a_hold_stage_converges_at_once() {
    let problem = problem();
    let (mut engine, state) = engine(&problem, 20.0, 0.0);
    let settings = StepSettings::default();
    let outcome = solve(&problem, &mut engine, &state, 0.0, &settings).expect("converges");
    assert_eq!(outcome.sweeps.len(), 1);
}

/// A material without any stiffness must end as a failed step that names a node, on small meshes
/// and on those large enough for the blocked factorisation.
#[test]
fn a_body_without_stiffness_fails_by_name_instead_of_with_nan() {
    for elements in [[1, 1], [12, 24]] {
        let size = [1.0, 2.0];
        let mesh = Mesh::rectangle(&Rectangle { size, elements }).expect("sound");
        let conditions = vec![hold("bottom", 0), hold("bottom", 1), drive("top", 1, 0)];
        let problem = Arc::new(Problem::plane_strain(mesh, conditions, 1).expect("sound"));
        let points = problem.gauss_point_count();
        let (stress, none) = (vec![[[0.0; 2]; 2]; points], vec![tensor::zero4(); points]);
        let state = MacroState::initial(&problem, &stress, &none, &[0.0]).expect("fits");
        let settings = StepSettings::default();
        let step = StepSolver::begin(&problem, &state, &[0.0], &[-1e-3], &settings);
        match step.expect("fits").next() {
            Request::Failed(failure) => {
                assert!(
                    matches!(failure.reason, FailureReason::Singular { .. }),
                    "{failure}"
                )
            }
            other => panic!("not seen: {other:?}"),
        }
    }
}
