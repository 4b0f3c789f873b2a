//! The strategy: what follows a sweep that did not converge. Its reasons are in
//! `docs/design/coupling.md`.

use super::correction::TangentChoice;
use super::state::StepState;
use super::{Phase, Strategy, SweepReport, TwoPhase};

/// Where the next correction starts, and with which tangents.
pub(super) struct Plan {
    pub phase: Phase,
    pub choice: TangentChoice,
    pub from: Origin,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    Current,
    Best,
}

impl<const D: usize> StepState<D> {
    /// What to do after a sweep that did not converge; `None` when the sweeps are used up.
    pub(super) fn plan(&self, phase: Phase, ratio: f64) -> Option<Plan> {
        let sweeps = self.sweeps.len();
        let settings = match self.settings.strategy {
            Strategy::Plain { max_sweeps } => {
                return (sweeps < max_sweeps).then_some(Plan {
                    phase: Phase::Pure,
                    choice: TangentChoice::Algorithmic,
                    from: Origin::Current,
                });
            }
            Strategy::TwoPhase(settings) => settings,
        };
        if sweeps >= settings.sweeps + settings.relaxation.sweeps || self.is_at_rest_without_end() {
            return None;
        }
        if sweeps >= settings.sweeps {
            let from = match phase {
                Phase::Relaxation => Origin::Current,
                Phase::Pure | Phase::Path => Origin::Best,
            };
            return Some(Plan {
                phase: Phase::Relaxation,
                choice: TangentChoice::Damped(self.viscosity),
                from,
            });
        }
        let next = if phase == Phase::Pure && !self.leaves_pure_phase(&settings, ratio) {
            Phase::Pure
        } else {
            Phase::Path
        };
        let from = if next == Phase::Pure {
            Origin::Current
        } else {
            self.origin(&settings, ratio)
        };
        // The algorithmic tangent of a pure sweep belongs to the whole step and diverges on the
        // small increments of the path phase; and a restored iterate must not be left by the same
        // way that failed.
        let choice = if next != phase || from == Origin::Best {
            TangentChoice::ElasticEnd
        } else {
            TangentChoice::Algorithmic
        };
        Some(Plan {
            phase: next,
            choice,
            from,
        })
    }

    /// Whether forces have balanced for many sweeps around points that a step may not end with: nothing drives them any more.
    fn is_at_rest_without_end(&self) -> bool {
        /// A point that does not come to rest at first goes on from sweep to sweep, and may yet.
        const PATIENCE: usize = 40;

        let balanced = |sweep: &SweepReport| {
            sweep.phase == Phase::Relaxation
                && sweep.residual <= self.settings.force_tolerance
                && sweep.provisional > 0
        };
        let latest = self.sweeps.iter().rev().take(PATIENCE);
        latest.clone().count() == PATIENCE && latest.into_iter().all(balanced)
    }

    fn leaves_pure_phase(&self, settings: &TwoPhase, ratio: f64) -> bool {
        let trend = self.previous_residual.map(|previous| ratio / previous);
        let slow = ratio < settings.slow_below && trend.is_some_and(|t| t > settings.slow_ratio);
        let grew = trend.is_some_and(|t| t > 1.0);
        slow || grew || self.sweeps.len() >= settings.pure_sweeps
    }

    fn origin(&self, settings: &TwoPhase, ratio: f64) -> Origin {
        match &self.best {
            // Once per best iterate: from the same one by the same way leads to the same place.
            Some(best)
                if ratio > settings.restore_ratio * best.residual
                    && self.restored != Some(best.wave) =>
            {
                Origin::Best
            }
            _ => Origin::Current,
        }
    }
}
