//! The state machine of a step attempt.

use std::sync::Arc;

use thiserror::Error;

use super::correction::{Correction, correct, guard, predict};
use super::macro_state::{StateError, reactions};
use super::plan::Origin;
use super::state::{Iterate, Size, Status, StepState, Trial};
use super::{
    Acceptance, Control, FailureReason, MacroState, Path, Phase, Relaxation, StepFailure,
    StepOutcome, StepSettings, Strategy, SweepReport,
};
use crate::assembly::{Configuration, Residual, element_shares, internal_forces, residual};
use crate::boundary::CavityProblem;
use crate::constitutive::{Base, ConstitutiveResponse, GaussPointId, Wave};
use crate::kinematics::{InvertedElement, deformation_gradient, point_geometry};
use crate::layout::Field;
use crate::problem::Problem;
use crate::tensor::{self, Tensor2};

/// Number of elements a failure names.
const WORST_ELEMENTS: usize = 8;

/// What the machine wants, or how it ended.
#[derive(Clone, PartialEq, Debug)]
pub enum Request<const D: usize> {
    /// Evaluate the constitutive law at every point; answer with [`StepSolver::advance`].
    Evaluate(Wave<D>),
    /// The step is solved.
    Converged(Box<StepOutcome<D>>),
    /// The step is not solved.
    Failed(Box<StepFailure>),
}

