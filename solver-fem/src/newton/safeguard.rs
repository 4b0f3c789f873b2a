//! Guard on tangents: near-singular or wild ones are blended towards the elastic tangent.
//!
//! M = E⁻¹C in the D(D+1)/2 symmetric strains must have Re λ > 0.01 and ‖M‖ < 3. Blending
//! C ← (1−w) C + w E moves every eigenvalue to (1−w) λ + w, hence the exact
//! w ≥ (0.01 − Re λ)/(1 − Re λ); and ‖(1−w) M + w I‖ ≤ (1−w) ‖M‖ + w gives w ≥ (‖M‖ − 3)/(‖M‖ − 1).
//!
//! Only the symmetric part is judged and blended. Against a rotation E is singular, or holds just
//! the turning of the initial stress: E⁻¹ does not exist there, and the exact turning of the
//! present stress, which C has in these columns, must not be diluted.
//!
//! A positive symmetric part is **not** asked for: the material is non-associated, nearly every
//! point would be clipped and convergence become linear.

use nalgebra::{DMatrix, Schur};
use serde::{Deserialize, Serialize};

use crate::tensor::Tensor4;

/// Bounds on E⁻¹C.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Safeguard {
    /// Smallest real part of an eigenvalue. 0.01: a hundred times softer than elastic. One
    /// near-singular REV in 128 ruins an unguarded step.
    pub smallest_eigenvalue: f64,
    /// Largest spectral norm. 3: nothing physical is three times stiffer than elastic.
    pub largest_norm: f64,
}

impl Default for Safeguard {
    fn default() -> Self {
        Safeguard {
            smallest_eigenvalue: 0.01,
            largest_norm: 3.0,
        }
    }
}

/// What the guard did to a tangent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Safeguarded {
    /// Used as it is.
    Untouched,
    /// Blended with this weight of the elastic tangent, 0 < w ≤ 1.
    Blended(f64),
}

/// Orthonormal basis of the symmetric tensors: diagonal, then (e_i e_j + e_j e_i)/√2.
fn basis<const D: usize>() -> Vec<(usize, usize)> {
    let shear = (0..D).flat_map(|i| (i + 1..D).map(move |j| (i, j)));
    (0..D).map(|i| (i, i)).chain(shear).collect()
}

fn coefficient(pair: (usize, usize)) -> f64 {
    if pair.0 == pair.1 {
        0.5
    } else {
        std::f64::consts::FRAC_1_SQRT_2
    }
}

/// B_m : C : B_n for the basis B of symmetric tensors.
fn symmetric_part<const D: usize>(c: &Tensor4<D>) -> DMatrix<f64> {
    let basis = basis::<D>();
    DMatrix::from_fn(basis.len(), basis.len(), |m, n| {
        let ((i, j), (k, l)) = (basis[m], basis[n]);
        let sum = c[i][j][k][l] + c[i][j][l][k] + c[j][i][k][l] + c[j][i][l][k];
        sum * coefficient(basis[m]) * coefficient(basis[n])
    })
}

/// Adds Σ a_mn B_m ⊗ B_n to C.
fn add_symmetric<const D: usize>(c: &mut Tensor4<D>, a: &DMatrix<f64>) {
    let basis = basis::<D>();
    for (m, &(i, j)) in basis.iter().enumerate() {
        for (n, &(k, l)) in basis.iter().enumerate() {
            let value = a[(m, n)] * coefficient(basis[m]) * coefficient(basis[n]);
            // For a diagonal pair both terms fall on the same entry: 2·½ = 1.
            for (p, q) in [(i, j), (j, i)] {
                for (r, s) in [(k, l), (l, k)] {
                    c[p][q][r][s] += value;
                }
            }
        }
    }
}

/// Blends `tangent` towards `elastic` (initial elastic tangent) as far as the bounds ask. A tangent
/// that cannot be judged, or an elastic one that cannot be inverted, is replaced or left alone.
pub fn safeguard<const D: usize>(
    tangent: &mut Tensor4<D>,
    elastic: &Tensor4<D>,
    bounds: &Safeguard,
) -> Safeguarded {
    let (c, e) = (symmetric_part(tangent), symmetric_part(elastic));
    let Some(m) = e.clone().lu().solve(&c) else {
        return Safeguarded::Untouched;
    };
    let weight = weight(&m, bounds);
    if weight == 0.0 {
        return Safeguarded::Untouched;
    }
    if c.iter().any(|value| !value.is_finite()) {
        *tangent = *elastic;
        return Safeguarded::Blended(1.0);
    }
    add_symmetric(tangent, &((e - c) * weight));
    Safeguarded::Blended(weight)
}

