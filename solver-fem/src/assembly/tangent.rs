//! The exact derivative of the residual with respect to the node positions.
//!
//! On the current configuration, L = grad(du):
//! ∫ u*_{i,j} [ C_ijkl L_kl − σ_ik L_jk + σ_ij L_mm ] dv, hence per Gauss point the operator
//! A_ijkl = C_ijkl − σ_il δ_jk + σ_ij δ_kl and K_{ai,bk} = ∂N_a/∂x_j A_ijkl ∂N_b/∂x_l.
//! The second term is the change of the gradient ∂/∂x_j, the third the change of volume. Follower
//! pressure adds its own, unsymmetric part.

use crate::kinematics::{InvertedElement, point_geometry};
use crate::problem::Problem;
use crate::tensor::{self, Tensor4};

/// The linear equations of one correction.
#[derive(Clone, PartialEq, Debug)]
pub struct LinearSystem {
    /// Values on the problem's [`Pattern`](super::Pattern).
    pub values: Vec<f64>,
    /// K_free,prescribed · du_prescribed, one entry per equation.
    pub prescribed: Vec<f64>,
}

/// Assembles the tangent stiffness for Gauss point stresses and tangents (both flat), and the
/// forces that `prescribed` (a displacement per degree of freedom, read on prescribed ones only)
/// would cause in the free equations.
///
/// # Errors
/// An element that is inverted at these positions.
///
/// # Panics
/// When an array has not the length the problem gives it.
pub fn tangent<const D: usize>(
    problem: &Problem<D>,
    coordinates: &[f64],
    stress: &[f64],
    tangents: &[f64],
    loads: &[f64],
    prescribed: &[f64],
) -> Result<LinearSystem, InvertedElement> {
    let pattern = problem.pattern();
    let mesh = problem.mesh();
    let equation = &problem.constraints().equation;
    let mut system = LinearSystem {
        values: vec![0.0; pattern.entry_count()],
        prescribed: vec![0.0; pattern.size],
    };
    let mut add = |element: usize, row: usize, column: usize, value: f64| {
        if let Some(entry) = pattern.entry(element, row, column) {
            system.values[entry] += value;
            return;
        }
        let nodes = mesh.element(element);
        let dof = |local: usize| nodes[local / D] * D + local % D;
        if let (Some(row), None) = (equation[dof(row)], equation[dof(column)]) {
            system.prescribed[row] += value * prescribed[dof(column)];
        }
    };

    let reference = problem.reference_points();
    let size = mesh.nodes_per_element * D;
    let mut stiffness = vec![0.0; size * size];
    for element in 0..mesh.element_count() {
        let nodes = mesh.element(element);
        stiffness.fill(0.0);
        for (point, data) in reference.iter().enumerate() {
            let geometry = point_geometry(data, nodes, coordinates)
                .ok_or(InvertedElement { element, point })?;
            let index = element * reference.len() + point;
            let operator = spatial_operator::<D>(stress, tangents, index);
            for (a, left) in geometry.gradients.iter().enumerate() {
                // g_j A_ijkl, volume included.
                let mut rows = [[[0.0; D]; D]; D];
                for i in 0..D {
                    for j in 0..D {
                        for k in 0..D {
                            for l in 0..D {
                                rows[i][k][l] += geometry.volume * left[j] * operator[i][j][k][l];
                            }
                        }
                    }
                }
                for (b, right) in geometry.gradients.iter().enumerate() {
                    for i in 0..D {
                        for k in 0..D {
                            let mut sum = 0.0;
                            for l in 0..D {
                                sum += rows[i][k][l] * right[l];
                            }
                            stiffness[(a * D + i) * size + b * D + k] += sum;
                        }
                    }
                }
            }
        }
        for row in 0..size {
            for column in 0..size {
                add(element, row, column, stiffness[row * size + column]);
            }
        }
    }
    problem
        .surface_loads()
        .stiffness::<D>(coordinates, loads, &mut add);
    Ok(system)
}

/// A_ijkl = C_ijkl − σ_il δ_jk + σ_ij δ_kl.
fn spatial_operator<const D: usize>(stress: &[f64], tangents: &[f64], index: usize) -> Tensor4<D> {
    let sigma = tensor::load2::<D>(stress, index);
    let mut operator = tensor::load4::<D>(tangents, index);
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                operator[i][j][j][k] -= sigma[i][k];
                operator[i][j][k][k] += sigma[i][j];
            }
        }
    }
    operator
}
