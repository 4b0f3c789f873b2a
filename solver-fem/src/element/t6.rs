//! T6: the six-node triangle.

use super::quadrature::{QuadraturePoint, TriangleRule, triangle};
use super::{Element, FacetPoint, Line3};
use crate::second_gradient::CornerPoint;

/// Integration rule of a [`T6`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum T6Rule {
    /// Three inner points: as many strains as one element has ways to strain, so that it neither
    /// locks nor has a spurious mode.
    #[default]
    Reduced,
    /// Six points: exact for the stiffness of straight-sided elements.
    Full,
}

/// Six-node triangle on ξ, η ≥ 0, ξ + η ≤ 1.
///
/// Nodes: corners (0,0), (1,0), (0,1), then the middles of the sides 12, 23, 31. Facet f runs from
/// corner f to corner f+1.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct T6 {
    /// The volume rule.
    pub rule: T6Rule,
}

const NODES: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [0.5, 0.0],
    [0.5, 0.5],
    [0.0, 0.5],
];
const EDGES: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [2, 0, 5]];
/// ∂L_i/∂ξ_j of the area coordinates.
const SLOPES: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];

/// Area coordinates (L1, L2, L3) = (1−ξ−η, ξ, η).
fn area_coordinates([x, y]: [f64; 2]) -> [f64; 3] {
    [1.0 - x - y, x, y]
}

impl Element<2> for T6 {
    fn name(&self) -> &'static str {
        "T6"
    }

    fn node_count(&self) -> usize {
        6
    }

    fn corner_count(&self) -> usize {
        3
    }

    fn node_positions(&self) -> &'static [[f64; 2]] {
        &NODES
    }

    /// Corner: N_i = L_i(2L_i − 1); middle of side ij: N = 4 L_i L_j.
    fn shape(&self, xi: &[f64; 2], values: &mut [f64]) {
        let l = area_coordinates(*xi);
        for i in 0..3 {
            let j = (i + 1) % 3;
            values[i] = l[i] * (2.0 * l[i] - 1.0);
            values[3 + i] = 4.0 * l[i] * l[j];
        }
    }

    fn shape_gradients(&self, xi: &[f64; 2], gradients: &mut [[f64; 2]]) {
        let l = area_coordinates(*xi);
        for i in 0..3 {
            let j = (i + 1) % 3;
            for k in 0..2 {
                gradients[i][k] = (4.0 * l[i] - 1.0) * SLOPES[i][k];
                gradients[3 + i][k] = 4.0 * (SLOPES[i][k] * l[j] + l[i] * SLOPES[j][k]);
            }
        }
    }

    /// Linear: M_i = L_i.
    fn corner_field(&self, xi: &[f64; 2]) -> Option<CornerPoint<2>> {
        Some(CornerPoint {
            shape: area_coordinates(*xi).to_vec(),
            gradients: SLOPES.to_vec(),
        })
    }

    fn quadrature(&self) -> Vec<QuadraturePoint<2>> {
        triangle(match self.rule {
            T6Rule::Reduced => TriangleRule::Three,
            T6Rule::Full => TriangleRule::Six,
        })
    }

    fn facet_count(&self) -> usize {
        3
    }

    fn facet_nodes(&self, facet: usize) -> &'static [usize] {
        &EDGES[facet]
    }

    fn facet_quadrature(&self) -> Vec<FacetPoint> {
        Line3::quadrature()
    }

    /// Least-squares linear field c·L through the Gauss point values. The rule is symmetric, so that
    /// M_ij = Σ_p L_i L_j = α δ_ij + β, and with ΣL = 1 the value at a node is
    /// Σ_p (1/α)(L(node)·L(p) − β/(α + 3β)) v_p.
    fn extrapolation(&self) -> Vec<f64> {
        let points = self.quadrature();
        let points: Vec<_> = points.iter().map(|p| area_coordinates(p.xi)).collect();
        let beta: f64 = points.iter().map(|l| l[0] * l[1]).sum();
        let alpha = points.iter().map(|l| l[0] * l[0]).sum::<f64>() - beta;
        let shift = beta / (alpha + 3.0 * beta);
        let mut matrix = Vec::with_capacity(6 * points.len());
        for node in NODES.map(area_coordinates) {
            for l in &points {
                let product: f64 = node.iter().zip(l).map(|(a, b)| a * b).sum();
                matrix.push((product - shift) / alpha);
            }
        }
        matrix
    }
}
