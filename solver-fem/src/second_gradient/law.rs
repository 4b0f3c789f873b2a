//! The double stress of a gradient of v: isotropic, linear, one modulus.
//!
//! With g_ijk = v_ij,k, s_ijk = ½(g_ijk + g_ikj), d_k = s_aak (the gradient of the dilation) and
//! W_ijk = s_jik − s_ijk (the gradient of the rotation u_j,i − u_i,j), all for v_ij = u_i,j:
//!
//! χ_ijk = (D/2) [ δ_ij d_k + δ_ik d_j − W_ijk − W_ikj ],
//!
//! the derivative of the energy (D/2) ( d_k d_k + ½ W_ijk W_ijk ) = (D/2) (|∇div u|² + |∇rot u|²).
//! In two dimensions it is the one-parameter law of Matsushima, Chambon and Caillerie (2002): in the order
//! 111, 112, 121, 122, 211, 212, 221, 222 a matrix with the eigenvalues 0 (four times), D and 2D (twice
//! each). The modulus D is a stress times a length squared.

use crate::tensor::Tensor3;

/// χ of the gradient `g` of v, for the modulus `d`.
pub fn double_stress<const D: usize>(d: f64, g: &Tensor3<D>) -> Tensor3<D> {
    let s = |i: usize, j: usize, k: usize| 0.5 * (g[i][j][k] + g[i][k][j]);
    let mut dilation = [0.0; D];
    for (k, slope) in dilation.iter_mut().enumerate() {
        *slope = (0..D).map(|a| s(a, a, k)).sum();
    }
    let rotation = |i: usize, j: usize, k: usize| s(j, i, k) - s(i, j, k);
    let mut chi = [[[0.0; D]; D]; D];
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                let mut sum = -rotation(i, j, k) - rotation(i, k, j);
                if i == j {
                    sum += dilation[k];
                }
                if i == k {
                    sum += dilation[j];
                }
                chi[i][j][k] = 0.5 * d * sum;
            }
        }
    }
    chi
}

/// The law as a table: `law[c]` is χ, for modulus 1, of the gradient whose component `c` alone is 1
/// (components in the order ijk, the last index fastest).
pub(crate) fn unit_law<const D: usize>() -> Vec<Tensor3<D>> {
    (0..D * D * D)
        .map(|component| {
            let mut g = [[[0.0; D]; D]; D];
            g[component / (D * D)][component / D % D][component % D] = 1.0;
            double_stress(1.0, &g)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn matrix() -> DMatrix<f64> {
        let law = unit_law::<2>();
        DMatrix::from_fn(8, 8, |row, column| {
            law[column][row / 4][row / 2 % 2][row % 2]
        })
    }

    #[test]
    fn a_sign_lost_in_the_law_is_seen_in_its_table_and_eigenvalues() {
        let h = 0.5;
        let table = [
            [1.0, 0.0, 0.0, 0.0, 0.0, h, h, 0.0],
            [0.0, h, h, 0.0, -h, 0.0, 0.0, h],
            [0.0, h, h, 0.0, -h, 0.0, 0.0, h],
            [0.0, 0.0, 0.0, 1.0, 0.0, -h, -h, 0.0],
            [0.0, -h, -h, 0.0, 1.0, 0.0, 0.0, 0.0],
            [h, 0.0, 0.0, -h, 0.0, h, h, 0.0],
            [h, 0.0, 0.0, -h, 0.0, h, h, 0.0],
            [0.0, h, h, 0.0, 0.0, 0.0, 0.0, 1.0],
        ];
        let law = matrix();
        for row in 0..8 {
            for column in 0..8 {
                assert_eq!(law[(row, column)], table[row][column], "{row} {column}");
            }
        }
        let mut values: Vec<f64> = law.symmetric_eigen().eigenvalues.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        for (found, expected) in values.iter().zip([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0]) {
            assert!((found - expected).abs() < 1e-14, "{values:?}");
        }
    }

    #[test]
    fn turning_a_gradient_turns_its_double_stress() {
        let (sin, cos) = 0.4_f64.sin_cos();
        let r = [[cos, -sin], [sin, cos]];
        let mut g = [[[0.0; 2]; 2]; 2];
        for (number, value) in g.iter_mut().flatten().flatten().enumerate() {
            *value = (1.0 + number as f64).sin();
        }
        let turned = double_stress(3.0, &crate::tensor::rotate3(&r, &g));
        let expected = crate::tensor::rotate3(&r, &double_stress(3.0, &g));
        let pairs = turned
            .iter()
            .flatten()
            .flatten()
            .zip(expected.iter().flatten().flatten());
        for (found, expected) in pairs {
            assert!((found - expected).abs() < 1e-14);
        }
    }

    /// The energy ½ χ·g of a compatible g (symmetric in its last indices), in three dimensions too.
    fn energy_is_that_of_dilation_and_rotation<const D: usize>() {
        let second = |i: usize, j: usize, k: usize| {
            let (low, high) = (j.min(k), j.max(k));
            (1.0 + (9 * i + 3 * low + high) as f64).sin()
        };
        let mut g = [[[0.0; D]; D]; D];
        let mut expected = 0.0;
        for k in 0..D {
            let dilation: f64 = (0..D).map(|a| second(a, a, k)).sum();
            expected += 0.5 * dilation * dilation;
            for i in 0..D {
                for j in 0..D {
                    g[i][j][k] = second(i, j, k);
                    let rotation = second(j, i, k) - second(i, j, k);
                    // Each rotation component appears twice in the sum over i and j.
                    expected += 0.25 * rotation * rotation;
                }
            }
        }
        let chi = double_stress(1.0, &g);
        let pairs = chi
            .iter()
            .flatten()
            .flatten()
            .zip(g.iter().flatten().flatten());
        let energy: f64 = 0.5 * pairs.map(|(chi, g)| chi * g).sum::<f64>();
        assert!((energy - expected).abs() < 1e-13 * expected);
    }

    #[test]
    fn the_energy_is_that_of_the_gradients_of_dilation_and_rotation() {
        energy_is_that_of_dilation_and_rotation::<2>();
        energy_is_that_of_dilation_and_rotation::<3>();
    }
}
