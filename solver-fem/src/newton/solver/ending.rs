//! How a step attempt ends: solved, or given up.

use super::StepSolver;
use crate::assembly::{Residual, element_shares};
use crate::newton::macro_state::reactions;
use crate::newton::state::{Iterate, Status};
use crate::newton::{
    Acceptance, FailureReason, MacroState, Path, StepFailure, StepOutcome, Strategy,
};

/// Number of elements a failure names.
const WORST_ELEMENTS: usize = 8;

impl<const D: usize> StepSolver<D> {
    /// All sweeps are used up: the best iterate within the loose tolerance, or failure.
    pub(super) fn give_up(&mut self) -> Result<(), FailureReason> {
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

    pub(super) fn converge(
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
            damped: iterate.damped,
        };
        self.state.status = Status::Converged(Box::new(outcome));
        Ok(())
    }

    pub(super) fn fail(&mut self, reason: FailureReason) {
        self.state.status = Status::Failed(Box::new(self.failure(reason)));
    }

    pub(super) fn failure(&self, reason: FailureReason) -> StepFailure {
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
