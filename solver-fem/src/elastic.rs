//! Isotropic hypoelastic law in the same form as a REV: state = Cauchy stress.
//!
//! With F = V·R (polar decomposition) and h = log V the logarithmic strain of the step:
//! σ' = R·σ·Rᵀ + λ tr(h) I + 2G h.
//! A rigid rotation rotates the stress exactly; the strain measure is the true logarithmic one, so
//! that the law stays invertible at any compression.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::constitutive::{ConstitutiveResponse, Smoothness};
use crate::tensor::{self, Tensor2, Tensor4};

/// Isotropic elastic constants.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct Elastic {
    /// First Lamé constant λ (stress).
    pub lambda: f64,
    /// Shear modulus G (stress).
    pub shear: f64,
}

/// The elastic law cannot be set up or evaluated.
#[derive(Error, Clone, Copy, PartialEq, Debug)]
pub enum ElasticError {
    /// The constants do not describe a stable material.
    #[error(
        "set up the elastic law: Young's modulus {young} must be positive and Poisson's ratio {poisson} between -1 and 0.5"
    )]
    Unstable {
        /// Young's modulus E.
        young: f64,
        /// Poisson's ratio ν.
        poisson: f64,
    },
    /// The deformation turns the material inside out.
    #[error("evaluate the elastic law: the deformation gradient has determinant {determinant}")]
    Inverted {
        /// Its determinant.
        determinant: f64,
    },
}

impl Elastic {
    /// From Young's modulus E (stress) and Poisson's ratio ν, three-dimensional meaning: in plane
    /// strain λ = Eν/((1+ν)(1−2ν)), G = E/(2(1+ν)).
    ///
    /// # Errors
    /// E ≤ 0, or ν outside (−1, 0.5).
    pub fn new(young: f64, poisson: f64) -> Result<Self, ElasticError> {
        let stable = young > 0.0 && young.is_finite() && poisson > -1.0 && poisson < 0.5;
        if !stable {
            return Err(ElasticError::Unstable { young, poisson });
        }
        Ok(Elastic {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            shear: young / (2.0 * (1.0 + poisson)),
        })
    }

    /// The constants that make plane strain answer like plane stress at small strain:
    /// λ* = 2λG/(λ + 2G).
    pub fn plane_stress_equivalent(self) -> Self {
        let Elastic { lambda, shear } = self;
        Elastic {
            lambda: 2.0 * lambda * shear / (lambda + 2.0 * shear),
            shear,
        }
    }

    /// Tangent of the unstressed material: λ δ_ij δ_kl + G (δ_ik δ_jl + δ_il δ_jk).
    pub fn tangent<const D: usize>(&self) -> Tensor4<D> {
        let mut c = tensor::zero4::<D>();
        for i in 0..D {
            for j in 0..D {
                c[i][i][j][j] += self.lambda;
                c[i][j][i][j] += self.shear;
                c[i][j][j][i] += self.shear;
            }
        }
        c
    }

    /// Elastic tangent at a stress σ, rotation included: the response to (I + L) with small L.
    pub fn tangent_at<const D: usize>(&self, stress: &Tensor2<D>) -> Tensor4<D> {
        let mut c = self.tangent::<D>();
        add_rotation(&mut c, stress, |i, k| if i == k { 0.0 } else { 0.5 });
        c
    }

