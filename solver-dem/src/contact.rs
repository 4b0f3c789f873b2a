//! The contact law.
//!
//! Normal: f_n = kn δ − f_c while the overlap δ > 0. Tangential: the trial force
//! f_t = f_t0 + kt u_t, returned to |f_t| ≤ μ kn δ. The *elastic* part of the normal force bounds
//! friction, so that cohesion does not raise the strength of a contact twice (the law of the
//! Grenoble FEM×DEM work; Nguyen, Combe, Caillerie, Desrues 2014).

use serde::{Deserialize, Serialize};

/// Parameters of all contacts of a REV, in force and length units (per unit thickness in 2D).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactLaw {
    /// kn: normal stiffness, force per overlap; > 0.
    pub normal_stiffness: f64,
    /// kt: tangential stiffness, force per relative tangential displacement; ≥ 0.
    pub tangential_stiffness: f64,
    /// μ: friction coefficient; ≥ 0.
    pub friction: f64,
    /// f_c: attraction that acts as long as a contact is closed; ≥ 0.
    pub cohesion: f64,
}

/// How a closed contact answers a further small displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// |f_t| < μ kn δ: the tangential force follows the displacement.
    Sticking,
    /// |f_t| = μ kn δ: the tangential force follows the overlap.
    Sliding,
}

impl ContactLaw {
    /// Returns the trial tangential force to the friction bound of an overlap δ > 0.
    #[inline]
    pub fn return_to_bound(&self, trial: f64, overlap: f64) -> (f64, Status) {
        let bound = self.friction * self.normal_stiffness * overlap;
        if trial > bound {
            (bound, Status::Sliding)
        } else if trial < -bound {
            (-bound, Status::Sliding)
        } else {
            (trial, Status::Sticking)
        }
    }

    /// The largest stiffness of a contact, which sets the time step.
    pub fn largest_stiffness(&self) -> f64 {
        self.normal_stiffness.max(self.tangential_stiffness)
    }
}
