//! Elements: shape functions, quadrature and facets on the reference element.
//!
//! A new element (Q4, T6, hexahedra; a second-gradient field carried by corner nodes) is a new
//! implementation of [`Element`]; nothing else in the crate knows a node count or a rule.

mod line;
mod q8;
pub mod quadrature;

pub use line::Line3;
pub use q8::{Q8, Q8Rule};
pub use quadrature::QuadraturePoint;

/// Reference element with the quadrature its displacement field uses.
pub trait Element<const D: usize>: std::fmt::Debug + Send + Sync {
    /// Name as an engineer writes it, e.g. `Q8`.
    fn name(&self) -> &'static str;

    /// Number of displacement nodes.
    fn node_count(&self) -> usize;

    /// Shape function values N_a(ξ) at a reference point; `values` has [`node_count`](Self::node_count) entries.
    fn shape(&self, xi: &[f64; D], values: &mut [f64]);

    /// Derivatives ∂N_a/∂ξ_j in the same order.
    fn shape_gradients(&self, xi: &[f64; D], gradients: &mut [[f64; D]]);

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