    /// σ' and both tangents for a step `f` from the Cauchy stress `stress`.
    ///
    /// # Errors
    /// det F ≤ 0, or F not finite.
    pub fn respond<const D: usize>(
        &self,
        stress: &Tensor2<D>,
        f: &Tensor2<D>,
    ) -> Result<ConstitutiveResponse<D>, ElasticError> {
        let determinant = tensor::determinant(f);
        if !(determinant > 0.0 && determinant.is_finite()) {
            return Err(ElasticError::Inverted { determinant });
        }
        // b = F·Fᵀ = V², so that V, V⁻¹ and log V share the eigenvectors of b. From b − I, with
        // F = I + H: b − I = H + Hᵀ + H·Hᵀ keeps the digits of small strains.
        let mut h = *f;
        for i in 0..D {
            h[i][i] -= 1.0;
        }
        let mut excess = tensor::product(&h, &tensor::transpose(&h));
        for i in 0..D {
            for j in 0..D {
                excess[i][j] += h[i][j] + h[j][i];
            }
        }
        let (excess, axes) = tensor::symmetric_eigen(&excess);
        let squares = excess.map(|e| 1.0 + e);
        if squares.iter().any(|&s| s <= 0.0) {
            return Err(ElasticError::Inverted { determinant });
        }
        let inverse_stretch = tensor::from_eigen(&squares.map(|s| 1.0 / s.sqrt()), &axes);
        let log_stretch = tensor::from_eigen(&excess.map(|e| 0.5 * libm::log1p(e)), &axes);
        let rotation = tensor::product(&inverse_stretch, f);
        let rotated = tensor::rotate(&rotation, stress);

        let mut result = rotated;
        let volumetric = self.lambda * tensor::trace(&log_stretch);
        for i in 0..D {
            result[i][i] += volumetric;
            for j in 0..D {
                result[i][j] += 2.0 * self.shear * log_stretch[i][j];
            }
        }
        Ok(ConstitutiveResponse {
            stress: result,
            tangent: self.algorithmic_tangent(&squares, &axes, &rotated),
            elastic_tangent: self.tangent_at(&result),
            smooth: Smoothness::Smooth,
        })
    }

    /// Exact derivative, in the eigenframe of V (stretches v_a, L_ab the components of L there):
    /// δh_ab = ½ (ln v_a² − ln v_b²)/(v_a² − v_b²) · (L_ab v_b² + L_ba v_a²),
    /// Ω_ab = (L_ab v_b − L_ba v_a)/(v_a + v_b), δσ = Ω·σ_R − σ_R·Ω + λ tr(δh) I + 2G δh,
    /// σ_R = R·σ·Rᵀ. Both follow from δF = L·F with b = V² and F = V·R.
    fn algorithmic_tangent<const D: usize>(
        &self,
        squares: &[f64; D],
        axes: &Tensor2<D>,
        rotated: &Tensor2<D>,
    ) -> Tensor4<D> {
        let local_stress = tensor::rotate(&tensor::transpose(axes), rotated);
        let mut local = tensor::zero4::<D>();
        for a in 0..D {
            for b in 0..D {
                let slope = 0.5 * divided_logarithm(squares[a], squares[b]);
                local[a][b][a][b] += 2.0 * self.shear * slope * squares[b];
                local[a][b][b][a] += 2.0 * self.shear * slope * squares[a];
            }
            // tr δh = L_kk: the logarithmic volume strain is exact for any stretch.
            for k in 0..D {
                local[a][a][k][k] += self.lambda;
            }
        }
        let stretches = squares.map(f64::sqrt);
        add_rotation(&mut local, &local_stress, |a, b| {
            if a == b {
                0.0
            } else {
                stretches[b] / (stretches[a] + stretches[b])
            }
        });
        to_global(&local, axes)
    }
}

/// Adds the derivative of Ω·σ − σ·Ω with Ω_ab = w(a,b) L_ab − w(b,a) L_ba.
fn add_rotation<const D: usize>(
    c: &mut Tensor4<D>,
    stress: &Tensor2<D>,
    weight: impl Fn(usize, usize) -> f64,
) {
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                let (left, right) = (weight(i, k), weight(k, i));
                c[i][j][i][k] += left * stress[k][j];
                c[i][j][k][i] -= right * stress[k][j];
                let (left, right) = (weight(k, j), weight(j, k));
                c[i][j][k][j] -= left * stress[i][k];
                c[i][j][j][k] += right * stress[i][k];
            }
        }
    }
}

/// (ln a − ln b)/(a − b), accurate for a → b where the quotient loses all digits.
fn divided_logarithm(a: f64, b: f64) -> f64 {
    let d = (a - b) / (a + b);
    // ln(a/b) = 2 artanh(d).
    let ratio = if d.abs() < 1e-2 {
        let s = d * d;
        1.0 + s * (1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s / 9.0)))
    } else {
        0.5 * libm::log(a / b) / d
    };
    2.0 * ratio / (a + b)
}

