//! A step that follows a measure of the deformation, while one load adapts.
//!
//! Where the body softens, the load that drives it has no value to be given beforehand: it falls while the body goes on
//! deforming. So the load λ becomes an unknown of the step, and a scalar equation g(x) = g* closes the system. A Newton
//! correction is
//!
//!   du = du_R + dλ du_λ,   K du_R = −R,   K du_λ = −∂R/∂λ,   dλ = (g* − g − c·du_R)/(c·du_λ),   c = ∂g/∂x,
//!
//! two solves with the same factors (Batoz and Dhatt 1979), so that K is never bordered. It stays regular where K alone
//! would ask for a load that the body cannot bear; exactly at the limit point K is singular, and no step ends exactly there.
//!
//! Two measures: the expansion V/V0 − 1 of a cavity, and the length ½‖x − x_n‖² of the step (Ramm 1981), whose first
//! correction goes on in the direction of the step before.

use serde::{Deserialize, Serialize};

use super::{FailureReason, MacroState};
use crate::boundary::CavityProblem;
use crate::problem::Problem;
use crate::tensor::norm;

/// What a step follows in place of a load, which becomes an unknown.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub struct Control {
    /// The load that adapts.
    pub load: usize,
    /// What is followed.
    pub path: Path,
}

/// What a controlled step follows.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub enum Path {
    /// The volume of a cavity.
    Expansion {
        /// The boundary that encloses it.
        boundary: String,
        /// V/V0 − 1 at the end of the step.
        to: f64,
    },
    /// The length of the step.
    ArcLength {
        /// Root mean square of the nodes' displacements over the step.
        length: f64,
        /// Sign of the load's change; `None` goes on in the direction of the step before.
        sense: Option<f64>,
    },
}

/// g* − g and ∂g/∂x at some positions.
struct Gap {
    gap: f64,
    gradient: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Root mean square over the nodes.
fn mean_length<const D: usize>(displacement: &[f64]) -> f64 {
    norm(displacement) / ((displacement.len() / D) as f64).sqrt()
}

impl Control {
    /// Whether the measure exists.
    ///
    /// # Errors
    /// A cavity without a volume.
    pub fn check<const D: usize>(&self, problem: &Problem<D>) -> Result<(), CavityProblem> {
        match &self.path {
            Path::Expansion { boundary, .. } => problem.cavity(boundary).map(|_| ()),
            Path::ArcLength { .. } => Ok(()),
        }
    }

    fn gap<const D: usize>(
        &self,
        problem: &Problem<D>,
        committed: &[f64],
        coordinates: &[f64],
    ) -> Gap {
        match &self.path {
            // Checked when the step began.
            Path::Expansion { boundary, to } => problem.cavity(boundary).map_or_else(
                |_| Gap {
                    gap: 0.0,
                    gradient: vec![0.0; coordinates.len()],
                },
                |cavity| Gap {
                    gap: to - cavity.expansion(coordinates),
                    gradient: cavity.expansion_gradient(coordinates),
                },
            ),
            Path::ArcLength { length, .. } => {
                let nodes = (coordinates.len() / D) as f64;
                let moved = coordinates.iter().zip(committed).map(|(x, from)| x - from);
                let moved: Vec<f64> = moved.collect();
                Gap {
                    gap: 0.5 * (length * length - dot(&moved, &moved) / nodes),
                    gradient: moved.iter().map(|u| u / nodes).collect(),
                }
            }
        }
    }

    /// How far off the measure is, in parts of the step: |g* − g|/|g* − g_n|.
    pub(super) fn miss<const D: usize>(
        &self,
        problem: &Problem<D>,
        committed: &[f64],
        coordinates: &[f64],
    ) -> f64 {
        /// An expansion that is none: where the volume is held.
        const NO_EXPANSION: f64 = 1e-9;

        let gap = self.gap(problem, committed, coordinates).gap.abs();
        match &self.path {
            Path::Expansion { .. } => {
                let step = self.gap(problem, committed, committed).gap.abs();
                gap / step.max(NO_EXPANSION)
            }
            Path::ArcLength { length, .. } => gap / (length * length),
        }
    }

    /// dλ for the first correction of a step from `state`, `du` being the one at a fixed load and `slope` its change with
    /// the load.
    pub(super) fn first_change<const D: usize>(
        &self,
        problem: &Problem<D>,
        state: &MacroState<D>,
        du: &[f64],
        slope: &[f64],
    ) -> Result<f64, FailureReason> {
        match self.path {
            Path::Expansion { .. } => {
                self.change(problem, &state.coordinates, &state.coordinates, du, slope)
            }
            Path::ArcLength { length, sense } => {
                let slope = &slope[..problem.dof_count()];
                let onward = state.increment.as_ref().map(|last| dot(last, slope));
                let along = sense.or(onward).unwrap_or(1.0);
                let change = along.signum() * length / mean_length::<D>(slope);
                self.finite(change)
            }
        }
    }

    /// dλ for a correction at `coordinates`.
    pub(super) fn change<const D: usize>(
        &self,
        problem: &Problem<D>,
        committed: &[f64],
        coordinates: &[f64],
        du: &[f64],
        slope: &[f64],
    ) -> Result<f64, FailureReason> {
        let moving = problem.dof_count();
        let Gap { gap, gradient } = self.gap(problem, committed, &coordinates[..moving]);
        self.finite((gap - dot(&gradient, &du[..moving])) / dot(&gradient, &slope[..moving]))
    }

    fn finite(&self, change: f64) -> Result<f64, FailureReason> {
        if change.is_finite() {
            Ok(change)
        } else {
            Err(FailureReason::NoControl { load: self.load })
        }
    }
}

/// ∂u/∂λ of the prescribed displacements, zero on all others.
pub(super) fn driven<const D: usize>(problem: &Problem<D>, load: usize) -> Vec<f64> {
    let mut driven = vec![0.0; problem.layout().len()];
    for given in &problem.constraints().prescribed {
        driven[given.dof] = given.value.slope(load);
    }
    driven
}

/// ∂f/∂λ of the external forces, which are linear in every load.
pub(super) fn force_slope<const D: usize>(
    problem: &Problem<D>,
    coordinates: &[f64],
    loads: &[f64],
    load: usize,
) -> Vec<f64> {
    let forces = |change: f64| {
        let mut loads = loads.to_vec();
        loads[load] += change;
        let positions = &coordinates[..problem.dof_count()];
        problem
            .external_loads()
            .forces::<D>(problem.initial(), positions, &loads)
    };
    let mut slope = forces(1.0);
    for (after, before) in slope.iter_mut().zip(forces(0.0)) {
        *after -= before;
    }
    slope.resize(problem.layout().len(), 0.0);
    problem.constraints().gather(&mut slope);
    slope
}
