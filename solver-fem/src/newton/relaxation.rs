//! The overdamped motion that takes over where Newton sweeps get no further.
//!
//! At a local loss of equilibrium there is no static solution nearby: the body moves until it finds another one. How it
//! gets there is dynamics; of that only the damped end matters here. So the body follows
//! c E : dε/dτ = −(internal − external forces), a viscous stress in proportion to the initial elastic stiffness E, one
//! linearly implicit step of the pseudo-time τ for each sweep:
//!
//!   (K + c K_E) du = −R,   every Gauss point going on from its end state of the sweep before.
//!
//! There is no viscous force left at the end: the step ends where R vanishes, in static equilibrium. c follows the
//! residual (switched evolution relaxation: Mulder and van Leer 1985; Kelley and Keyes 1998), so that the motion turns
//! into Newton's method as it comes to rest. The strain of a sweep is bounded, since a REV follows small increments only.
//!
//! The work of the unbalanced forces on the way is reported with the step. It holds what a real body would have turned
//! into motion and noise, and also what the step, applied at once, overshoots before the material yields: it falls
//! with the step size towards the former.

use serde::{Deserialize, Serialize};

use crate::kinematics::point_geometry;
use crate::problem::Problem;

/// How the overdamped motion is followed.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Relaxation {
    /// Sweeps of it before the step is given up; 0: none. A REV that gives way under its neighbours takes up to about 80
    /// to come to rest again, a band that forms at once up to 130.
    pub sweeps: usize,
    /// Largest component of the strain of a sweep. 1e-3: up to there return mapping is right to 0.5 %.
    pub largest_strain: f64,
    /// Smallest viscosity c. 0.02.
    pub least_viscosity: f64,
}

impl Default for Relaxation {
    fn default() -> Self {
        Relaxation {
            sweeps: 300,
            largest_strain: 1e-3,
            least_viscosity: 0.02,
        }
    }
}

impl Relaxation {
    /// The motion begins as slow as an elastic body's.
    pub(super) const FIRST_VISCOSITY: f64 = 1.0;

    /// c for the next sweep: in proportion to the residual, by a factor of two at most.
    pub(super) fn next_viscosity(&self, viscosity: f64, trend: f64) -> f64 {
        let least = self.least_viscosity.clamp(0.0, 1.0);
        (viscosity * trend.clamp(0.5, 2.0)).clamp(least, 1.0)
    }
}

/// C + c E for every point, from guarded tangents C. A point whose `own` elastic tangent is zero (a void) gets E whole: under
/// less, the stress around it would close it in one sweep.
pub(super) fn add_viscosity<const D: usize>(
    tangents: &mut [f64],
    own: &[f64],
    elastic: &[f64],
    viscosity: f64,
) {
    let size = D * D * D * D;
    let points = tangents.chunks_mut(size).zip(elastic.chunks(size));
    for ((tangent, elastic), own) in points.zip(own.chunks(size)) {
        let void = own.iter().all(|&c| c == 0.0);
        let share = if void { 1.0 } else { viscosity };
        for (c, e) in tangent.iter_mut().zip(elastic) {
            *c += share * e;
        }
    }
}

/// Largest component of the symmetric gradient of `du` at any Gauss point of the configuration `coordinates`.
pub(super) fn largest_strain<const D: usize>(
    problem: &Problem<D>,
    coordinates: &[f64],
    du: &[f64],
) -> f64 {
    let mut largest: f64 = 0.0;
    for id in problem.gauss_points() {
        let (element, point) = problem.locate(id);
        let nodes = problem.mesh().element(element);
        let reference = &problem.reference_points()[point];
        let Some(geometry) = point_geometry(reference, nodes, coordinates) else {
            continue;
        };
        for i in 0..D {
            for j in 0..=i {
                let strain: f64 = nodes
                    .iter()
                    .zip(&geometry.gradients)
                    .map(|(&n, slope)| 0.5 * (du[n * D + i] * slope[j] + du[n * D + j] * slope[i]))
                    .sum();
                largest = largest.max(strain.abs());
            }
        }
    }
    largest
}
