//! One pair of near grains, as everything outside the inner loop sees it.

use crate::{contact::Status, tensor::Vector};

/// A pair of near grains, its history and its present force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub i: u32,
    pub j: u32,
    /// H·shift.
    pub(super) image: Vector<2>,
    /// Branch vector in the reference state.
    pub(super) branch0: Vector<2>,
    /// Overlap in the reference state; < 0 for a gap.
    pub(super) overlap0: f64,
    /// Tangential force in the reference state.
    pub(super) tangential0: f64,
    /// kn δ − f_c now; 0 when open.
    pub normal: f64,
    /// Tangential force now, of j on i along (−n_y, n_x).
    pub tangential: f64,
    /// δ now; 0 when open.
    pub overlap: f64,
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
