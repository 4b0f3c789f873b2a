//! The state machine of a step attempt: what it asks for, and what it is told.

mod begin;
mod digest;
mod ending;
mod measures;

use std::sync::Arc;

use super::correction::Correction;
use super::state::{Status, StepState};
use super::{FailureReason, StepFailure, StepOutcome, SweepReport};
use crate::constitutive::{Base, ConstitutiveResponse, GaussPointId, Wave};
use crate::kinematics::{deformation_gradient, point_geometry};
use crate::problem::Problem;
use crate::tensor::Tensor2;

pub use begin::{BeginError, RestoreError};

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

/// One attempt at one load step.
#[derive(Clone, Debug)]
pub struct StepSolver<const D: usize> {
    problem: Arc<Problem<D>>,
    state: StepState<D>,
}

impl<const D: usize> StepSolver<D> {
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

    fn adopt(&mut self, correction: Correction) {
        let trial = &mut self.state.trial;
        trial.coordinates = correction.coordinates;
        trial.loads = correction.loads;
        trial.correction = correction.ratio;
        trial.size = correction.size;
        trial.safeguarded = correction.safeguarded;
        trial.linear_residual = correction.linear_residual;
    }
}
