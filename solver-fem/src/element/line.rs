//! Three-node line: the edge of quadratic elements.

use super::FacetPoint;
use super::quadrature::{GaussOrder, gauss};

/// Quadratic line on s ∈ [−1, 1]; nodes: first end, second end, middle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Line3;

impl Line3 {
    /// N(s) at (first end, second end, middle).
    pub fn shape(s: f64) -> [f64; 3] {
        [0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s]
    }

    /// dN/ds in the same order.
    pub fn gradient(s: f64) -> [f64; 3] {
        [s - 0.5, s + 0.5, -2.0 * s]
    }

    /// Three-point rule: exact for N·dx/ds on curved edges (degree 3) and for the arc length
    /// element to the accuracy of the geometry.
    pub fn quadrature() -> Vec<FacetPoint> {
        gauss(GaussOrder::Three)
            .into_iter()
            .map(|(s, weight)| FacetPoint {
                weight,
                shape: Self::shape(s).to_vec(),
                gradients: vec![Self::gradient(s).to_vec()],
            })
            .collect()
    }
}
