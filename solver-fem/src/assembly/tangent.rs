//! The exact derivative of the residual with respect to the node positions.
//!
//! On the current configuration, L = grad(du):
//! ∫ u*_{i,j} [ C_ijkl L_kl − σ_ik L_jk + σ_ij L_mm ] dv, hence per Gauss point the operator
//! A_ijkl = C_ijkl − σ_il δ_jk + σ_ij δ_kl and K_{ai,bk} = ∂N_a/∂x_j A_ijkl ∂N_b/∂x_l.
//! The second term is the change of the gradient ∂/∂x_j, the third the change of volume. Follower
//! pressure adds its own, unsymmetric part; second gradient has σ − λ in the place of σ and rows of its
//! own ([`crate::second_gradient::point`]).

use super::Configuration;
use super::residual::net_stress;
use crate::kinematics::{InvertedElement, point_geometry};
use crate::problem::Problem;
use crate::second_gradient::element as second_gradient;
use crate::tensor::{self, Tensor2, Tensor4};

/// The linear equations of one correction.
#[derive(Clone, PartialEq, Debug)]
pub struct LinearSystem {
    /// Values on the problem's [`Pattern`](super::Pattern).
    pub values: Vec<f64>,
    /// K_free,prescribed · du_prescribed, one entry per equation.
    pub prescribed: Vec<f64>,
}

/// Assembles the tangent of a configuration for the Gauss points' tangents (flat), and the forces that
/// `prescribed` (a displacement per degree of freedom, read on prescribed displacements only) would
/// cause in the free equations.
///
/// # Errors
/// An element that is inverted at these positions.
///
/// # Panics
/// When an array has not the length the problem gives it.
pub fn tangent<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
    tangents: &[f64],
    prescribed: &[f64],
) -> Result<LinearSystem, InvertedElement> {
    let pattern = problem.pattern();
    let mesh = problem.mesh();
    let mut system = LinearSystem {
        values: vec![0.0; pattern.entry_count()],
        prescribed: vec![0.0; pattern.size],
    };
    // What a prescribed displacement adds; prescribed components of v do not move within a step.
    let moved = |element: usize, column: usize| -> Option<f64> {
        let node = mesh.element(element).get(column / D)?;
        let held = pattern.element_equations(element)[column].is_none();
        held.then(|| prescribed[node * D + column % D])
    };
    let LinearSystem {
        values,
        prescribed: forces,
    } = &mut system;
    let mut stiffness = Vec::new();
    for element in 0..mesh.element_count() {
        element_tangent(problem, at, tangents, element, &mut stiffness)?;
        pattern.scatter(element, &stiffness, values);
        let equations = pattern.element_equations(element);
        for column in 0..equations.len() {
            let Some(moved) = moved(element, column) else {
                continue;
            };
            for (row, equation) in equations.iter().enumerate() {
                if let Some(equation) = equation {
                    forces[*equation as usize] += stiffness[row * equations.len() + column] * moved;
                }
            }
        }
    }
    let positions = &at.unknowns[..problem.layout().displacement_count()];
    problem.external_loads().stiffness::<D>(
        positions,
        at.loads,
        &mut |element: usize, row: usize, column: usize, value: f64| {
            if let Some(entry) = pattern.entry(element, row, column) {
                values[entry] += value;
            } else if let (Some(equation), Some(moved)) = (
                pattern.element_equations(element)[row],
                moved(element, column),
            ) {
                forces[equation as usize] += value * moved;
            }
        },
    );
    Ok(system)
}

/// The dense tangent of one element, follower loads left out, row by row in the order of
/// [`Layout::element_dofs`](crate::layout::Layout::element_dofs); `matrix` is overwritten.
///
/// # Errors
/// An element that is inverted at these positions.
///
/// # Panics
/// When an array has not the length the problem gives it.
pub fn element_tangent<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
    tangents: &[f64],
    element: usize,
    matrix: &mut Vec<f64>,
) -> Result<(), InvertedElement> {
    let size = problem.pattern().element_equations(element).len();
    matrix.clear();
    matrix.resize(size * size, 0.0);
    let nodes = problem.mesh().element(element);
    let reference = problem.reference_points();
    let multiplier = second_gradient::multiplier(problem, at.unknowns, element);
    for (point, data) in reference.iter().enumerate() {
        let geometry =
            point_geometry(data, nodes, at.unknowns).ok_or(InvertedElement { element, point })?;
        let index = element * reference.len() + point;
        let sigma = net_stress(at.stress, index, multiplier.as_ref());
        let operator = spatial_operator::<D>(&sigma, tangents, index);
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
                        matrix[(a * D + i) * size + b * D + k] += sum;
                    }
                }
            }
        }
    }
    if multiplier.is_some() {
        second_gradient::add_tangent(problem, at, element, matrix, size)?;
    }
    Ok(())
}

/// A_ijkl = C_ijkl − σ_il δ_jk + σ_ij δ_kl.
fn spatial_operator<const D: usize>(
    sigma: &Tensor2<D>,
    tangents: &[f64],
    index: usize,
) -> Tensor4<D> {
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
