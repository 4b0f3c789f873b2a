//! Elements: shape functions, quadrature and facets on the reference element.
//!
//! A new element (hexahedra, say) is a new implementation of [`Element`]; nothing else in the crate knows a node count
//! or a rule. The corner nodes of an element come first, so that a field carried by corners alone knows its nodes.
//!
//! Which plane element for what:
//!
//! | element | points | for |
//! |---|---|---|
//! | [`Q8`], 2×2 | 4 | the standard: neither locks nor is stiff in bending; cheap where every point is a REV |
//! | [`Q8`], 3×3 | 9 | no spurious mode at all; 2.25 times the REVs, stiffer where volume is kept |
//! | [`T6`], 3 points | 3 | shapes that quadrilaterals do not fill; as good as Q8 per unknown |
//! | [`T6`], 6 points | 6 | curved or much distorted triangles |
//! | [`Q4`] | 4 | comparisons with linear meshes; **locks**, see there |

mod kind;
mod line;
mod q4;
mod q8;
pub mod quadrature;
mod t6;

pub use kind::PlaneElement;
pub use line::{Line2, Line3};
pub use q4::Q4;
pub use q8::{Q8, Q8Rule};
pub use quadrature::QuadraturePoint;
pub use t6::{T6, T6Rule};

use crate::second_gradient::CornerPoint;

/// Reference element with the quadrature its displacement field uses.
pub trait Element<const D: usize>: std::fmt::Debug + Send + Sync {
    /// Name as an engineer writes it, e.g. `Q8`.
    fn name(&self) -> &'static str;

    /// Number of displacement nodes.
    fn node_count(&self) -> usize;

    /// Number of corner nodes; they are the first nodes of the element.
    fn corner_count(&self) -> usize;

    /// Reference coordinates of the nodes, in their order.
    fn node_positions(&self) -> &'static [[f64; D]];

    /// Shape function values N_a(ξ) at a reference point; `values` has [`node_count`](Self::node_count) entries.
    fn shape(&self, xi: &[f64; D], values: &mut [f64]);

    /// Derivatives ∂N_a/∂ξ_j in the same order.
    fn shape_gradients(&self, xi: &[f64; D], gradients: &mut [[f64; D]]);

    /// Shape functions of a field carried by the corner nodes (the first nodes of the element) at a
    /// reference point: what v of [second gradient](crate::second_gradient) lives in. `None` for an
    /// element that second gradient was not shown to work on.
    fn corner_field(&self, _xi: &[f64; D]) -> Option<CornerPoint<D>> {
        None
    }

    /// Points and weights of the volume rule; their order defines the local Gauss point number.
    fn quadrature(&self) -> Vec<QuadraturePoint<D>>;

    /// Number of facets (edges in 2D, faces in 3D).
    fn facet_count(&self) -> usize;

    /// Local nodes of a facet, ordered so that the area vector of [`FacetPoint`] points outward.
    fn facet_nodes(&self, facet: usize) -> &'static [usize];

    /// Integration points of a facet, the same for every facet.
    fn facet_quadrature(&self) -> Vec<FacetPoint>;

    /// Matrix (nodes × Gauss points, row by row) that carries Gauss point values to the nodes of
    /// the element, for output only.
    fn extrapolation(&self) -> Vec<f64>;
}

/// One integration point of a facet.
#[derive(Clone, PartialEq, Debug)]
pub struct FacetPoint {
    /// Weight on the reference facet.
    pub weight: f64,
    /// Shape function values at the facet's nodes.
    pub shape: Vec<f64>,
    /// Shape function derivatives along each of the D−1 reference directions: `[direction][node]`.
    pub gradients: Vec<Vec<f64>>,
}
