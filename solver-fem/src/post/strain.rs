//! Total strains from the initial mesh.

use crate::kinematics::{deformation_gradient, point_geometry};
use crate::problem::Problem;
use crate::tensor::{self, Tensor2};

/// Total deformation gradient dx/dX of every Gauss point, X being the initial mesh.
///
/// # Panics
/// When `coordinates` is not one position per node.
pub fn deformation_gradients<const D: usize>(
    problem: &Problem<D>,
    coordinates: &[f64],
) -> Vec<Tensor2<D>> {
    assert_eq!(
        coordinates.len(),
        problem.dof_count(),
        "one position per node"
    );
    problem
        .gauss_points()
        .map(|id| {
            let (element, point) = problem.locate(id);
            let nodes = problem.mesh().element(element);
            let initial = problem.initial();
            let geometry = point_geometry(&problem.reference_points()[point], nodes, initial)
                .expect("a problem is only built on a mesh without inverted elements");
            deformation_gradient(&geometry, nodes, initial, coordinates)
        })
        .collect()
}

/// Green–Lagrange strain E = ½(FᵀF − I): free of rotation, extension positive.
pub fn green_lagrange<const D: usize>(f: &Tensor2<D>) -> Tensor2<D> {
    let mut strain = tensor::product(&tensor::transpose(f), f);
    for i in 0..D {
        strain[i][i] -= 1.0;
        for j in 0..D {
            strain[i][j] *= 0.5;
        }
    }
    strain
}

/// Logarithmic strain ½ ln(F·Fᵀ) in the present configuration, extension positive; its trace is
/// ln(v/v0). Components are NaN where F is singular.
pub fn logarithmic<const D: usize>(f: &Tensor2<D>) -> Tensor2<D> {
    let (squares, axes) = tensor::symmetric_eigen(&tensor::product(f, &tensor::transpose(f)));
    tensor::from_eigen(&squares.map(|s| 0.5 * libm::log(s)), &axes)
}

/// Volume strain tr ε, dilation positive. In plane strain ε_33 = 0.
pub fn volumetric<const D: usize>(strain: &Tensor2<D>) -> f64 {
    tensor::trace(strain)
}

/// Equivalent deviatoric strain √(⅔ e:e) with the **three-dimensional** deviator
/// e = ε − tr(ε)/3 I; in plane strain the out-of-plane e_33 = −tr(ε)/3 is counted.
///
/// It is the axial strain of isochoric triaxial compression, and 2/√3 ε for pure plane shear of
/// principal strains ±ε.
pub fn second_invariant<const D: usize>(strain: &Tensor2<D>) -> f64 {
    let mean = tensor::trace(strain) / 3.0;
    let mut sum = (3usize.saturating_sub(D)) as f64 * mean * mean;
    for i in 0..D {
        for j in 0..D {
            let e = strain[i][j] - if i == j { mean } else { 0.0 };
            sum += e * e;
        }
    }
    (2.0 / 3.0 * sum).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_is_no_strain() {
        let (s, c) = 0.7_f64.sin_cos();
        let f = [[c, -s], [s, c]];
        for strain in [green_lagrange(&f), logarithmic(&f)] {
            assert!(strain.iter().flatten().all(|e| e.abs() < 1e-15));
        }
    }

    #[test]
    fn the_invariant_counts_the_out_of_plane_deviator() {
        let pure: f64 = second_invariant(&[[0.1, 0.0], [0.0, -0.1]]);
        assert!((pure - 0.2 / 3.0_f64.sqrt()).abs() < 1e-15);
        let flat = second_invariant(&[[0.1, 0.0], [0.0, 0.0]]);
        let solid = second_invariant(&[[0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]);
        assert_eq!(flat, solid);
        assert!((logarithmic(&[[2.0, 0.0], [0.0, 1.0]])[0][0] - 2.0_f64.ln()).abs() < 1e-15);
    }
}
