//! Tolerances and strategy of a step, each with its reason.

use serde::{Deserialize, Serialize};

use super::{Relaxation, Safeguard};

/// How a step is solved and when it counts as solved.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct StepSettings {
    /// Largest ‖R_free‖/max(‖reactions‖, ‖external‖). 1e-3: where the REVs' own noise allows it at
    /// every step up to the peak; 1e-4 nearly always works before.
    pub force_tolerance: f64,
    /// Largest ‖du‖/‖Δu‖, du being the last correction or the next one, whichever is smaller: both
    /// estimate the distance to the solution, and the next one costs no constitutive evaluation.
    pub displacement_tolerance: f64,
    /// Corrections with a root mean square below this fraction of the mesh diameter count as none.
    /// A hold stage has Δu ≈ 0, and noise over noise never converges. 1e-9: a strain of 1e-7 in a
    /// mesh of a hundred elements across.
    pub displacement_floor: f64,
    /// Guard on tangents.
    pub safeguard: Safeguard,
    /// How the sweeps follow each other.
    pub strategy: Strategy,
}

impl Default for StepSettings {
    fn default() -> Self {
        StepSettings {
            force_tolerance: 1e-3,
            displacement_tolerance: 1e-2,
            displacement_floor: 1e-9,
            safeguard: Safeguard::default(),
            strategy: Strategy::TwoPhase(TwoPhase::default()),
        }
    }
}

impl StepSettings {
    /// Plain Newton to `force_tolerance`, for smooth local laws.
    pub fn smooth(force_tolerance: f64) -> Self {
        StepSettings {
            force_tolerance,
            strategy: Strategy::Plain { max_sweeps: 25 },
            ..Self::default()
        }
    }
}

/// The sequence of sweeps.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// Every sweep from the committed state, algorithmic tangents as they are: quadratic for a
    /// smooth law.
    Plain {
        /// Sweeps before giving up.
        max_sweeps: usize,
    },
    /// Pure sweeps first, then path sweeps: what converges over REVs.
    TwoPhase(TwoPhase),
}

/// When the two-phase strategy changes what it does. Defaults as measured on 128 and 512 REVs.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct TwoPhase {
    /// Pure sweeps at most; after them the path phase. 4: later ones gain less than they cost.
    pub pure_sweeps: usize,
    /// The slow-convergence test applies below this residual only. 1e-2: above it the step is
    /// still far from its end, and entering the path phase early makes the answer path-dependent
    /// (2.5 % in force when entered after two sweeps at 0.9 % strain).
    pub slow_below: f64,
    /// A ratio of successive residuals above this is slow. 0.35.
    pub slow_ratio: f64,
    /// When the current residual exceeds the best by this factor, the best iterate is restored.
    /// 1.3.
    pub restore_ratio: f64,
    /// Sweeps in total before the overdamped motion. 12.
    pub sweeps: usize,
    /// The overdamped motion.
    pub relaxation: Relaxation,
    /// At the end, the best iterate is still accepted up to this residual, and the outcome says
    /// so. 1e-2; set it to 0 to refuse.
    pub loose_tolerance: f64,
    /// Largest strain that a predictor or a Newton correction may bring to a Gauss point, in largest strains that the
    /// elastic body would undergo in this step, but [`LEAST_REACH`](Self::LEAST_REACH) in any case; beyond it, the tangents
    /// are made viscous. 10: a band of one element among ten.
    pub largest_strain_ratio: f64,
    /// Largest correction in the path phase, in norms of the step so far. 1.
    pub correction_cap: f64,
}

impl Default for TwoPhase {
    fn default() -> Self {
        TwoPhase {
            pure_sweeps: 4,
            slow_below: 1e-2,
            slow_ratio: 0.35,
            restore_ratio: 1.3,
            sweeps: 12,
            relaxation: Relaxation::default(),
            loose_tolerance: 1e-2,
            largest_strain_ratio: 10.0,
            correction_cap: 1.0,
        }
    }
}

impl TwoPhase {
    /// A strain that REVs always follow: half a percent.
    pub const LEAST_REACH: f64 = 5e-3;

    /// How far corrections may reach in a step in which the elastic body would strain by `elastic` at most.
    pub(super) fn reach(&self, elastic: f64) -> f64 {
        (self.largest_strain_ratio * elastic).max(Self::LEAST_REACH)
    }
}
