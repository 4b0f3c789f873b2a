//! The equations of second gradient at a Gauss point, and their exact linearisation.
//!
//! Weak form on the current configuration, with T = σ − λ and H = ∂u/∂x (Chambon, Caillerie and
//! Matsushima 2001; Collin, Chambon and Charlier 2006):
//!
//! ∫ [ T_ij u*_{i,j} + χ_ijk v*_{ij,k} + λ_ij v*_ij + (H_ij − v_ij) λ*_ij ] dv − P* = 0.
//!
//! χ = R·χ_n + law(v_{ij,k}): the committed double stress turned with the step ([`Spin`]), and the
//! [law](super::law) of the increment. Along L = grad(du), dv and dλ, per unit of current volume:
//!
//! - u*_{i,j} [ dσ_ij − T_ik L_jk + T_ij L_mm − dλ_ij ];
//! - v*_{ij,m} [ dχ_ijm − χ_ijl L_ml + χ_ijm L_kk ] + v*_ij [ dλ_ij + λ_ij L_kk ];
//! - λ*_ij [ L_ij − H_ik L_kj − dv_ij + (H_ij − v_ij) L_kk ];
//! - dχ_ijm = law( dv_{ij,m} − v_{ij,k} L_km ) + ω_ip χᴿ_pjm + ω_jp χᴿ_ipm + ω_mp χᴿ_ijp, χᴿ = R·χ_n.
//!
//! The first line is the tangent of a plain element with T in the place of σ, less dλ; it is
//! assembled with it. The others are [`Linearisation`].

use super::law::double_stress;
use super::spin::Spin;
use crate::tensor::{self, Tensor2, Tensor3, Tensor4};

/// What the fields are at a Gauss point.
#[derive(Clone, PartialEq, Debug)]
pub struct PointFields<const D: usize> {
    /// Displacement gradient H_ij = ∂u_i/∂x_j of the step, on the current configuration.
    pub displacement_gradient: Tensor2<D>,
    /// v_ij.
    pub gradient: Tensor2<D>,
    /// v_ij,k on the current configuration; 1/length.
    pub slope: Tensor3<D>,
    /// λ_ij; stress.
    pub multiplier: Tensor2<D>,
    /// χ at the beginning of the step; stress × length.
    pub double_stress_before: Tensor3<D>,
    /// The modulus D; stress × length².
    pub modulus: f64,
}

/// What does work at a Gauss point.
#[derive(Clone, PartialEq, Debug)]
pub struct Point<const D: usize> {
    fields: PointFields<D>,
    spin: Spin<D>,
    /// χᴿ.
    turned: Tensor3<D>,
    /// χ, which works on v*_{ij,k}; stress × length.
    pub double_stress: Tensor3<D>,
    /// H − v, which works on λ*.
    pub mismatch: Tensor2<D>,
}

/// Derivatives along L = grad(du).
#[derive(Clone, PartialEq, Debug)]
pub struct Linearisation<const D: usize> {
    /// `double_stress[i][j][m][k][l]`: of the factor of v*_{ij,m}, at dv = 0.
    pub double_stress: [Tensor4<D>; D],
    /// `multiplier[i][j][k][l]`: of the factor of v*_ij.
    pub multiplier: Tensor4<D>,
    /// `mismatch[i][j][k][l]`: of the factor of λ*_ij.
    pub mismatch: Tensor4<D>,
}

impl<const D: usize> Point<D> {
    /// `None` where the step turns the material half round.
    pub fn new(fields: PointFields<D>) -> Option<Self> {
        let spin = Spin::new(&fields.displacement_gradient)?;
        let turned = tensor::rotate3(&spin.rotation, &fields.double_stress_before);
        let mut chi = double_stress(fields.modulus, &fields.slope);
        let mut mismatch = tensor::zero();
        for i in 0..D {
            for j in 0..D {
                mismatch[i][j] = fields.displacement_gradient[i][j] - fields.gradient[i][j];
                for k in 0..D {
                    chi[i][j][k] += turned[i][j][k];
                }
            }
        }
        Some(Point {
            fields,
            spin,
            turned,
            double_stress: chi,
            mismatch,
        })
    }

    /// λ, which works on v*.
    pub fn multiplier(&self) -> &Tensor2<D> {
        &self.fields.multiplier
    }

    /// H.
    pub fn displacement_gradient(&self) -> &Tensor2<D> {
        &self.fields.displacement_gradient
    }

    /// The derivatives of everything but the force row.
    pub fn linearise(&self) -> Linearisation<D> {
        let (fields, chi) = (&self.fields, &self.double_stress);
        let mut result = Linearisation {
            double_stress: [tensor::zero4(); D],
            multiplier: tensor::zero4(),
            mismatch: tensor::zero4(),
        };
        for k in 0..D {
            for l in 0..D {
                let dchi = self.double_stress_along(k, l);
                for i in 0..D {
                    for j in 0..D {
                        for m in 0..D {
                            let mut value = dchi[i][j][m];
                            // −χ_ijp L_mp with L_kl alone.
                            if m == k {
                                value -= chi[i][j][l];
                            }
                            if k == l {
                                value += chi[i][j][m];
                            }
                            result.double_stress[i][j][m][k][l] = value;
                        }
                        let mut value = 0.0;
                        if j == l {
                            value -= fields.displacement_gradient[i][k];
                            if i == k {
                                value += 1.0;
                            }
                        }
                        if k == l {
                            value += self.mismatch[i][j];
                            result.multiplier[i][j][k][l] = fields.multiplier[i][j];
                        }
                        result.mismatch[i][j][k][l] = value;
                    }
                }
            }
        }
        result
    }

