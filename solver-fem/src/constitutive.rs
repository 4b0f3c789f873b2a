//! What passes between the macro scale and whoever evaluates the constitutive law.

use serde::{Deserialize, Serialize};

use crate::tensor::{Tensor2, Tensor4};

/// A Gauss point: `element * points_per_element + local`.
#[derive(
    Serialize, Deserialize, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default,
)]
pub struct GaussPointId(
    /// Position in the global order, in which all reductions run.
    pub u32,
);

impl GaussPointId {
    /// The same, as an index into per-point arrays.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Whether the answer depends smoothly on the deformation asked for.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Smoothness {
    /// A fixed starting state was carried to the end in one piece.
    #[default]
    Smooth,
    /// The friction history was re-based on the way, or a path-following solver took over: the
    /// tangent describes only the last piece and is of little worth.
    Rebased,
    /// No lasting equilibrium was found there. Stress and state serve to go on from; a step does not end with them.
    Provisional,
}

/// The answer of a Gauss point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ConstitutiveResponse<const D: usize> {
    /// Cauchy stress at the end of the increment, tension positive, in the fixed frame.
    pub stress: Tensor2<D>,
    /// Algorithmic tangent over the increment asked for: dσ_ij/dL_kl for F → (I + L)·F, all D²
    /// columns, rotation included.
    pub tangent: Tensor4<D>,
    /// Elastic tangent of the end state, in the same form.
    pub elastic_tangent: Tensor4<D>,
    /// Whether [`tangent`](Self::tangent) can be trusted.
    pub smooth: Smoothness,
}

/// The state an increment starts from.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug)]
pub enum Base {
    /// The committed state of the load step before.
    Committed,
    /// The end state of an earlier wave of this step.
    Wave(u32),
}

/// A wave of constitutive evaluations: one for every Gauss point, independent of each other.
#[derive(Clone, PartialEq, Debug)]
pub struct Wave<const D: usize> {
    /// Number of the wave within the step attempt, from 0.
    pub index: u32,
    /// The state every point starts from; `points` are relative to it.
    pub base: Base,
    /// Wave whose end configuration is a good first guess of the answer (warm start); it changes
    /// the work, not the problem. `None`: start from the base itself.
    pub start: Option<u32>,
    /// Deformation gradient dx/dx_base of every point, in Gauss point order.
    pub points: Vec<(GaussPointId, Tensor2<D>)>,
}
