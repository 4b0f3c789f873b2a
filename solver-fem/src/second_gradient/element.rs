//! The rows of v and λ of an element, and what λ adds to those of u.

use super::point::{Point, PointFields};
use crate::assembly::Configuration;
use crate::kinematics::{InvertedElement, PointGeometry, point_geometry, position, spatial};
use crate::problem::Problem;
use crate::tensor::{self, Tensor2};

/// Shape functions of v at a Gauss point of the reference element.
#[derive(Clone, PartialEq, Debug)]
pub struct CornerPoint<const D: usize> {
    /// M_A at every corner.
    pub shape: Vec<f64>,
    /// ∂M_A/∂ξ_j.
    pub gradients: Vec<[f64; D]>,
}

/// A Gauss point of a second-gradient element on the current configuration.
pub(crate) struct Located<'a, const D: usize> {
    pub geometry: PointGeometry<D>,
    /// M_A.
    pub shape: &'a [f64],
    /// ∂M_A/∂x_j.
    pub gradients: Vec<[f64; D]>,
    pub point: Point<D>,
}

/// λ of an element; `None` for a plain one.
pub(crate) fn multiplier<const D: usize>(
    problem: &Problem<D>,
    unknowns: &[f64],
    element: usize,
) -> Option<Tensor2<D>> {
    let first = problem.layout().multiplier_dof(element)?;
    Some(tensor::load2(&unknowns[first..first + D * D], 0))
}

/// The Gauss point `local` of a second-gradient element.
///
/// # Errors
/// An element that is inverted, or turned half round by the step.
pub(crate) fn locate<'a, const D: usize>(
    problem: &'a Problem<D>,
    at: &Configuration<'_>,
    element: usize,
    local: usize,
) -> Result<Located<'a, D>, InvertedElement> {
    let folded = InvertedElement {
        element,
        point: local,
    };
    let nodes = problem.mesh().element(element);
    let reference = problem.reference_points();
    let geometry = point_geometry(&reference[local], nodes, at.unknowns).ok_or(folded)?;
    let corner = &problem.corner_points()[local];
    let gradients = spatial(&corner.gradients, &geometry.inverse);

    let mut h = tensor::zero::<D>();
    for (&node, gradient) in nodes.iter().zip(&geometry.gradients) {
        let x = position::<D>(at.unknowns, node);
        let before = position::<D>(at.start.coordinates, node);
        for i in 0..D {
            for j in 0..D {
                h[i][j] += (x[i] - before[i]) * gradient[j];
            }
        }
    }
    let mut v = tensor::zero::<D>();
    let mut slope = [[[0.0; D]; D]; D];
    for ((&node, shape), gradient) in nodes.iter().zip(&corner.shape).zip(&gradients) {
        let first = problem.layout().gradient_dof(node);
        let first = first.expect("corners of a second-gradient element carry v");
        let value: Tensor2<D> = tensor::load2(&at.unknowns[first..first + D * D], 0);
        for i in 0..D {
            for j in 0..D {
                v[i][j] += shape * value[i][j];
                for k in 0..D {
                    slope[i][j][k] += value[i][j] * gradient[k];
                }
            }
        }
    }
    let multiplier = multiplier(problem, at.unknowns, element);
    let index = element * reference.len() + local;
    let fields = PointFields {
        displacement_gradient: h,
        gradient: v,
        slope,
        multiplier: multiplier.expect("a second-gradient element has a multiplier"),
        double_stress_before: tensor::load3(at.start.double_stress, index),
        modulus: problem.modulus(element),
    };
    Ok(Located {
        geometry,
        shape: &corner.shape,
        gradients,
        point: Point::new(fields).ok_or(folded)?,
    })
}

/// ‖∫(H − v)‖² and ‖∫H‖², summed over elements: how well v is tied to u.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Tie {
    pub mismatch: f64,
    pub gradient: f64,
}

/// Adds the rows of v, ∫ (χ_ijk ∂M_A/∂x_k + λ_ij M_A) dv, and of λ, ∫ (H_ij − v_ij) dv.
pub(crate) fn add_residual<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
    vector: &mut [f64],
) -> Result<Tie, InvertedElement> {
    let (mesh, layout) = (problem.mesh(), problem.layout());
    let mut tie = Tie::default();
    for element in 0..mesh.element_count() {
        let Some(first) = layout.multiplier_dof(element) else {
            continue;
        };
        let (mut mismatch, mut total) = (tensor::zero::<D>(), tensor::zero::<D>());
        for local in 0..problem.points_per_element() {
            let located = locate(problem, at, element, local)?;
            let (point, volume) = (&located.point, located.geometry.volume);
            let corners = mesh.element(element).iter().zip(located.shape);
            for ((&node, shape), gradient) in corners.zip(&located.gradients) {
                let row = layout.gradient_dof(node).expect("a corner carries v");
                for i in 0..D {
                    for j in 0..D {
                        let mut work = point.multiplier()[i][j] * shape;
                        for k in 0..D {
                            work += point.double_stress[i][j][k] * gradient[k];
                        }
                        vector[row + i * D + j] += volume * work;
                    }
                }
            }
            for i in 0..D {
                for j in 0..D {
                    mismatch[i][j] += volume * point.mismatch[i][j];
                    total[i][j] += volume * point.displacement_gradient()[i][j];
                }
            }
        }
        for i in 0..D {
            for j in 0..D {
                vector[first + i * D + j] += mismatch[i][j];
                tie.mismatch += mismatch[i][j] * mismatch[i][j];
                tie.gradient += total[i][j] * total[i][j];
            }
        }
    }
    Ok(tie)
}

