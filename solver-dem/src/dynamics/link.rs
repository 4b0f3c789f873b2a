//! One pair of near grains, as everything outside the inner loop sees it.

use crate::{contact::Status, tensor::Vector};

/// A pair of near grains, its history and its present force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub i: u32,
    pub j: u32,
    /// H·shift.
    pub(super) image: Vector<2>,
    pub(super) history: History,
    /// kn δ − f_c now; 0 when open.
    pub normal: f64,
    /// Tangential force now, of j on i along (−n_y, n_x).
    pub tangential: f64,
    /// δ now; 0 when open.
    pub overlap: f64,
}

/// What a pair remembers of its reference state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    /// Direction from i to j.
    pub normal0: Vector<2>,
    /// Overlap; < 0 for a gap, −∞ when nothing is remembered.
    pub overlap0: f64,
    /// Tangential force.
    pub tangential0: f64,
}

impl History {
    /// A pair that was never looked at: should it close, it closes without slip.
    pub const NONE: Self = Self {
        normal0: [1.0, 0.0],
        overlap0: f64::NEG_INFINITY,
        tangential0: 0.0,
    };

    /// The state of a pair with the branch vector `branch0` from i to j.
    pub fn at(branch0: &Vector<2>, overlap0: f64, tangential0: f64) -> Self {
        let inverse = 1.0 / length(branch0);
        Self {
            normal0: [branch0[0] * inverse, branch0[1] * inverse],
            overlap0,
            tangential0,
        }
    }
}

impl Link {
    /// Whether the grains touch, for the forces last computed.
    pub fn is_closed(&self) -> bool {
        self.overlap > 0.0
    }
}

/// The geometry of a closed contact, as the linearisation needs it.
pub(crate) struct Geometry {
    pub branch: Vector<2>,
    pub distance: f64,
    pub n: Vector<2>,
    /// R − δ/2 of both grains.
    pub arms: [f64; 2],
    /// Rotation of the branch minus that of each grain since the reference state.
    pub turns: [f64; 2],
    /// u_t and the factor by which a contact made since the reference state counts it.
    pub slip: f64,
    pub share: f64,
    /// d(share)/dδ.
    pub share_rate: f64,
    pub status: Status,
}

/// The part of the relative displacement that happened while the contact was closed.
pub(super) fn share_of(overlap: f64, overlap0: f64) -> f64 {
    if overlap0 >= 0.0 {
        1.0
    } else {
        overlap / (overlap - overlap0)
    }
}

/// |v|.
#[inline]
pub(super) fn length(v: &Vector<2>) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}
