//! What a step attempt says about itself.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::MacroState;
use crate::assembly::ElementShare;
use crate::constitutive::GaussPointId;

/// What a sweep of constitutive evaluations starts from and is corrected with.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug)]
pub enum Phase {
    /// From the committed state, algorithmic tangents.
    Pure,
    /// From the previous sweep's end state, tangents of the small increment.
    Path,
    /// From the previous sweep's end state, as an overdamped motion ([`super::Relaxation`]). Steps of earlier versions
    /// tell of a last resort with elastic tangents in its place.
    #[serde(alias = "PathElastic")]
    Relaxation,
}

/// One sweep: a wave, and how good its answer was. Stored field by field in this order: new ones come last, but
/// before the one that may be left out.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct SweepReport {
    /// Number of the wave.
    pub wave: u32,
    /// Phase the wave was asked for in.
    pub phase: Phase,
    /// ‖R_free‖/max(‖reactions‖, ‖external‖) with the wave's stresses.
    pub residual: f64,
    /// ‖du‖/‖Δu‖ of the correction that led to the wave; 1 for the predictor.
    pub correction: f64,
    /// Number of points that re-based their friction history.
    pub rebased: usize,
    /// Number of tangents that were blended towards the elastic ones to compute that correction.
    pub safeguarded: usize,
    /// Relative residual of the linear solve of that correction.
    pub linear_residual: f64,
    /// Number of points that found no lasting equilibrium.
    #[serde(default)]
    pub provisional: usize,
    /// ‖∫(grad u − v)‖/‖∫grad u‖ of the step, where there is a second gradient: it must fall below
    /// the force tolerance too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mismatch: Option<f64>,
}

/// How well a step was solved.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub enum Acceptance {
    /// Both tolerances are met.
    Tolerance,
    /// All sweeps were used up; the best iterate is within the loose tolerance only. To be shown
    /// to the user.
    LooselyAccepted {
        /// Its force residual.
        residual: f64,
    },
}

/// A solved step.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub struct StepOutcome<const D: usize> {
    /// The state to commit.
    pub state: MacroState<D>,
    /// Wave whose end states belong to it and are to be committed with it.
    pub wave: u32,
    /// How well it was solved.
    pub accepted: Acceptance,
    /// Force residual of the state.
    pub residual: f64,
    /// Work of the stresses on the strains of the step, ∫σ:dε over the body by the trapezoidal rule, positive when the
    /// body is deformed by its surroundings.
    pub work: f64,
    /// Work of the unbalanced forces on the way from one end state to the next in the path phase and the overdamped
    /// motion: ½(R_k + R_{k+1})·(x_k − x_{k+1}) added up.
    pub released: f64,
    /// Every sweep, in order.
    pub sweeps: Vec<SweepReport>,
    /// The part of `released` that the overdamped motion did: what the stabilisation of the step took out of the body.
    #[serde(default)]
    pub damped: f64,
}

/// A step that could not be solved. The caller cuts the step, from the same committed state.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub struct StepFailure {
    /// Why.
    pub reason: FailureReason,
    /// Elements that carry most of the residual of the best iterate, largest first.
    pub worst_elements: Vec<ElementShare>,
    /// Every sweep, in order.
    pub sweeps: Vec<SweepReport>,
}

impl std::fmt::Display for StepFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.reason)?;
        for (number, worst) in self.worst_elements.iter().take(3).enumerate() {
            let lead = if number == 0 {
                "; the residual sits in"
            } else {
                ","
            };
            write!(
                f,
                "{lead} e{} ({:.0} %)",
                worst.element,
                100.0 * worst.share
            )?;
        }
        Ok(())
    }
}

/// Why a step failed.
#[derive(Error, Serialize, Deserialize, Clone, PartialEq, Debug)]
pub enum FailureReason {
    /// All sweeps were used up.
    #[error(
        "solve the step: after {sweeps} sweeps the best residual is {residual:.2e}, the tolerance {tolerance:.1e}"
    )]
    NotConverged {
        /// Number of sweeps.
        sweeps: usize,
        /// Best force residual.
        residual: f64,
        /// Force tolerance.
        tolerance: f64,
    },
    /// The forces balance, or nearly so, but some points found no lasting equilibrium.
    #[error(
        "solve the step: after {sweeps} sweeps (residual {residual:.2e}) {} Gauss points have no equilibrium of their own, the first is point {}",
        points.len(),
        points.first().map_or(0, |point| point.0)
    )]
    Provisional {
        /// Number of sweeps.
        sweeps: usize,
        /// Force residual with what they answered.
        residual: f64,
        /// The points.
        points: Vec<GaussPointId>,
    },
    /// The forces balance, or nearly so, but what controls the step is not where it should be.
    #[error(
        "solve the step: after {sweeps} sweeps (residual {residual:.2e}) what controls the step is off by {miss:.1e} of the step"
    )]
    OffPath {
        /// Number of sweeps.
        sweeps: usize,
        /// Best force residual.
        residual: f64,
        /// |g* − g|/|g* − g_n| of the measure g that is followed.
        miss: f64,
    },
    /// The load that adapts does not move what is followed.
    #[error("solve the step: load {load} has no effect on what controls the step")]
    NoControl {
        /// The load.
        load: usize,
    },
    /// A correction folded an element.
    #[error("solve the step: a correction inverts element e{element} at its Gauss point {point}")]
    ElementInverted {
        /// The element.
        element: usize,
        /// The local Gauss point.
        point: usize,
    },
    /// The stiffness is singular, even with elastic tangents.
    #[error(
        "solve the step: nothing holds node {node} in component {component} (the stiffness is singular)"
    )]
    Singular {
        /// Node of the equation that moves freely.
        node: usize,
        /// Its component.
        component: usize,
        /// Estimate of the condition number.
        amplification: f64,
    },
    /// The equations of second gradient are singular, even with elastic tangents.
    #[error(
        "solve the step: nothing determines {unknown} (the stiffness is singular); where too much is held of u and v, leave a boundary free of double traction"
    )]
    SingularField {
        /// The unknown, as `v12 of node 5`.
        unknown: String,
        /// Estimate of the condition number.
        amplification: f64,
    },
    /// The linear solver failed otherwise.
    #[error("solve the step: {message}")]
    LinearSolver {
        /// What it said.
        message: String,
    },
    /// Constitutive evaluations failed.
    #[error("solve the step: {} Gauss points could not be evaluated, the first (point {}): {}",
        points.len(),
        points.first().map_or(0, |(point, _)| point.0),
        points.first().map_or("no reason given", |(_, reason)| reason.as_str()))]
    PointsFailed {
        /// The points and their reasons.
        points: Vec<(GaussPointId, String)>,
    },
    /// The caller handed in a wrong number of answers.
    #[error("solve the step: {found} constitutive answers were given for {expected} Gauss points")]
    WrongResponseCount {
        /// Number of Gauss points.
        expected: usize,
        /// Number of answers.
        found: usize,
    },
    /// A constitutive answer is NaN or infinite.
    #[error("solve the step: the answer of Gauss point {} is not a finite number", point.0)]
    NonFiniteResponse {
        /// The first such point.
        point: GaussPointId,
    },
}
