//! Figures that sum up the contacts of a REV.

use serde::Serialize;

use super::{
    Anatomy,
    fourier::{Anisotropy, Harmonic, double_angle},
};
use crate::tensor::Tensor2;

/// Moments of the distribution of normal forces over contacts; shapes are those of f_n over its mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForceMoments {
    /// ⟨f_n⟩, force.
    pub mean: f64,
    /// √⟨(f_n − ⟨f_n⟩)²⟩/⟨f_n⟩.
    pub variation: f64,
    /// Third standardised moment; 0 where all forces are equal.
    pub skewness: f64,
    /// Fourth standardised moment (3 for a normal distribution); 0 where all forces are equal.
    pub kurtosis: f64,
    /// The largest f_n over ⟨f_n⟩.
    pub largest: f64,
}

/// What is known of a REV beside stress and volume. Angles are in radians from x, counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// N.
    pub grains: u32,
    /// N_c: closed contacts.
    pub contacts: u32,
    /// z = 2 N_c/N.
    pub coordination: f64,
    /// z* = (2 N_c − N_1)/(N − N_0 − N_1) with N_k grains of k contacts: the grains that carry load (Thornton 2000).
    /// `None` where none does.
    pub backbone_coordination: Option<f64>,
    /// Grains with fewer than two contacts, N_0 + N_1.
    pub rattlers: u32,
    /// Contacts at the friction bound over all contacts; 0 without contacts.
    pub sliding_fraction: f64,
    /// Contacts under tension over all contacts; 0 without contacts.
    pub tensile_fraction: f64,
    /// φ = ⟨n ⊗ n⟩, trace 1; 0 without contacts.
    pub fabric: Tensor2<2>,
    /// a_c and θ_c.
    pub contact_anisotropy: Anisotropy,
    /// f_n(θ), force.
    pub normal_fit: Harmonic,
    /// f_t(θ), force: of j on i along (−n_y, n_x).
    pub shear_fit: Harmonic,
    /// a_n and θ_n. `None` where f_0 ≤ 0, which cohesion makes possible.
    pub normal_anisotropy: Option<Anisotropy>,
    /// a_t and θ_t, likewise.
    pub shear_anisotropy: Option<Anisotropy>,
    /// Moments of the normal forces. `None` where their mean is not positive.
    pub normal_forces: Option<ForceMoments>,
    /// p = −tr σ/2, positive in compression.
    pub pressure: f64,
    /// q/p = (σ1 − σ2)/(σ1 + σ2), with the direction of the larger compression. `None` where p ≤ 0.
    pub stress_ratio: Option<Anisotropy>,
    /// What the anisotropies make of q/p, by [`stress_force_fabric`].
    pub ratio_from_anisotropies: Option<Anisotropy>,
}

/// q/p and its direction from a_c, a_n and a_t: stress–force–fabric (Rothenburg, Bathurst 1989).
///
/// The series of second order in σ = N_c/V ∫ f(θ) ⊗ l E(θ) dθ, with branches of one mean length, give
///
/// ```text
/// (σ1 − σ2)/(σ1 + σ2) = ½ (a_c + a_n + a_t) / (1 + ½ a_c a_n)
/// ```
///
/// where directions coincide; where they do not, the anisotropies add and multiply as vectors a (cos 2θ_a, sin 2θ_a).
/// The denominator is often left out: at a_c = 0.3, a_n = 0.5 it is 1.075.
pub fn stress_force_fabric(
    contact: &Anisotropy,
    normal: &Anisotropy,
    shear: &Anisotropy,
) -> Anisotropy {
    let [c, n, t] = [contact, normal, shear].map(Anisotropy::double_angle);
    let mean = 1.0 + 0.5 * (c[0] * n[0] + c[1] * n[1]);
    Anisotropy::from_double_angle([0, 1].map(|k| 0.5 * (c[k] + n[k] + t[k]) / mean))
}

