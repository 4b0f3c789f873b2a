//! Lines of two and three nodes: the edges of linear and of quadratic elements.

use super::FacetPoint;
use super::quadrature::{GaussOrder, gauss};

/// Linear line on s ∈ [−1, 1]; nodes: first end, second end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Line2;

impl Line2 {
    /// N(s) at (first end, second end).
    pub fn shape(s: f64) -> [f64; 2] {
        [0.5 * (1.0 - s), 0.5 * (1.0 + s)]
    }

    /// Two-point rule: exact for N on a straight edge whose load varies linearly.
    pub fn quadrature() -> Vec<FacetPoint> {
        gauss(GaussOrder::Two)
            .into_iter()
            .map(|(s, weight)| FacetPoint {
                weight,
                shape: Self::shape(s).to_vec(),
                gradients: vec![vec![-0.5, 0.5]],
            })
            .collect()
    }
}

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
