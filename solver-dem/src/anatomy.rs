//! The anatomy of a REV: every contact with its force, every grain with what it carries, and how
//! both are distributed over directions.

mod fourier;
mod statistics;

use serde::Serialize;

pub use fourier::{Anisotropy, Harmonic};
pub use statistics::{ForceMoments, Statistics, stress_force_fabric};

use crate::{
    EquilibriumError, Rev,
    dynamics::{Assembly, Friction, Record},
    respond::check,
    tensor::{Tensor2, Vector, identity},
};

/// How close to the friction bound a contact counts as sliding: |f_t| ≥ (1 − 1e-9) μ kn δ. The
/// force was cut to the bound of an overlap that the stored positions give back to rounding.
const AT_THE_BOUND: f64 = 1.0 - 1e-9;

/// A closed contact and the force it carries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ContactForce {
    /// The grain with the lower number.
    pub i: u32,
    /// The grain with the higher number.
    pub j: u32,
    /// l: from the centre of `i` to that of the image of `j` it touches, in length units.
    pub branch: Vector<2>,
    /// n: the unit vector along `branch`.
    pub normal: Vector<2>,
    /// δ > 0, in length units.
    pub overlap: f64,
    /// f_n = kn δ − f_c, repulsion positive; < 0 in a contact that cohesion holds under tension.
    pub normal_force: f64,
    /// f_t: the force of `j` on `i` along (−n_y, n_x); the same seen from `j`.
    pub tangential_force: f64,
    /// |f_t|/(μ kn δ), from 0 to 1; 1 without friction.
    pub mobilised: f64,
    /// Whether friction is fully mobilised.
    pub sliding: bool,
}

/// What a grain carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct GrainLoad {
    /// Number of closed contacts.
    pub contacts: u32,
    /// Mean pressure, positive in compression: Σ f_n (R − δ/2)/(2 π R²) over its contacts.
    pub pressure: f64,
}

impl GrainLoad {
    /// Whether it has fewer contacts than a grain needs to carry load.
    pub fn is_rattler(&self) -> bool {
        self.contacts < 2
    }
}

/// The forces in a REV at its stored state.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Anatomy {
    /// Closed contacts, sorted by (i, j).
    pub contacts: Vec<ContactForce>,
    /// By grain number.
    pub grains: Vec<GrainLoad>,
    /// Cauchy stress (Love–Weber, symmetrised), tension positive.
    pub stress: Tensor2<2>,
    /// Largest unbalanced force or moment/radius of a grain over the mean contact force; 0 without contacts.
    pub residual: f64,
}

/// The forces in `rev` at its stored positions, nothing moved: overlaps follow from the positions, tangential forces are
/// the stored ones, cut to the friction bound.
///
/// # Errors
/// [`EquilibriumError`] for a state that is no REV: a number that is not finite, a cell too small for its grains.
pub fn anatomy(rev: &Rev<2, 1>) -> Result<Anatomy, EquilibriumError> {
    check(rev, &identity())?;
    let state = &rev.state;
    let unturned = vec![0.0; state.positions.len()];
    let mut assembly = Assembly::new(rev, state.cell, state.positions.clone(), unturned)
        .ok_or_else(|| crate::respond::too_small(rev, &state.cell, 0))?;
    assembly.compute_forces(Friction::ReturnMapping, Record::All);
    let contacts: Vec<ContactForce> = assembly
        .closed()
        .map(|link| {
            let geometry = assembly.geometry(&link);
            let bound = rev.law.friction * rev.law.normal_stiffness * link.overlap;
            let mobilised = if bound > 0.0 {
                link.tangential.abs() / bound
            } else {
                1.0
            };
            ContactForce {
                i: link.i,
                j: link.j,
                branch: geometry.branch,
                normal: geometry.n,
                overlap: link.overlap,
                normal_force: link.normal,
                tangential_force: link.tangential,
                mobilised,
                sliding: mobilised >= AT_THE_BOUND,
            }
        })
        .collect();
    let mut grains = vec![GrainLoad::default(); state.positions.len()];
    for contact in &contacts {
        for grain in [contact.i as usize, contact.j as usize] {
            let radius = rev.grains.radii[grain];
            let arm = radius - 0.5 * contact.overlap;
            grains[grain].contacts += 1;
            grains[grain].pressure +=
                contact.normal_force * arm / (2.0 * std::f64::consts::PI * radius * radius);
        }
    }
    Ok(Anatomy {
        contacts,
        grains,
        stress: assembly.stress(),
        residual: assembly.residual(),
    })
}
