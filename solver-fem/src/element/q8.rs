//! Q8: the eight-node serendipity quadrilateral.

use super::quadrature::{GaussOrder, QuadraturePoint, tensor_product};
use super::{Element, FacetPoint, Line3};
use crate::second_gradient::CornerPoint;

/// Integration rule of a [`Q8`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Q8Rule {
    /// 2×2 points: the standard of this project. One element has one spurious mode, which no mesh
    /// of two or more elements can show.
    #[default]
    Reduced,
    /// 3×3 points.
    Full,
}

impl Q8Rule {
    fn order(self) -> GaussOrder {
        match self {
            Q8Rule::Reduced => GaussOrder::Two,
            Q8Rule::Full => GaussOrder::Three,
        }
    }
}

/// Eight-node serendipity quadrilateral on [−1, 1]².
///
/// Nodes: corners (−1,−1), (1,−1), (1,1), (−1,1), then the middles of the sides 12, 23, 34, 41.
/// Facet f runs from corner f to corner f+1.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Q8 {
    /// The volume rule.
    pub rule: Q8Rule,
}

const NODES: [[f64; 2]; 8] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
];
const CORNERS: [[f64; 2]; 4] = [NODES[0], NODES[1], NODES[2], NODES[3]];
const EDGES: [[usize; 3]; 4] = [[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]];

impl Element<2> for Q8 {
    fn name(&self) -> &'static str {
        "Q8"
    }

    fn node_count(&self) -> usize {
        8
    }

    fn corner_count(&self) -> usize {
        4
    }

    fn node_positions(&self) -> &'static [[f64; 2]] {
        &NODES
    }

    /// Corner: N = ¼(1+ξξₐ)(1+ηηₐ)(ξξₐ+ηηₐ−1); middle: N = ½(1−ξ²)(1+ηηₐ) or ½(1+ξξₐ)(1−η²).
    fn shape(&self, &[x, y]: &[f64; 2], values: &mut [f64]) {
        for (a, [xa, ya]) in CORNERS.into_iter().enumerate() {
            values[a] = 0.25 * (1.0 + x * xa) * (1.0 + y * ya) * (x * xa + y * ya - 1.0);
        }
        values[4] = 0.5 * (1.0 - x * x) * (1.0 - y);
        values[5] = 0.5 * (1.0 + x) * (1.0 - y * y);
        values[6] = 0.5 * (1.0 - x * x) * (1.0 + y);
        values[7] = 0.5 * (1.0 - x) * (1.0 - y * y);
    }

    fn shape_gradients(&self, &[x, y]: &[f64; 2], gradients: &mut [[f64; 2]]) {
        for (a, [xa, ya]) in CORNERS.into_iter().enumerate() {
            gradients[a] = [
                0.25 * xa * (1.0 + y * ya) * (2.0 * x * xa + y * ya),
                0.25 * ya * (1.0 + x * xa) * (2.0 * y * ya + x * xa),
            ];
        }
        gradients[4] = [-x * (1.0 - y), -0.5 * (1.0 - x * x)];
        gradients[5] = [0.5 * (1.0 - y * y), -y * (1.0 + x)];
        gradients[6] = [-x * (1.0 + y), 0.5 * (1.0 - x * x)];
        gradients[7] = [-0.5 * (1.0 - y * y), -y * (1.0 - x)];
    }

    /// Bilinear: M = ¼(1+ξξₐ)(1+ηηₐ).
    fn corner_field(&self, &[x, y]: &[f64; 2]) -> Option<CornerPoint<2>> {
        let corner = |[xa, ya]: [f64; 2]| 0.25 * (1.0 + x * xa) * (1.0 + y * ya);
        let slope = |[xa, ya]: [f64; 2]| [0.25 * xa * (1.0 + y * ya), 0.25 * ya * (1.0 + x * xa)];
        Some(CornerPoint {
            shape: CORNERS.map(corner).to_vec(),
            gradients: CORNERS.map(slope).to_vec(),
        })
    }

    fn quadrature(&self) -> Vec<QuadraturePoint<2>> {
        tensor_product(self.rule.order())
    }

    fn facet_count(&self) -> usize {
        4
    }

    fn facet_nodes(&self, facet: usize) -> &'static [usize] {
        &EDGES[facet]
    }

    fn facet_quadrature(&self) -> Vec<FacetPoint> {
        Line3::quadrature()
    }

    /// Least-squares bilinear field through the Gauss point values. On a symmetric tensor grid
    /// 1, ξ, η, ξη are orthogonal, so each coefficient is a plain quotient of sums.
    fn extrapolation(&self) -> Vec<f64> {
        let basis = |[x, y]: [f64; 2]| [1.0, x, y, x * y];
        let points: Vec<_> = self
            .quadrature()
            .iter()
            .map(|point| basis(point.xi))
            .collect();
        let mut matrix = Vec::with_capacity(8 * points.len());
        for node in NODES.map(basis) {
            for point in &points {
                let mut entry = 0.0;
                for k in 0..4 {
                    let square: f64 = points.iter().map(|other| other[k] * other[k]).sum();
                    entry += node[k] * point[k] / square;
                }
                matrix.push(entry);
            }
        }
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrapolation_reproduces_a_bilinear_field() {
        for rule in [Q8Rule::Reduced, Q8Rule::Full] {
            let element = Q8 { rule };
            let field = |[x, y]: [f64; 2]| 2.0 - x + 0.5 * y + 0.25 * x * y;
            let values: Vec<f64> = element.quadrature().iter().map(|p| field(p.xi)).collect();
            let matrix = element.extrapolation();
            for (a, corner) in CORNERS.into_iter().enumerate() {
                let row = &matrix[a * values.len()..(a + 1) * values.len()];
                let found: f64 = row.iter().zip(&values).map(|(m, v)| m * v).sum();
                assert!((found - field(corner)).abs() < 1e-14);
            }
        }
    }
}
