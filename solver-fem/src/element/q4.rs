//! Q4: the four-node quadrilateral.

use super::quadrature::{GaussOrder, QuadraturePoint, tensor_product};
use super::{Element, FacetPoint, Line2};

/// Four-node quadrilateral on [−1, 1]² with 2×2 points.
///
/// Nodes: corners (−1,−1), (1,−1), (1,1), (−1,1). Facet f runs from corner f to corner f+1.
///
/// It **locks**. In bending, its sides cannot curve and a shear strain that is not there resists
/// (an element ten times as long as high is about a hundred times too stiff). Where volume is nearly
/// kept, as in dense or undrained shear, the four points fix four volumes with two unknowns per node,
/// and the mesh hardly deforms. It is here to compare with linear meshes and to show what a mesh does
/// to a shear band; take [`Q8`](super::Q8) or [`T6`](super::T6) to compute.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Q4;

const NODES: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
const EDGES: [[usize; 2]; 4] = [[0, 1], [1, 2], [2, 3], [3, 0]];

impl Element<2> for Q4 {
    fn name(&self) -> &'static str {
        "Q4"
    }

    fn node_count(&self) -> usize {
        4
    }

    fn corner_count(&self) -> usize {
        4
    }

    fn node_positions(&self) -> &'static [[f64; 2]] {
        &NODES
    }

    /// N = ¼(1+ξξₐ)(1+ηηₐ).
    fn shape(&self, &[x, y]: &[f64; 2], values: &mut [f64]) {
        for (value, [xa, ya]) in values.iter_mut().zip(NODES) {
            *value = 0.25 * (1.0 + x * xa) * (1.0 + y * ya);
        }
    }

    fn shape_gradients(&self, &[x, y]: &[f64; 2], gradients: &mut [[f64; 2]]) {
        for (gradient, [xa, ya]) in gradients.iter_mut().zip(NODES) {
            *gradient = [0.25 * xa * (1.0 + y * ya), 0.25 * ya * (1.0 + x * xa)];
        }
    }

    fn quadrature(&self) -> Vec<QuadraturePoint<2>> {
        tensor_product(GaussOrder::Two)
    }

    fn facet_count(&self) -> usize {
        4
    }

    fn facet_nodes(&self, facet: usize) -> &'static [usize] {
        &EDGES[facet]
    }

    fn facet_quadrature(&self) -> Vec<FacetPoint> {
        Line2::quadrature()
    }

    /// The bilinear field through the four values: with g = 1/√3 the value at corner a is
    /// Σ_p ¼(1 + 3 ξₐξ_p)(1 + 3 ηₐη_p) v_p.
    fn extrapolation(&self) -> Vec<f64> {
        let points = self.quadrature();
        NODES
            .iter()
            .flat_map(|[xa, ya]| {
                points
                    .iter()
                    .map(move |p| 0.25 * (1.0 + 3.0 * xa * p.xi[0]) * (1.0 + 3.0 * ya * p.xi[1]))
            })
            .collect()
    }
}
