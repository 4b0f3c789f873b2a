//! How a REV came to its equilibrium.

use serde::Serialize;
use solver_dem::{Settings, Tangents};

use crate::run::recorded::Question;

/// A point on the way: the first look at which the residual was below a bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Milestone {
    /// Cycles until then.
    pub cycles: u32,
    /// Largest unbalanced force over the mean contact force.
    pub residual: f64,
    /// Change of the stress since the look before, over its mean; infinite (`null` in JSON) at the first.
    pub drift: f64,
}

/// Residuals from which on is told, half a decade apart.
const FIRST: f64 = 1.0;
const RATIO: f64 = 0.316_227_766_016_837_94;

/// The way to the answer of `question`, in half decades of the residual down to its tolerance.
///
/// A solve is a pure function that stops at the first look that satisfies it. One that is satisfied earlier goes the same way
/// and stops there: asking with ever smaller tolerances walks along the way, and nothing is added to the solver.
pub fn of(question: &Question) -> Vec<Milestone> {
    let mut milestones: Vec<Milestone> = Vec::new();
    let mut bound = FIRST;
    while bound >= question.settings().tolerance {
        let settings = Settings {
            tolerance: bound,
            drift_tolerance: f64::INFINITY,
            stress_tolerance: f64::INFINITY,
            tangents: Tangents::Algorithmic,
            ..*question.settings()
        };
        bound *= RATIO;
        // What finds no equilibrium loosely finds none tightly.
        let Some(report) = question.ask(&settings) else {
            break;
        };
        let milestone = Milestone {
            cycles: report.cycles,
            residual: report.residual,
            drift: report.drift,
        };
        if milestones.last() != Some(&milestone) {
            milestones.push(milestone);
        }
    }
    milestones
}
