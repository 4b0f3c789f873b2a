//! Geometry of a Gauss point and deformation gradients between two configurations.

use thiserror::Error;

use crate::tensor::{self, Tensor2};

/// Reference data of one local Gauss point, the same for every element of a mesh.
#[derive(Clone, PartialEq, Debug)]
pub struct ReferencePoint<const D: usize> {
    /// Weight of the quadrature rule.
    pub weight: f64,
    /// Shape function values N_a.
    pub shape: Vec<f64>,
    /// Shape function derivatives ∂N_a/∂ξ_j.
    pub gradients: Vec<[f64; D]>,
}

/// The mapping of an element lost its orientation at a Gauss point.
#[derive(Error, Clone, Copy, PartialEq, Eq, Debug)]
#[error("map element e{element}: it is inverted at its Gauss point {point}")]
pub struct InvertedElement {
    /// The element.
    pub element: usize,
    /// The local Gauss point.
    pub point: usize,
}

/// Shape function gradients on an actual configuration.
#[derive(Clone, PartialEq, Debug)]
pub struct PointGeometry<const D: usize> {
    /// ∂N_a/∂x_j.
    pub gradients: Vec<[f64; D]>,
    /// J⁻¹, `inverse[j][i]` = ∂ξ_j/∂x_i: what carries other reference gradients over.
    pub inverse: Tensor2<D>,
    /// Volume the point stands for: weight × determinant of the Jacobian (unit thickness in 2D).
    pub volume: f64,
}

/// Coordinates of a node in a flat list.
pub(crate) fn position<const D: usize>(coordinates: &[f64], node: usize) -> [f64; D] {
    let mut result = [0.0; D];
    result.copy_from_slice(&coordinates[node * D..(node + 1) * D]);
    result
}

/// J_ij = x_a,i ∂N_a/∂ξ_j, then ∂N_a/∂x_i = ∂N_a/∂ξ_j J⁻¹_ji; `None` where det J ≤ 0.
pub fn point_geometry<const D: usize>(
    reference: &ReferencePoint<D>,
    nodes: &[usize],
    coordinates: &[f64],
) -> Option<PointGeometry<D>> {
    let mut jacobian = tensor::zero::<D>();
    for (&node, gradient) in nodes.iter().zip(&reference.gradients) {
        let x = position::<D>(coordinates, node);
        for i in 0..D {
            for j in 0..D {
                jacobian[i][j] += x[i] * gradient[j];
            }
        }
    }
    let (determinant, inverse) = tensor::determinant_and_inverse(&jacobian);
    // Written so that a NaN is refused too.
    let inverse = if determinant > 0.0 {
        inverse?
    } else {
        return None;
    };
    Some(PointGeometry {
        gradients: spatial(&reference.gradients, &inverse),
        inverse,
        volume: determinant * reference.weight,
    })
}

/// ∂N/∂x_i = ∂N/∂ξ_j J⁻¹_ji for every N.
pub(crate) fn spatial<const D: usize>(
    gradients: &[[f64; D]],
    inverse: &Tensor2<D>,
) -> Vec<[f64; D]> {
    let carry = |gradient: &[f64; D]| {
        let mut result = [0.0; D];
        for i in 0..D {
            for j in 0..D {
                result[i] += gradient[j] * inverse[j][i];
            }
        }
        result
    };
    gradients.iter().map(carry).collect()
}

/// F_ij = δ_ij + (x_a,i − X_a,i) ∂N_a/∂X_j, `geometry` and `base` being the configuration X.
///
/// Written with the difference, so that no motion gives exactly the identity.
pub fn deformation_gradient<const D: usize>(
    geometry: &PointGeometry<D>,
    nodes: &[usize],
    base: &[f64],
    coordinates: &[f64],
) -> Tensor2<D> {
    let mut f = tensor::identity::<D>();
    for (&node, gradient) in nodes.iter().zip(&geometry.gradients) {
        let (x, start) = (position::<D>(coordinates, node), position::<D>(base, node));
        for i in 0..D {
            for j in 0..D {
                f[i][j] += (x[i] - start[i]) * gradient[j];
            }
        }
    }
    f
}
