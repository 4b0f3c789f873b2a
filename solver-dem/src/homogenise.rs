//! From contacts to continuum quantities.

use crate::tensor::{Tensor2, Tensor4};

/// ½(t + tᵀ).
pub fn symmetric<const D: usize>(t: &Tensor2<D>) -> Tensor2<D> {
    let mut s = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            s[i][j] = 0.5 * (t[i][j] + t[j][i]);
        }
    }
    s
}

/// The largest component of the antisymmetric part over the mean stress |tr t|/D: it vanishes with
/// the balance of moments, so it tells the quality of an equilibrium. 0 for zero stress.
pub fn asymmetry<const D: usize>(t: &Tensor2<D>) -> f64 {
    let mean = crate::tensor::mean(t).abs();
    let mut largest: f64 = 0.0;
    for i in 0..D {
        for j in 0..D {
            largest = largest.max(0.5 * (t[i][j] - t[j][i]).abs());
        }
    }
    if largest == 0.0 { 0.0 } else { largest / mean }
}

/// A stress and its rate with the velocity gradient: C_ijkl = ∂σ_ij/∂L_kl with F → (1 + L)·F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homogenised<const D: usize> {
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<D>,
    /// All D⁴ components, rotation included; not symmetric in general.
    pub tangent: Tensor4<D>,
}