/// c_ijkl = q_ia q_jb q_kc q_ld local_abcd, one index at a time.
fn to_global<const D: usize>(local: &Tensor4<D>, axes: &Tensor2<D>) -> Tensor4<D> {
    let mut result = *local;
    // Turning the first index and cycling the four of them, four times over, turns them all.
    for _ in 0..4 {
        let mut turned = tensor::zero4::<D>();
        for a in 0..D {
            for b in 0..D {
                for c in 0..D {
                    for d in 0..D {
                        for i in 0..D {
                            turned[b][c][d][i] += axes[i][a] * result[a][b][c][d];
                        }
                    }
                }
            }
        }
        result = turned;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> Elastic {
        Elastic::new(100.0, 0.3).expect("stable")
    }

    /// dσ/dL by central differences with F → (I + L)·F.
    fn by_differences<const D: usize>(stress: &Tensor2<D>, f: &Tensor2<D>) -> Tensor4<D> {
        let h = 1e-5;
        let mut c = tensor::zero4::<D>();
        for k in 0..D {
            for l in 0..D {
                let moved = |sign: f64| {
                    let mut step = tensor::identity::<D>();
                    step[k][l] += sign * h;
                    law()
                        .respond(stress, &tensor::product(&step, f))
                        .expect("regular")
                        .stress
                };
                let (up, down) = (moved(1.0), moved(-1.0));
                for i in 0..D {
                    for j in 0..D {
                        c[i][j][k][l] = (up[i][j] - down[i][j]) / (2.0 * h);
                    }
                }
            }
        }
        c
    }

    fn assert_close<const D: usize>(a: &Tensor4<D>, b: &Tensor4<D>) {
        let (a, b) = (tensor::flatten4([a]), tensor::flatten4([b]));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 2e-7, "{a} against {b}");
        }
    }

    #[test]
    fn the_tangent_agrees_with_differences_at_large_strain_and_rotation() {
        let stress = [[-3.0, 0.7], [0.7, -8.0]];
        for f in [
            [[1.0, 0.0], [0.0, 1.0]],
            [[1.3, 0.4], [-0.2, 0.7]],
            [[0.0, -1.0], [1.0, 0.0]],
            [[1.0 + 1e-7, 0.0], [0.0, 1.0]],
        ] {
            let response = law().respond(&stress, &f).expect("regular");
            assert_close(&response.tangent, &by_differences(&stress, &f));
            let end = by_differences(&response.stress, &tensor::identity());
            assert_close(&response.elastic_tangent, &end);
        }
        let stress = [[-3.0, 0.7, 0.1], [0.7, -8.0, 2.0], [0.1, 2.0, -1.0]];
        let f = [[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [-0.3, 0.1, 1.05]];
        let response = law().respond(&stress, &f).expect("regular");
        assert_close(&response.tangent, &by_differences(&stress, &f));
    }

    #[test]
    fn a_rigid_rotation_turns_the_stress_and_strains_nothing() {
        let (s, c) = 0.5_f64.sin_cos();
        let rotation = [[c, -s], [s, c]];
        let stress = [[-3.0, 0.7], [0.7, -8.0]];
        let found = law().respond(&stress, &rotation).expect("regular").stress;
        let expected = tensor::rotate(&rotation, &stress);
        for i in 0..2 {
            for j in 0..2 {
                assert!((found[i][j] - expected[i][j]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn impossible_constants_and_deformations_are_errors() {
        assert!(Elastic::new(-1.0, 0.3).is_err());
        assert!(Elastic::new(1.0, 0.5).is_err());
        assert!(Elastic::new(f64::NAN, 0.3).is_err());
        let zero = [[0.0; 2]; 2];
        assert!(law().respond(&zero, &[[-1.0, 0.0], [0.0, 1.0]]).is_err());
        assert!(
            law()
                .respond(&zero, &[[f64::NAN, 0.0], [0.0, 1.0]])
                .is_err()
        );
    }
}