    /// dχ for L_kl = 1 alone, at dv = 0.
    fn double_stress_along(&self, k: usize, l: usize) -> Tensor3<D> {
        let mut slope = [[[0.0; D]; D]; D];
        for a in 0..D {
            for b in 0..D {
                // −v_ab,p L_pc.
                slope[a][b][l] = -self.fields.slope[a][b][k];
            }
        }
        let mut dchi = double_stress(self.fields.modulus, &slope);
        let omega = |i: usize, p: usize| self.spin.derivative[i][p][k][l];
        for i in 0..D {
            for j in 0..D {
                for m in 0..D {
                    for p in 0..D {
                        dchi[i][j][m] += omega(i, p) * self.turned[p][j][m]
                            + omega(j, p) * self.turned[i][p][m]
                            + omega(m, p) * self.turned[i][j][p];
                    }
                }
            }
        }
        dchi
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unstructured numbers of size 1, another list for every `seed`.
    fn fill<'a>(values: impl Iterator<Item = &'a mut f64>, seed: f64) {
        for (number, value) in values.enumerate() {
            *value = (seed + 1.7 * number as f64).sin();
        }
    }

    fn second(seed: f64, size: f64) -> Tensor2<2> {
        let mut t = tensor::zero::<2>();
        fill(t.iter_mut().flatten(), seed);
        t.map(|row| row.map(|x| size * x))
    }

    fn third(seed: f64) -> Tensor3<2> {
        let mut t = [[[0.0; 2]; 2]; 2];
        fill(t.iter_mut().flatten().flatten(), seed);
        t
    }

    fn contract2(a: &Tensor2<2>, b: &Tensor2<2>) -> f64 {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.map(|(a, b)| a * b).sum()
    }

    fn contract3(a: &Tensor3<2>, b: &Tensor3<2>) -> f64 {
        (0..2).map(|i| contract2(&a[i], &b[i])).sum()
    }

    /// The virtual power after the motion x → x + e·L·x, v → v + e·dv, λ → λ + e·dλ, per volume
    /// before it, the virtual fields being carried by the material.
    fn power(e: f64) -> f64 {
        let mut step = second(9.0, e);
        for i in 0..2 {
            step[i][i] += 1.0;
        }
        let (volume, inverse) = tensor::determinant_and_inverse(&step);
        let inverse = inverse.expect("a small motion");
        let carried = |t: &Tensor3<2>| {
            let mut moved = [[[0.0; 2]; 2]; 2];
            for i in 0..2 {
                moved[i] = tensor::product(&t[i], &inverse);
            }
            moved
        };
        let mut fields = fields();
        // H = I − F⁻¹ and F → (I + eL)·F.
        let mut rest = tensor::identity::<2>();
        for i in 0..2 {
            for j in 0..2 {
                rest[i][j] -= fields.displacement_gradient[i][j];
                fields.gradient[i][j] += e * second(5.0, 1.0)[i][j];
                fields.multiplier[i][j] += e * second(6.0, 1.0)[i][j];
                for k in 0..2 {
                    fields.slope[i][j][k] += e * third(7.0)[i][j][k];
                }
            }
        }
        let rest = tensor::product(&rest, &inverse);
        for i in 0..2 {
            for j in 0..2 {
                fields.displacement_gradient[i][j] = if i == j { 1.0 } else { 0.0 } - rest[i][j];
            }
        }
        fields.slope = carried(&fields.slope);
        let point = Point::new(fields).expect("no half turn");
        volume
            * (contract3(&point.double_stress, &carried(&third(11.0)))
                + contract2(point.multiplier(), &second(12.0, 1.0))
                + contract2(&point.mismatch, &second(13.0, 1.0)))
    }

    fn fields() -> PointFields<2> {
        PointFields {
            displacement_gradient: second(1.0, 0.2),
            gradient: second(2.0, 0.2),
            slope: third(3.0),
            multiplier: second(4.0, 1.0),
            double_stress_before: third(5.0),
            modulus: 0.7,
        }
    }

    #[test]
    fn a_missing_term_of_the_linearisation_is_seen() {
        let point = Point::new(fields()).expect("no half turn");
        let along = point.linearise();
        let l = second(9.0, 1.0);
        let apply = |operator: &Tensor4<2>, i: usize, j: usize| contract2(&operator[i][j], &l);
        let (doubled, single) = (third(11.0), second(12.0, 1.0));
        let of_dv = double_stress(0.7, &third(7.0));
        let mut predicted = contract3(&of_dv, &doubled) + contract2(&second(6.0, 1.0), &single);
        predicted -= contract2(&second(5.0, 1.0), &second(13.0, 1.0));
        for i in 0..2 {
            for j in 0..2 {
                predicted += apply(&along.multiplier, i, j) * single[i][j]
                    + apply(&along.mismatch, i, j) * second(13.0, 1.0)[i][j];
                for m in 0..2 {
                    predicted += contract2(&along.double_stress[i][j][m], &l) * doubled[i][j][m];
                }
            }
        }
        let h = 1e-5;
        let difference = (power(h) - power(-h)) / (2.0 * h);
        assert!(
            (difference - predicted).abs() < 1e-8 * predicted.abs(),
            "{difference} against {predicted}"
        );
    }
}
