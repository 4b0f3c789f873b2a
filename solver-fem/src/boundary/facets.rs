//! The facets of a boundary in the deformed mesh: tangents, area vector and their derivatives.
//!
//! With the tangents t_k = ∂x/∂s_k of a facet, n_i ds = det[e_i, t_1, …, t_{D−1}] d^{D−1}s. The determinant is linear in
//! every tangent.

use crate::element::{Element, FacetPoint};
use crate::kinematics::position;
use crate::mesh::Mesh;
use crate::tensor::{self, Tensor2};

/// A side of an element that lies on a boundary.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Facet {
    pub element: usize,
    /// Local nodes within the element, and the same nodes in the mesh.
    pub local: &'static [usize],
    pub nodes: Vec<usize>,
}

/// The facets of a named boundary; `None` where the mesh has none of that name.
pub(super) fn facets_of<const D: usize>(
    mesh: &Mesh<D>,
    element: &dyn Element<D>,
    boundary: &str,
) -> Option<Vec<Facet>> {
    let facets = mesh.boundaries.get(boundary)?.iter();
    let facets = facets.map(|facet| {
        let local = element.facet_nodes(facet.local);
        let nodes = mesh.element(facet.element);
        Facet {
            element: facet.element,
            local,
            nodes: local.iter().map(|&a| nodes[a]).collect(),
        }
    });
    Some(facets.collect())
}

/// det[e_i, t_1, …, t_{D−1}] for every i: the outward normal times the area of the facet.
pub(super) fn area_vector<const D: usize>(tangents: &[[f64; D]]) -> [f64; D] {
    let mut result = [0.0; D];
    for (i, component) in result.iter_mut().enumerate() {
        let mut rows = tensor::zero::<D>();
        rows[0][i] = 1.0;
        rows[1..].copy_from_slice(tangents);
        *component = tensor::determinant(&rows);
    }
    result
}

/// t_k = x_a ∂N_a/∂s_k.
pub(super) fn tangents<const D: usize>(
    point: &FacetPoint,
    nodes: &[usize],
    coordinates: &[f64],
) -> Vec<[f64; D]> {
    point
        .gradients
        .iter()
        .map(|gradient| {
            let mut tangent = [0.0; D];
            for (&node, derivative) in nodes.iter().zip(gradient) {
                let x = position::<D>(coordinates, node);
                for i in 0..D {
                    tangent[i] += x[i] * derivative;
                }
            }
            tangent
        })
        .collect()
}

/// det[e_i, …, e_j at `direction`, …] for every i, j.
pub(super) fn area_derivative<const D: usize>(
    tangents: &[[f64; D]],
    direction: usize,
) -> Tensor2<D> {
    let mut result = tensor::zero::<D>();
    for j in 0..D {
        let mut varied = tangents.to_vec();
        varied[direction] = [0.0; D];
        varied[direction][j] = 1.0;
        let column = area_vector(&varied);
        for i in 0..D {
            result[i][j] = column[i];
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_points_outward_in_two_and_three_dimensions() {
        // Bottom edge of a counter-clockwise element runs along +x: outward is −y.
        assert_eq!(area_vector(&[[2.0, 0.0]]), [0.0, -2.0]);
        assert_eq!(
            area_vector(&[[1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]),
            [0.0, 0.0, 3.0]
        );
    }
}