/// A step cannot be begun: the inputs do not fit together.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum BeginError {
    /// The committed state does not fit the problem.
    #[error("begin the step: {0}")]
    State(#[from] StateError),
    /// The cavity whose volume should be followed has none.
    #[error("begin the step: {0}")]
    Cavity(#[from] CavityProblem),
    /// The load that should adapt does not exist.
    #[error("begin the step: there is no load {load} to adapt")]
    Control {
        /// The load.
        load: usize,
    },
    /// The wrong number of load values, or one that is not finite.
    #[error("begin the step: {found} finite load values were given, the problem has {expected}")]
    Loads {
        /// Number of loads of the problem.
        expected: usize,
        /// Number of finite values given.
        found: usize,
    },
}

/// A stored step attempt does not belong to the problem.
#[derive(Error, Clone, PartialEq, Debug)]
#[error("restore the step: {what} does not fit the problem")]
pub struct RestoreError {
    what: &'static str,
}

/// One attempt at one load step.
#[derive(Clone, Debug)]
pub struct StepSolver<const D: usize> {
    problem: Arc<Problem<D>>,
    state: StepState<D>,
}

impl<const D: usize> StepSolver<D> {
    /// Begins a step from the committed state, loads going from `values_n` to `values_next`.
    ///
    /// Prescribed displacements move by the change of their value over the step, external loads
    /// take their new value. A predictor that cannot be computed is not an error of this function
    /// but a first request [`Request::Failed`]: a shorter step may succeed.
    ///
    /// # Errors
    /// A state or load values that do not fit the problem.
    pub fn begin(
        problem: &Arc<Problem<D>>,
        committed: &MacroState<D>,
        values_n: &[f64],
        values_next: &[f64],
        settings: &StepSettings,
    ) -> Result<Self, BeginError> {
        Self::begin_controlled(problem, committed, (values_n, values_next, None), settings)
    }

    /// Begins a step as [`begin`](Self::begin) does, in which the load that `control` names adapts to what is followed; its
    /// next value is where the search begins.
    ///
    /// # Errors
    /// Also a control that does not fit the problem.
    pub fn begin_controlled(
        problem: &Arc<Problem<D>>,
        committed: &MacroState<D>,
        (values_n, values_next, control): (&[f64], &[f64], Option<&Control>),
        settings: &StepSettings,
    ) -> Result<Self, BeginError> {
        committed.check(problem)?;
        if let Some(control) = control {
            control.check(problem)?;
            if control.load >= problem.load_count() {
                return Err(BeginError::Control { load: control.load });
            }
        }
        for values in [values_n, values_next] {
            let found = values.iter().filter(|value| value.is_finite()).count();
            let expected = problem.load_count();
            if values.len() != expected || found != expected {
                return Err(BeginError::Loads { expected, found });
            }
        }
        let mut prescribed = vec![0.0; problem.layout().len()];
        for given in &problem.constraints().prescribed {
            prescribed[given.dof] = given.value.at(values_next) - given.value.at(values_n);
        }
        let mut solver = StepSolver {
            problem: Arc::clone(problem),
            state: StepState {
                settings: *settings,
                committed: committed.clone(),
                control: control.cloned(),
                trial: Trial {
                    wave: 0,
                    phase: Phase::Pure,
                    base: Base::Committed,
                    start: None,
                    coordinates: committed.unknowns(),
                    loads: values_next.to_vec(),
                    base_coordinates: Vec::new(),
                    from: committed.unknowns(),
                    from_loads: values_next.to_vec(),
                    unbalanced: Vec::new(),
                    released: 0.0,
                    halvings: 0,
                    correction: 1.0,
                    size: Size::Significant,
                    safeguarded: 0,
                    linear_residual: 0.0,
                },
                best: None,
                restored: None,
                previous_residual: None,
                reach: f64::INFINITY,
                viscosity: Relaxation::FIRST_VISCOSITY,
                predictor_tangents: committed.predictor_tangents.clone(),
                sweeps: Vec::new(),
                status: Status::Evaluating,
            },
        };
        let loads = (values_next, control);
        match predict(problem, committed, loads, &prescribed, settings) {
            Ok((correction, reach)) => {
                solver.state.reach = reach;
                solver.adopt(correction);
            }
            Err(reason) => solver.fail(reason),
        }
        Ok(solver)
    }

    /// Goes on with a stored attempt.
    ///
    /// # Errors
    /// A state that was not stored for this problem.
    pub fn restore(problem: &Arc<Problem<D>>, state: StepState<D>) -> Result<Self, RestoreError> {
        state.committed.check(problem).map_err(|_| RestoreError {
            what: "the committed state",
        })?;
        let (dofs, points) = (problem.layout().len(), problem.gauss_point_count());
        let trial = &state.trial;
        let base_fits = match trial.base {
            Base::Committed => trial.base_coordinates.is_empty(),
            Base::Wave(_) => trial.base_coordinates.len() == dofs,
        };
        let best_fits = state.best.as_ref().is_none_or(|best| {
            best.coordinates.len() == dofs
                && best.stress.len() == points * D * D
                && best.tangents.len() == points * D * D * D * D
                && best.elastic_tangents.len() == best.tangents.len()
                && best.rebased.len() == points
        });
        for (fits, what) in [
            (
                [&trial.loads, &trial.from_loads]
                    .iter()
                    .all(|loads| loads.len() == problem.load_count()),
                "the list of loads",
            ),
            (
                trial.coordinates.len() == dofs
                    && trial.from.len() == dofs
                    && [0, dofs].contains(&trial.unbalanced.len())
                    && base_fits,
                "the pending wave",
            ),
            (best_fits, "the best iterate"),
            (
                state.predictor_tangents.len() == points * D * D * D * D,
                "the list of predictor tangents",
            ),
        ] {
            if !fits {
                return Err(RestoreError { what });
            }
        }
        Ok(StepSolver {
            problem: Arc::clone(problem),
            state,
        })
    }

    /// The memory of the attempt, to be stored while a wave is out.
    pub fn state(&self) -> &StepState<D> {
        &self.state
    }

    /// What the waves answered so far gave, in order.
    pub fn sweeps(&self) -> &[SweepReport] {
        &self.state.sweeps
    }

    /// The pending request; the same one until it is answered.
    pub fn next(&self) -> Request<D> {
        match &self.state.status {
            Status::Evaluating => match self.pending_wave() {
                Ok(wave) => Request::Evaluate(wave),
                Err(reason) => Request::Failed(Box::new(self.failure(reason))),
            },
            Status::Converged(outcome) => Request::Converged(outcome.clone()),
            Status::Failed(failure) => Request::Failed(failure.clone()),
        }
    }

    /// Earlier waves whose end states are still needed, ascending: the base and the warm start of
    /// the pending wave, and the best iterate, which may be restored or committed. Every other
    /// finished wave may be dropped. A wave just evaluated must be kept until `advance` returned.
    pub fn live_waves(&self) -> Vec<u32> {
        if let Status::Converged(outcome) = &self.state.status {
            return vec![outcome.wave];
        }
        let trial = &self.state.trial;
        let base = match trial.base {
            Base::Committed => None,
            Base::Wave(wave) => Some(wave),
        };
        let best = self.state.best.as_ref().map(|best| best.wave);
        let mut waves: Vec<u32> = [base, trial.start, best].into_iter().flatten().collect();
        waves.sort_unstable();
        waves.dedup();
        waves
    }

    /// Takes the answers of the pending wave, in Gauss point order, and says what comes next.
    /// Without a pending wave the answers are ignored.
    pub fn advance(&mut self, responses: &[ConstitutiveResponse<D>]) -> Request<D> {
        if self.state.status == Status::Evaluating
            && let Err(reason) = self.digest(responses)
        {
            self.fail(reason);
        }
        self.next()
    }

    /// Some points of the pending wave could not be evaluated. A correction that led there is halved and asked for again;
    /// where halving does not help, or for the predictor, which prescribed displacements do not let shrink, the attempt
    /// has failed.
    pub fn advance_failed(&mut self, points: Vec<(GaussPointId, String)>) -> Request<D> {
        /// Halvings of a correction before giving up: to a sixteenth.
        const HALVINGS: u32 = 4;

        if self.state.status == Status::Evaluating {
            let trial = &mut self.state.trial;
            if self.state.sweeps.is_empty() || trial.halvings == HALVINGS {
                self.fail(FailureReason::PointsFailed { points });
            } else {
                trial.halvings += 1;
                trial.wave += 1;
                trial.correction *= 0.5;
                let halve = |to: &mut [f64], from: &[f64]| {
                    for (to, from) in to.iter_mut().zip(from) {
                        *to = from + 0.5 * (*to - from);
                    }
                };
                halve(&mut trial.coordinates, &trial.from);
                halve(&mut trial.loads, &trial.from_loads);
            }
        }
        self.next()
    }

    fn pending_wave(&self) -> Result<Wave<D>, FailureReason> {
        let trial = &self.state.trial;
        let base = match trial.base {
            Base::Committed => &self.state.committed.coordinates,
            Base::Wave(_) => &trial.base_coordinates,
        };
        let problem = &self.problem;
        let gradient = |id: GaussPointId| -> Result<Tensor2<D>, FailureReason> {
            let (element, point) = problem.locate(id);
            let nodes = problem.mesh().element(element);
            point_geometry(&problem.reference_points()[point], nodes, base)
                .map(|geometry| deformation_gradient(&geometry, nodes, base, &trial.coordinates))
                .ok_or(FailureReason::ElementInverted { element, point })
        };
        let points = problem
            .gauss_points()
            .map(|id| gradient(id).map(|f| (id, f)))
            .collect::<Result<_, FailureReason>>()?;
        Ok(Wave {
            index: trial.wave,
            base: trial.base,
            start: trial.start,
            points,
        })
    }

    fn digest(&mut self, responses: &[ConstitutiveResponse<D>]) -> Result<(), FailureReason> {
        self.check(responses)?;
        let trial = &self.state.trial;
        let (phase, size) = (trial.phase, trial.size);
        let mut iterate = Iterate::new(
            trial.wave,
            (trial.coordinates.clone(), trial.loads.clone()),
            responses,
        );
        let balance = self.balance(&iterate)?;
        let ratio = balance.ratio();
        iterate.residual = ratio;
        iterate.released = trial.released + self.released(&balance.vector);
        self.state.sweeps.push(SweepReport {
            wave: trial.wave,
            phase,
            residual: ratio,
            correction: trial.correction,
            rebased: iterate.rebased.iter().filter(|&&rebased| rebased).count(),
            provisional: iterate.provisional.len(),
            safeguarded: trial.safeguarded,
            linear_residual: trial.linear_residual,
            mismatch: balance.mismatch,
        });
        if phase == Phase::Pure {
            let mut tangents = iterate.tangents.clone();
            let elastic = &self.state.committed.elastic_tangents;
            guard::<D>(&mut tangents, elastic, &self.state.settings);
            self.state.predictor_tangents = tangents;
        }
        let tolerance = self.state.settings.force_tolerance;
        // Where nothing moves, the mismatch is noise over noise.
        let tied = size == Size::Negligible && self.is_still(&iterate)
            || balance
                .mismatch
                .is_none_or(|mismatch| mismatch <= tolerance);
        let on_path = self.miss(&iterate) <= self.state.settings.displacement_tolerance;
        let small = ratio <= tolerance && tied && on_path && iterate.provisional.is_empty();
        if small && size == Size::Negligible {
            return self.converge(iterate, &balance, Acceptance::Tolerance);
        }
        if self
            .state
            .best
            .as_ref()
            .is_none_or(|best| iterate.is_better_than(best))
        {
            self.state.best = Some(iterate.clone());
        }
        if phase == Phase::Relaxation
            && let Strategy::TwoPhase(settings) = self.state.settings.strategy
            && let Some(before) = self.state.previous_residual
        {
            let trend = ratio / before;
            self.state.viscosity = settings
                .relaxation
                .next_viscosity(self.state.viscosity, trend);
        }
        let Some(plan) = self.state.plan(phase, ratio) else {
            return self.give_up();
        };
        let from = match (plan.from, &self.state.best) {
            (Origin::Best, Some(best)) => best.clone(),
            _ => iterate.clone(),
        };
        let correction = correct(
            &self.problem,
            &self.state.committed,
            (self.state.control.as_ref(), self.state.reach),
            &from,
            (plan.phase, plan.choice),
            &self.state.settings,
        )?;
        if small && correction.size == Size::Negligible && from.wave == iterate.wave {
            return self.converge(iterate, &balance, Acceptance::Tolerance);
        }
        if plan.from == Origin::Best {
            self.state.restored = Some(from.wave);
        }
        self.state.previous_residual = Some(from.residual);
        let unbalanced = match plan.phase {
            Phase::Pure => Vec::new(),
            Phase::Path | Phase::Relaxation if from.wave == iterate.wave => balance.vector,
            Phase::Path | Phase::Relaxation => self.balance(&from)?.vector,
        };
        let trial = &mut self.state.trial;
        trial.wave += 1;
        trial.halvings = 0;
        trial.phase = plan.phase;
        trial.from = from.coordinates.clone();
        trial.from_loads = from.loads.clone();
        trial.released = match plan.phase {
            Phase::Pure => 0.0,
            Phase::Path | Phase::Relaxation => from.released,
        };
        trial.unbalanced = unbalanced;
        (trial.base, trial.start, trial.base_coordinates) = match plan.phase {
            Phase::Pure => (Base::Committed, Some(from.wave), Vec::new()),
            Phase::Path | Phase::Relaxation => (Base::Wave(from.wave), None, from.coordinates),
        };
        self.adopt(correction);
        Ok(())
    }

    /// ½(R_k + R_{k+1})·(x_k − x_{k+1}), k being the base of the pending wave and R_{k+1} the forces out of balance with
    /// its answers; nothing from the committed state, as a pure sweep is no motion of the body.
    fn released(&self, balance: &[f64]) -> f64 {
        let trial = &self.state.trial;
        let free = |dof: &usize| {
            self.problem.constraints().equation[*dof].is_some()
                && self.problem.layout().field(*dof) != Field::Multiplier
        };
        let forces = trial.unbalanced.iter().zip(balance);
        let moved = trial.from.iter().zip(&trial.coordinates);
        let terms = (0..).zip(forces.zip(moved));
        terms
            .filter(|(dof, _)| free(dof))
            .map(|(_, ((before, after), (from, to)))| 0.5 * (before + after) * (from - to))
            .sum()
    }

    fn check(&self, responses: &[ConstitutiveResponse<D>]) -> Result<(), FailureReason> {
        let (expected, found) = (self.problem.gauss_point_count(), responses.len());
        if expected != found {
            return Err(FailureReason::WrongResponseCount { expected, found });
        }
        for (point, response) in self.problem.gauss_points().zip(responses) {
            let tangents = [&response.tangent, &response.elastic_tangent];
            let tangents = tangents.into_iter().flatten().flatten().flatten().flatten();
            if !response
                .stress
                .iter()
                .flatten()
                .chain(tangents)
                .all(|value| value.is_finite())
            {
                return Err(FailureReason::NonFiniteResponse { point });
            }
        }
        Ok(())
    }

    fn adopt(&mut self, correction: Correction) {
        let trial = &mut self.state.trial;
        trial.coordinates = correction.coordinates;
        trial.loads = correction.loads;
        trial.correction = correction.ratio;
        trial.size = correction.size;
        trial.safeguarded = correction.safeguarded;
        trial.linear_residual = correction.linear_residual;
    }

    /// All sweeps are used up: the best iterate within the loose tolerance, or failure.
    fn give_up(&mut self) -> Result<(), FailureReason> {
        let (sweeps, settings) = (self.state.sweeps.len(), self.state.settings);
        let not_converged = |residual: f64| FailureReason::NotConverged {
            sweeps,
            residual,
            tolerance: settings.force_tolerance,
        };
        let Some(best) = self.state.best.clone() else {
            return Err(not_converged(f64::INFINITY));
        };
        if !best.provisional.is_empty() {
            return Err(FailureReason::Provisional {
                sweeps,
                residual: best.residual,
                points: best.provisional,
            });
        }
        let enough = match settings.strategy {
            Strategy::TwoPhase(two_phase) => two_phase.loose_tolerance,
            Strategy::Plain { .. } => settings.force_tolerance,
        };
        let miss = self.miss(&best);
        if best.residual > enough {
            Err(not_converged(best.residual))
        } else if miss > settings.displacement_tolerance {
            Err(FailureReason::OffPath {
                sweeps,
                residual: best.residual,
                miss,
            })
        } else if matches!(settings.strategy, Strategy::TwoPhase(_)) {
            let balance = self.balance(&best)?;
            let accepted = Acceptance::LooselyAccepted {
                residual: best.residual,
            };
            self.converge(best, &balance, accepted)
        } else {
            Err(not_converged(best.residual))
        }
    }

    fn balance(&self, iterate: &Iterate) -> Result<Residual, InvertedElement> {
        residual(&self.problem, &self.configuration(iterate))
    }

    fn configuration<'a>(&'a self, iterate: &'a Iterate) -> Configuration<'a> {
        iterate.configuration(&self.state.committed)
    }

    /// How far off what controls the step is, in parts of the step; 0 where loads alone do.
    fn miss(&self, iterate: &Iterate) -> f64 {
        self.state.control.as_ref().map_or(0.0, |control| {
            let moving = self.problem.dof_count();
            control.miss(
                &self.problem,
                &self.state.committed.coordinates,
                &iterate.coordinates[..moving],
            )
        })
    }

    /// Whether the step moved by no more than what counts as none.
    fn is_still(&self, iterate: &Iterate) -> bool {
        let before = self.state.committed.coordinates.iter();
        let moved: f64 = before
            .zip(&iterate.coordinates)
            .map(|(a, b)| (b - a) * (b - a))
            .sum();
        let mean = (moved / self.problem.dof_count() as f64).sqrt();
        mean <= self.state.settings.displacement_floor * self.problem.mesh().diameter()
    }

    /// ∫σ:dε from the committed state to `iterate`: ½(f_n + f_{n+1})·(x_{n+1} − x_n), f being the forces of the stresses.
    fn work(&self, iterate: &Iterate) -> Result<f64, FailureReason> {
        let forces = |positions: &[f64], stress: &[f64]| {
            internal_forces(&self.problem, positions, |_, index| {
                tensor::load2::<D>(stress, index)
            })
        };
        let committed = &self.state.committed;
        let (before, _) = forces(&committed.coordinates, &committed.stress)?;
        let (after, _) = forces(&iterate.coordinates, &iterate.stress)?;
        let moved = iterate.coordinates.iter().zip(&committed.coordinates);
        let pairs = before.iter().zip(&after).zip(moved);
        Ok(pairs
            .map(|((f, g), (x, from))| 0.5 * (f + g) * (x - from))
            .sum())
    }

    fn converge(
        &mut self,
        iterate: Iterate,
        balance: &Residual,
        accepted: Acceptance,
    ) -> Result<(), FailureReason> {
        let work = self.work(&iterate)?;
        let second_gradient = match &self.state.committed.second_gradient {
            None => None,
            Some(before) => {
                let at = self.configuration(&iterate);
                Some(before.after(&self.problem, &at)?)
            }
        };
        let mut coordinates = iterate.coordinates;
        coordinates.truncate(self.problem.dof_count());
        let initial = self.problem.initial();
        let displacement = coordinates.iter().zip(initial);
        let displacement = displacement.map(|(x, x0)| x - x0).collect();
        let followed = self.state.control.as_ref().map(|control| &control.path);
        let increment = matches!(followed, Some(Path::ArcLength { .. })).then(|| {
            let moved = coordinates.iter().zip(&self.state.committed.coordinates);
            moved.map(|(x, from)| x - from).collect()
        });
        let outcome = StepOutcome {
            state: MacroState {
                displacement,
                coordinates,
                stress: iterate.stress,
                predictor_tangents: self.state.predictor_tangents.clone(),
                elastic_tangents: self.state.committed.elastic_tangents.clone(),
                reactions: reactions(&self.problem, &balance.vector),
                loads: iterate.loads,
                second_gradient,
                increment,
            },
            wave: iterate.wave,
            accepted,
            residual: iterate.residual,
            work,
            released: iterate.released,
            sweeps: self.state.sweeps.clone(),
        };
        self.state.status = Status::Converged(Box::new(outcome));
        Ok(())
    }

    fn fail(&mut self, reason: FailureReason) {
        self.state.status = Status::Failed(Box::new(self.failure(reason)));
    }

    fn failure(&self, reason: FailureReason) -> StepFailure {
        let worst_elements = self.state.best.as_ref().and_then(|best| {
            let balance = self.balance(best).ok()?;
            Some(element_shares(
                &self.problem,
                &balance.vector,
                WORST_ELEMENTS,
            ))
        });
        StepFailure {
            reason,
            worst_elements: worst_elements.unwrap_or_default(),
            sweeps: self.state.sweeps.clone(),
        }
    }
}
