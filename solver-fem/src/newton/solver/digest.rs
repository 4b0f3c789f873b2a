//! What the answers of a wave come to: the step is solved, goes on with a correction, or has used up its sweeps.

use super::StepSolver;
use crate::constitutive::{Base, ConstitutiveResponse};
use crate::newton::correction::{correct, guard};
use crate::newton::plan::Origin;
use crate::newton::state::{Iterate, Size};
use crate::newton::{Acceptance, FailureReason, Phase, Strategy, SweepReport};

impl<const D: usize> StepSolver<D> {
    pub(super) fn digest(
        &mut self,
        responses: &[ConstitutiveResponse<D>],
    ) -> Result<(), FailureReason> {
        self.check(responses)?;
        let trial = &self.state.trial;
        let (phase, size) = (trial.phase, trial.size);
        let mut iterate = Iterate::new(
            trial.wave,
            (trial.coordinates.clone(), trial.loads.clone()),
            responses,
        );
        let balance = self.balance(&iterate)?;
        let ratio = balance.ratio(self.least_force());
        iterate.residual = ratio;
        let released = self.released(&balance.vector);
        iterate.released = trial.released + released;
        iterate.damped = trial.damped;
        if phase == Phase::Relaxation {
            iterate.damped += released;
        }
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
        (trial.released, trial.damped) = match plan.phase {
            Phase::Pure => (0.0, 0.0),
            Phase::Path | Phase::Relaxation => (from.released, from.damped),
        };
        trial.unbalanced = unbalanced;
        (trial.base, trial.start, trial.base_coordinates) = match plan.phase {
            Phase::Pure => (Base::Committed, Some(from.wave), Vec::new()),
            Phase::Path | Phase::Relaxation => (Base::Wave(from.wave), None, from.coordinates),
        };
        self.adopt(correction);
        Ok(())
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
}
