//! What a REV is asked with and what it answers.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    RevState,
    tensor::{Tensor2, Tensor4, apply, rotated2, rotated4, rotation},
};

/// A configuration near the solution, from an earlier solve from the same base: relaxation
/// starts from there instead of from the affine motion. As a guess it changes the cost, not the problem; see [`Trust`].
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// End state of the earlier solve.
    pub state: &'a RevState<2, 1>,
    /// Rotations of the grains from the base to that end state, radians.
    pub rotations: &'a [f64],
    /// What the earlier solve is good for.
    pub trust: Trust,
}

/// What an earlier answer from the same base is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trust {
    /// A guess at the configuration. Friction counts from the base: the answer does not depend on the guess, but for its
    /// cost.
    #[default]
    Guess,
    /// The state that friction counts from: the answer is that of the remaining deformation, its tangent too.
    Reference,
}

impl Trust {
    /// What an answer is good for as a start. One by return mapping from the base is a guess. So is one of a cold
    /// solve, the first of an iteration, whose F is itself a guess: friction mobilised by going too far stays (1 % of
    /// the force at 0.6 % strain). Every other depends on its way, and is to be gone on from.
    pub fn in_answer(report: &Report, started: Started) -> Self {
        match (report.method, started) {
            (Method::ReturnMapping, _) | (_, Started::Cold) => Self::Guess,
            (Method::Rebased | Method::Path | Method::Unsettled, Started::Warm) => Self::Reference,
        }
    }
}

/// Whether a solve had a [`Start`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Started {
    /// No: its F may be far from where an iteration ends.
    Cold,
    /// Yes.
    Warm,
}

/// Which solver found the equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Friction by return mapping from the base state.
    ReturnMapping,
    /// The same, the reference state re-based on the way because it did not settle, or gone on from an earlier answer
    /// that was ([`Trust::Reference`]).
    Rebased,
    /// Friction integrated along a slow ramp.
    Path,
    /// None: the path solver's cap was reached first, see [`crate::Unsettled`].
    Unsettled,
}

/// What the solve reached and what it took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The solver that succeeded.
    pub method: Method,
    /// Cycles of all solvers tried.
    pub cycles: u32,
    /// Largest unbalanced force or moment/radius over the mean contact force.
    pub residual: f64,
    /// Change of the stress over the last check interval, over the mean stress.
    pub drift: f64,
    /// Error of the stress-controlled components over the stress scale; 0 without.
    pub stress_error: f64,
    /// Antisymmetric part of the Love–Weber stress over the mean stress.
    pub asymmetry: f64,
    /// Closed contacts.
    pub contacts: u32,
    /// Contacts at the friction bound over the increment.
    pub sliding: u32,
    /// Whether a network was too weak to linearise, so that the affine operator stands in.
    pub affine_tangent: bool,
}

/// The answer of a REV.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The end state, ready to be the next base.
    pub state: RevState<2, 1>,
    /// Rotations of the grains over the increment, radians: with `state`, a [`Start`].
    pub rotations: Vec<f64>,
    /// F as asked for, or as found under stress control: from the base in [`respond`](crate::respond()), total in
    /// [`crate::drive`].
    pub gradient: Tensor2<2>,
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
    /// ∂σ_ij/∂L_kl of the whole increment (statuses of the return mapping from the base).
    pub tangent: Tensor4<2>,
    /// ∂σ_ij/∂L_kl of the end state with all contacts sticking; the affine operator when only the
    /// algorithmic tangent was asked for.
    pub elastic_tangent: Tensor4<2>,
    /// Figures.
    pub report: Report,
}

impl Response {
    /// Turns all of it by `angle` (radians, counter-clockwise) as a rigid body. Tangential forces are objective by
    /// themselves.
    pub(crate) fn turn(&mut self, angle: f64) {
        let r = rotation(angle);
        self.state.cell = self.state.cell.deformed(&r);
        for x in &mut self.state.positions {
            *x = apply(&r, x);
        }
        for theta in &mut self.rotations {
            *theta += angle;
        }
        self.stress = rotated2(&r, &self.stress);
        let shear = 0.5 * (self.stress[0][1] + self.stress[1][0]);
        self.stress[0][1] = shear;
        self.stress[1][0] = shear;
        self.tangent = rotated4(&r, &self.tangent);
        self.elastic_tangent = rotated4(&r, &self.elastic_tangent);
    }
}

/// Why a REV has no answer.
#[derive(Clone, Debug, Error, PartialEq, Serialize, Deserialize)]
pub enum EquilibriumError {
    /// The gradient asked for is not a motion of a solid.
    #[error(
        "deformation gradient {gradient:?} is not finite or turns the cell inside out (det F = {determinant:e})"
    )]
    NotAMotion {
        /// F as asked for.
        gradient: Tensor2<2>,
        /// det F.
        determinant: f64,
    },
    /// The state itself is unusable.
    #[error("invalid REV state: {0}")]
    InvalidState(String),
    /// Images of a grain would meet.
    #[error(
        "cell height {height:.4} fell below two cut-off lengths ({needed:.4}) after {cycles} cycles: the REV is too small for this deformation"
    )]
    CellTooSmall {
        /// The smallest distance between opposite faces.
        height: f64,
        /// Two cut-off lengths.
        needed: f64,
        /// Cycles done.
        cycles: u32,
    },
    /// No grain touches another, and [`crate::LossOfConfinement`] does not allow it.
    #[error(
        "all contacts lost after {cycles} cycles: nothing confines the grains at det F = {volume_change:.6} (base: {contacts} contacts); a void is an answer under `loss_of_confinement: allow` only"
    )]
    ConfinementLost {
        /// det F: the volume over that of the base.
        volume_change: f64,
        /// Closed contacts of the base.
        contacts: usize,
        /// Cycles done.
        cycles: u32,
    },
    /// Every solver ran into its cap.
    #[error(
        "no equilibrium within {cycles} cycles: residual {residual:.2e} (asked {tolerance:.0e}), drift {drift:.2e}, stress error {stress_error:.2e}"
    )]
    NotReached {
        /// Cycles of all solvers.
        cycles: u32,
        /// Residual reached.
        residual: f64,
        /// Residual asked for.
        tolerance: f64,
        /// Stress drift.
        drift: f64,
        /// Error of the stress-controlled components.
        stress_error: f64,
    },
}
