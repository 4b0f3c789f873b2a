//! Fourier series of second order over directions, fitted to contacts.
//!
//! The directions of contacts and the mean forces in them (Rothenburg, Bathurst 1989):
//!
//! ```text
//! E(θ)   = 1/2π [1 + a_c cos 2(θ − θ_c)]
//! f_n(θ) =  f_0 [1 + a_n cos 2(θ − θ_n)]
//! f_t(θ) =  f_0      a_t sin 2(θ − θ_t)
//! ```

use serde::Serialize;

use crate::tensor::{Vector, invert};

/// cos 2θ and sin 2θ of the direction of a unit vector.
pub(super) fn double_angle(n: &Vector<2>) -> [f64; 2] {
    [n[0] * n[0] - n[1] * n[1], 2.0 * n[0] * n[1]]
}

/// m + c cos 2θ + s sin 2θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Harmonic {
    /// m, in units of the values.
    pub mean: f64,
    /// c, likewise.
    pub cosine: f64,
    /// s, likewise.
    pub sine: f64,
}

/// The shift of the normal equations over the number of contacts: where the directions leave a
/// coefficient open (a square lattice has sin 2θ = 0 throughout), the smallest solution comes out.
const SHIFT: f64 = 1e-12;

impl Harmonic {
    /// The least-squares fit to values in the directions of unit vectors; 0 without any.
    ///
    /// What is left over is orthogonal to 1, cos 2θ and sin 2θ, and the components of n ⊗ n and
    /// t ⊗ n are made of these: the fit gives Σ f n ⊗ n and Σ f t ⊗ n of the contacts exactly.
    pub fn fit(values: impl Iterator<Item = (Vector<2>, f64)>) -> Self {
        let mut gram = [[0.0; 3]; 3];
        let mut right = [0.0; 3];
        let mut count = 0.0;
        for (n, value) in values {
            let [cosine, sine] = double_angle(&n);
            let basis = [1.0, cosine, sine];
            for k in 0..3 {
                right[k] += value * basis[k];
                for l in 0..3 {
                    gram[k][l] += basis[k] * basis[l];
                }
            }
            count += 1.0;
        }
        for k in 0..3 {
            gram[k][k] += SHIFT * count;
        }
        let Some(inverse) = invert(&gram).1 else {
            return Self::default();
        };
        let [mean, cosine, sine] = crate::tensor::apply(&inverse, &right);
        Self { mean, cosine, sine }
    }

    /// Its value in the direction `theta`, radians from x.
    pub fn at(&self, theta: f64) -> f64 {
        self.mean + self.cosine * libm::cos(2.0 * theta) + self.sine * libm::sin(2.0 * theta)
    }
}

/// A departure from isotropy: a cos 2(θ − θ_a), or the sine for shear forces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Anisotropy {
    /// a ≥ 0.
    pub amplitude: f64,
    /// θ_a in radians from x, counter-clockwise, in (−π/2, π/2]; 0 where a = 0.
    pub direction: f64,
}

impl Anisotropy {
    /// From a cos 2θ_a and a sin 2θ_a.
    pub(super) fn from_double_angle([cosine, sine]: [f64; 2]) -> Self {
        Self {
            amplitude: libm::sqrt(cosine * cosine + sine * sine),
            direction: 0.5 * libm::atan2(sine, cosine),
        }
    }

    /// a cos 2θ_a and a sin 2θ_a, the form in which anisotropies of different directions add up.
    pub(super) fn double_angle(&self) -> [f64; 2] {
        let twice = 2.0 * self.direction;
        [
            self.amplitude * libm::cos(twice),
            self.amplitude * libm::sin(twice),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(count: u32) -> impl Iterator<Item = Vector<2>> {
        (0..count).map(move |k| {
            let theta = std::f64::consts::PI * (f64::from(k) + 0.3) / f64::from(count);
            [libm::cos(theta), libm::sin(theta)]
        })
    }

    #[test]
    fn a_fit_returns_the_series_its_values_were_made_of() {
        let values = around(7).map(|n| {
            let [cosine, sine] = double_angle(&n);
            (n, 2.0 + 0.5 * cosine - 0.25 * sine)
        });
        let fit = Harmonic::fit(values);
        assert!((fit.mean - 2.0).abs() < 1e-10 && (fit.cosine - 0.5).abs() < 1e-10);
        assert!((fit.sine + 0.25).abs() < 1e-10);
    }

    #[test]
    fn directions_that_leave_a_coefficient_open_do_not_blow_it_up() {
        // A square lattice, turned: cos 2θ and sin 2θ are multiples of each other.
        let square = [[0.8, 0.6], [-0.6, 0.8]];
        let fit = Harmonic::fit(square.into_iter().zip([3.0, 1.0]));
        assert!((fit.mean - 2.0).abs() < 1e-3, "{fit:?}");
        assert!(fit.cosine.hypot(fit.sine) < 1.001, "{fit:?}");
        assert_eq!(Harmonic::fit(std::iter::empty()), Harmonic::default());
    }
}