impl Anatomy {
    /// The statistics of all contacts.
    pub fn statistics(&self) -> Statistics {
        let grains = self.grains.len();
        let total = self.contacts.len();
        let share = |count: usize| {
            if total == 0 {
                0.0
            } else {
                count as f64 / total as f64
            }
        };
        let count = |contacts: u32| {
            self.grains
                .iter()
                .filter(|g| g.contacts == contacts)
                .count()
        };
        let (alone, single) = (count(0), count(1));
        let carrying = grains - alone - single;
        let normal_fit = self.fit(|contact| contact.normal_force);
        let shear_fit = self.fit(|contact| contact.tangential_force);
        let base = normal_fit.mean;
        let over_base = |[cosine, sine]: [f64; 2]| {
            (base > 0.0).then(|| Anisotropy::from_double_angle([cosine / base, sine / base]))
        };
        let (fabric, contact_anisotropy) = self.fabric();
        let normal_anisotropy = over_base([normal_fit.cosine, normal_fit.sine]);
        // sin 2(θ − θ_t) = sin 2θ cos 2θ_t − cos 2θ sin 2θ_t.
        let shear_anisotropy = over_base([shear_fit.sine, -shear_fit.cosine]);
        let ratio_from_anisotropies = normal_anisotropy
            .zip(shear_anisotropy)
            .map(|(normal, shear)| stress_force_fabric(&contact_anisotropy, &normal, &shear));
        let pressure = -crate::tensor::mean(&self.stress);
        Statistics {
            grains: grains as u32,
            contacts: total as u32,
            coordination: 2.0 * total as f64 / grains.max(1) as f64,
            backbone_coordination: (carrying > 0)
                .then(|| (2 * total - single) as f64 / carrying as f64),
            rattlers: (alone + single) as u32,
            sliding_fraction: share(self.contacts.iter().filter(|c| c.sliding).count()),
            tensile_fraction: share(
                self.contacts
                    .iter()
                    .filter(|c| c.normal_force < 0.0)
                    .count(),
            ),
            fabric,
            contact_anisotropy,
            normal_fit,
            shear_fit,
            normal_anisotropy,
            shear_anisotropy,
            normal_forces: self.normal_forces(),
            pressure,
            stress_ratio: (pressure > 0.0).then(|| {
                let s = &self.stress;
                Anisotropy::from_double_angle([
                    0.5 * (s[1][1] - s[0][0]) / pressure,
                    -0.5 * (s[0][1] + s[1][0]) / pressure,
                ])
            }),
            ratio_from_anisotropies,
        }
    }

    fn fit(&self, force: impl Fn(&super::ContactForce) -> f64) -> Harmonic {
        Harmonic::fit(self.contacts.iter().map(|c| (c.normal, force(c))))
    }

    /// ⟨n ⊗ n⟩, and a_c from ⟨cos 2θ⟩ = a_c/2 cos 2θ_c, ⟨sin 2θ⟩ = a_c/2 sin 2θ_c.
    fn fabric(&self) -> (Tensor2<2>, Anisotropy) {
        let share = 1.0 / self.contacts.len().max(1) as f64;
        let mut fabric = [[0.0; 2]; 2];
        let mut double = [0.0; 2];
        for contact in &self.contacts {
            let n = &contact.normal;
            for k in 0..2 {
                double[k] += 2.0 * share * double_angle(n)[k];
                for l in 0..2 {
                    fabric[k][l] += share * n[k] * n[l];
                }
            }
        }
        (fabric, Anisotropy::from_double_angle(double))
    }

    fn normal_forces(&self) -> Option<ForceMoments> {
        let share = 1.0 / self.contacts.len().max(1) as f64;
        let forces = || self.contacts.iter().map(|contact| contact.normal_force);
        let mean = share * forces().sum::<f64>();
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        // ⟨(f − ⟨f⟩)²⟩ and the third and fourth powers; products, as powers are not the same bits everywhere.
        let mut central = [0.0; 3];
        for force in forces() {
            let off = force - mean;
            let square = off * off;
            for (moment, power) in central
                .iter_mut()
                .zip([square, square * off, square * square])
            {
                *moment += share * power;
            }
        }
        let [variance, third, fourth] = central;
        let deviation = variance.sqrt();
        let over = |moment: f64, unit: f64| if unit > 0.0 { moment / unit } else { 0.0 };
        Some(ForceMoments {
            mean,
            variation: deviation / mean,
            skewness: over(third, variance * deviation),
            kurtosis: over(fourth, variance * variance),
            largest: forces().fold(f64::NEG_INFINITY, f64::max) / mean,
        })
    }
}