fn weight(m: &DMatrix<f64>, bounds: &Safeguard) -> f64 {
    if m.iter().any(|value| !value.is_finite()) {
        return 1.0;
    }
    // A bounded number of iterations: a matrix the method cannot settle is not to be trusted.
    let Some(schur) = Schur::try_new(m.clone(), f64::EPSILON, 500) else {
        return 1.0;
    };
    let smallest = schur
        .complex_eigenvalues()
        .iter()
        .map(|lambda| lambda.re)
        .fold(f64::INFINITY, f64::min);
    let mut weight: f64 = 0.0;
    let floor = bounds.smallest_eigenvalue;
    if smallest < floor {
        weight = (floor - smallest) / (1.0 - smallest);
    }
    let norm = nalgebra::SymmetricEigen::try_new(m.transpose() * m, f64::EPSILON, 500)
        .map_or(f64::INFINITY, |eigen| {
            eigen.eigenvalues.max().max(0.0).sqrt()
        });
    if norm > bounds.largest_norm {
        let needed = (norm - bounds.largest_norm) / (norm - 1.0);
        weight = weight.max(if needed.is_finite() { needed } else { 1.0 });
    }
    weight.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastic::Elastic;
    use crate::tensor::{flatten4, zero4};

    fn elastic() -> Tensor4<2> {
        Elastic::new(100.0, 0.25).expect("stable").tangent()
    }

    fn ratio(c: &Tensor4<2>) -> DMatrix<f64> {
        symmetric_part(&elastic())
            .lu()
            .solve(&symmetric_part(c))
            .expect("regular")
    }

    #[test]
    fn the_symmetric_basis_is_orthonormal() {
        let mut back = zero4::<2>();
        add_symmetric(&mut back, &symmetric_part(&elastic()));
        for (a, b) in flatten4([&back]).iter().zip(flatten4([&elastic()])) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn a_softening_tangent_is_lifted_just_above_singular() {
        let mut c = elastic();
        c[0][1][0][1] = -5.0;
        c[0][1][1][0] = -5.0;
        c[1][0][0][1] = -5.0;
        c[1][0][1][0] = -5.0;
        let done = safeguard(&mut c, &elastic(), &Safeguard::default());
        assert!(matches!(done, Safeguarded::Blended(w) if w > 0.0 && w < 0.5));
        let smallest = ratio(&c)
            .complex_eigenvalues()
            .iter()
            .map(|l| l.re)
            .fold(9.0, f64::min);
        assert!((smallest - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_non_associated_but_stable_tangent_is_left_alone() {
        // Symmetric part indefinite, eigenvalues of E⁻¹C positive.
        let mut c = elastic();
        c[0][0][1][1] += 150.0;
        c[1][1][0][0] = 0.0;
        let before = c;
        assert_eq!(
            safeguard(&mut c, &elastic(), &Safeguard::default()),
            Safeguarded::Untouched
        );
        assert_eq!(c, before);
    }

    #[test]
    fn a_wild_tangent_is_bounded_and_the_rotation_columns_stay_exact() {
        let law = Elastic::new(100.0, 0.25).expect("stable");
        let mut c = law.tangent_at(&[[-3.0, 1.0], [1.0, -9.0]]);
        let spin = |c: &Tensor4<2>| {
            [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| c[i][j][0][1] - c[i][j][1][0])
        };
        let before = spin(&c);
        c[0][0][0][0] += 1e4;
        assert!(matches!(
            safeguard(&mut c, &elastic(), &Safeguard::default()),
            Safeguarded::Blended(_)
        ));
        assert!(ratio(&c).singular_values().max() <= 3.0 + 1e-12);
        for (a, b) in before.iter().zip(spin(&c)) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn a_nan_tangent_is_not_accepted_silently() {
        let mut c = elastic();
        c[0][0][0][0] = f64::NAN;
        assert_eq!(
            safeguard(&mut c, &elastic(), &Safeguard::default()),
            Safeguarded::Blended(1.0)
        );
        assert_eq!(c, elastic());
    }
}
