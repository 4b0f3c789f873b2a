//! How the double stress turns with the material over a step.
//!
//! The Jaumann rate χ'_ijk = w_il χ_ljk + w_jl χ_ilk + w_kl χ_ijl, integrated by the midpoint rule of
//! Hughes and Winget (1980), which turns χ exactly with a rigid rotation of any size:
//!
//! M = H·(2I − H)⁻¹ (half the displacement gradient on the midpoint configuration, H = ∂u/∂x on the
//! current one), A = ½(M − Mᵀ), R = (I − A)⁻¹(I + A).
//!
//! Its derivative along L = grad(du): dM = ½(I − M)·L·(I + M), dA = ½(dM − dMᵀ) and
//! ω = dR·Rᵀ = 2 (I − A)⁻¹·dA·(I + A)⁻¹, skew as it must be.

use crate::tensor::{self, Tensor2, Tensor4};

/// The rotation of a step and what becomes of it along L.
#[derive(Clone, PartialEq, Debug)]
pub struct Spin<const D: usize> {
    /// R.
    pub rotation: Tensor2<D>,
    /// ω_ij = `derivative[i][j][k][l]` L_kl.
    pub derivative: Tensor4<D>,
}

impl<const D: usize> Spin<D> {
    /// From the displacement gradient H_ij = ∂u_i/∂x_j of the step on the current configuration;
    /// `None` where the step turns the material half round.
    pub fn new(h: &Tensor2<D>) -> Option<Self> {
        let unit = tensor::identity::<D>();
        let (_, midpoint) = tensor::determinant_and_inverse(&combine(2.0, &unit, -1.0, h));
        let m = tensor::product(h, &midpoint?);
        let a = combine(0.5, &m, -0.5, &tensor::transpose(&m));
        let (_, inverse) = tensor::determinant_and_inverse(&combine(1.0, &unit, -1.0, &a));
        let inverse = inverse?;
        let rotation = tensor::product(&inverse, &combine(1.0, &unit, 1.0, &a));
        let left = combine(0.5, &unit, -0.5, &m);
        let right = combine(1.0, &unit, 1.0, &m);
        let mut derivative = tensor::zero4::<D>();
        for k in 0..D {
            for l in 0..D {
                let mut dm = tensor::zero::<D>();
                for i in 0..D {
                    for j in 0..D {
                        dm[i][j] = left[i][k] * right[l][j];
                    }
                }
                let da = combine(0.5, &dm, -0.5, &tensor::transpose(&dm));
                let omega = tensor::rotate(&inverse, &da);
                for i in 0..D {
                    for j in 0..D {
                        derivative[i][j][k][l] = 2.0 * omega[i][j];
                    }
                }
            }
        }
        Some(Spin {
            rotation,
            derivative,
        })
    }
}

/// p·a + q·b.
fn combine<const D: usize>(p: f64, a: &Tensor2<D>, q: f64, b: &Tensor2<D>) -> Tensor2<D> {
    let mut result = tensor::zero();
    for i in 0..D {
        for j in 0..D {
            result[i][j] = p * a[i][j] + q * b[i][j];
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    /// H = I − F⁻¹.
    fn gradient<const D: usize>(f: &Tensor2<D>) -> Tensor2<D> {
        let (_, inverse) = tensor::determinant_and_inverse(f);
        combine(1.0, &tensor::identity(), -1.0, &inverse.expect("regular"))
    }

    #[test]
    fn a_rigid_rotation_of_any_size_is_found_exactly() {
        for angle in [1e-9, 0.3, 2.5] {
            let (s, c) = f64::sin_cos(angle);
            let turn = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
            let spin = Spin::new(&gradient(&turn)).expect("less than half round");
            for i in 0..3 {
                for j in 0..3 {
                    assert!((spin.rotation[i][j] - turn[i][j]).abs() < 1e-14);
                }
            }
        }
        assert_eq!(
            Spin::<2>::new(&tensor::zero()).expect("no motion").rotation,
            tensor::identity()
        );
    }

    #[test]
    fn the_derivative_of_the_rotation_agrees_with_differences() {
        let f = [[1.2, 0.3, -0.1], [0.5, 0.9, 0.2], [-0.3, 0.1, 1.05]];
        let spin = Spin::new(&gradient(&f)).expect("regular");
        let h = 1e-6;
        for k in 0..3 {
            for l in 0..3 {
                let moved = |sign: f64| {
                    let mut step = tensor::identity::<3>();
                    step[k][l] += sign * h;
                    let f = tensor::product(&step, &f);
                    Spin::new(&gradient(&f)).expect("regular").rotation
                };
                let slope = combine(0.5 / h, &moved(1.0), -0.5 / h, &moved(-1.0));
                let omega = tensor::product(&slope, &tensor::transpose(&spin.rotation));
                for i in 0..3 {
                    for j in 0..3 {
                        assert!((omega[i][j] - spin.derivative[i][j][k][l]).abs() < 1e-9);
                    }
                }
            }
        }
    }
}