/// Adds to the dense tangent of an element (rows and columns in the order of
/// [`Layout::element_dofs`](crate::layout::Layout::element_dofs), `size` of each) all blocks but
/// that of u with u.
pub(crate) fn add_tangent<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
    element: usize,
    matrix: &mut [f64],
    size: usize,
) -> Result<(), InvertedElement> {
    let nodes = problem.mesh().nodes_per_element;
    let law = problem.unit_law();
    let modulus = problem.modulus(element);
    for local in 0..problem.points_per_element() {
        let located = locate(problem, at, element, local)?;
        let Located {
            geometry,
            shape,
            gradients,
            point,
        } = &located;
        let volume = geometry.volume;
        let v = |corner: usize| nodes * D + corner * D * D;
        let lambda = v(shape.len());
        let along = point.linearise();
        let mut add = |row: usize, column: usize, value: f64| {
            matrix[row * size + column] += volume * value;
        };
        for (a, gradient) in gradients.iter().enumerate() {
            // ∂M_A/∂x_m D_ijm,pqr, then times ∂M_B/∂x_r.
            for (pq, slopes) in law.chunks(D).enumerate() {
                let mut rows = [[[0.0; D]; D]; D];
                for (r, chi) in slopes.iter().enumerate() {
                    for i in 0..D {
                        for j in 0..D {
                            for m in 0..D {
                                rows[i][j][r] += modulus * gradient[m] * chi[i][j][m];
                            }
                        }
                    }
                }
                for (b, right) in gradients.iter().enumerate() {
                    for i in 0..D {
                        for j in 0..D {
                            let mut sum = 0.0;
                            for r in 0..D {
                                sum += rows[i][j][r] * right[r];
                            }
                            add(v(a) + i * D + j, v(b) + pq, sum);
                        }
                    }
                }
            }
            for i in 0..D {
                for j in 0..D {
                    let row = v(a) + i * D + j;
                    let mut by_motion = along.multiplier[i][j].map(|k| k.map(|l| shape[a] * l));
                    for m in 0..D {
                        for k in 0..D {
                            for l in 0..D {
                                by_motion[k][l] += gradient[m] * along.double_stress[i][j][m][k][l];
                            }
                        }
                    }
                    for (b, right) in geometry.gradients.iter().enumerate() {
                        for k in 0..D {
                            let along_b = (0..D).map(|l| by_motion[k][l] * right[l]);
                            add(row, b * D + k, along_b.sum());
                        }
                    }
                    add(row, lambda + i * D + j, shape[a]);
                    add(lambda + i * D + j, row, -shape[a]);
                }
            }
        }
        for (b, right) in geometry.gradients.iter().enumerate() {
            for i in 0..D {
                for j in 0..D {
                    add(b * D + i, lambda + i * D + j, -right[j]);
                    for k in 0..D {
                        let along_b = (0..D).map(|l| along.mismatch[i][j][k][l] * right[l]);
                        add(lambda + i * D + j, b * D + k, along_b.sum());
                    }
                }
            }
        }
    }
    Ok(())
}

/// χ of every Gauss point, flat; zero in plain elements.
///
/// # Errors
/// An element that is inverted, or turned half round by the step.
pub fn double_stresses<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
) -> Result<Vec<f64>, InvertedElement> {
    let size = D * D * D;
    let mut stresses = vec![0.0; problem.gauss_point_count() * size];
    for element in 0..problem.mesh().element_count() {
        if problem.layout().multiplier_dof(element).is_none() {
            continue;
        }
        for local in 0..problem.points_per_element() {
            let point = locate(problem, at, element, local)?.point;
            let index = element * problem.points_per_element() + local;
            let values = point.double_stress.iter().flatten().flatten();
            for (place, value) in stresses[index * size..].iter_mut().zip(values) {
                *place = *value;
            }
        }
    }
    Ok(stresses)
}

/// ‖H − v‖/‖H‖ over every second-gradient element, in the order of their multipliers.
///
/// # Errors
/// An element that is inverted, or turned half round by the step.
pub(super) fn mismatches<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
) -> Result<Vec<f64>, InvertedElement> {
    let square = |t: &Tensor2<D>| -> f64 { t.iter().flatten().map(|x| x * x).sum() };
    let elements = 0..problem.mesh().element_count();
    elements
        .filter(|&element| problem.layout().multiplier_dof(element).is_some())
        .map(|element| {
            let (mut apart, mut whole) = (0.0, 0.0);
            for local in 0..problem.points_per_element() {
                let located = locate(problem, at, element, local)?;
                let volume = located.geometry.volume;
                apart += volume * square(&located.point.mismatch);
                whole += volume * square(located.point.displacement_gradient());
            }
            Ok(if apart == 0.0 {
                0.0
            } else {
                (apart / whole).sqrt()
            })
        })
        .collect()
}
