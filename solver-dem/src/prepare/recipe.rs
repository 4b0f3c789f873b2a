//! What makes a packing.

use serde::{Deserialize, Serialize};

use super::{PreparationError, Sizes, Target};
use crate::{ContactLaw, tensor::Tensor2};

/// The longest and the shortest cell, Lx/Ly.
const ASPECT_RATIOS: std::ops::RangeInclusive<f64> = 0.1..=10.0;
/// The largest ratio of principal stresses; grains flow long before.
const LARGEST_STRESS_RATIO: f64 = 10.0;

/// What makes a packing. Lengths come out with the mean diameter a = 1; the response of a REV to a
/// deformation has no length scale of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Number of grains.
    pub grains: u32,
    /// Their sizes.
    pub sizes: Sizes,
    /// σ0: isotropic pressure of the finished packing, stress units, > 0.
    pub confining_stress: f64,
    /// κ = kn/σ0 (2D).
    pub stiffness: f64,
    /// kt/kn.
    pub tangential_stiffness: f64,
    /// μ after preparation.
    pub friction: f64,
    /// μ while compressing: 0 gives a dense packing, μ a loose one. A [`Target`] by friction chooses it instead.
    pub preparation_friction: f64,
    /// f_c/(a σ0), switched on after compression. Part of the literature defines P* as the inverse.
    pub cohesion_ratio: f64,
    /// Lx/Ly of the cell in which the grains are placed; compression changes it a little.
    pub aspect_ratio: f64,
    /// The stress while compressing, where it is not isotropic.
    pub anisotropy: Option<AnisotropicStress>,
    /// By which angle the finished packing is turned with its cell, counter-clockwise, rad.
    pub orientation: f64,
    /// What the finished packing must reach.
    pub target: Option<Target>,
    /// Same seed, same bits.
    pub seed: u64,
}

/// An anisotropic stress of mean σ0, under which a packing is compressed before it is brought to the isotropic σ0
/// with its final law: contacts that have formed along the larger stress stay in excess.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnisotropicStress {
    /// Larger over smaller principal pressure, in [1, 10].
    pub stress_ratio: f64,
    /// Angle of the larger principal pressure from the x axis, counter-clockwise, rad.
    pub direction: f64,
}

impl AnisotropicStress {
    /// The pressure tensor of mean `pressure`, positive in compression.
    pub(super) fn pressure(&self, pressure: f64) -> Tensor2<2> {
        // p ± q along the principal axes, with q/p = (r − 1)/(r + 1) for the ratio r.
        let q = pressure * (self.stress_ratio - 1.0) / (self.stress_ratio + 1.0);
        let (sine, cosine) = libm::sincos(2.0 * self.direction);
        [
            [pressure + q * cosine, q * sine],
            [q * sine, pressure - q * cosine],
        ]
    }
}

impl Default for Recipe {
    /// The standard REV: 400 grains, Rmax/Rmin = 2.5, σ0 = 1, kn = kt = 1000, μ = 0.5, dense.
    fn default() -> Self {
        Self {
            grains: 400,
            sizes: Sizes::default(),
            confining_stress: 1.0,
            stiffness: 1000.0,
            tangential_stiffness: 1.0,
            friction: 0.5,
            preparation_friction: 0.0,
            cohesion_ratio: 0.0,
            aspect_ratio: 1.0,
            anisotropy: None,
            orientation: 0.0,
            target: None,
            seed: 1,
        }
    }
}

impl Recipe {
    /// The law while compressing: no cohesion, the given friction.
    pub(super) fn preparation_law(&self, friction: f64) -> ContactLaw {
        let kn = self.stiffness * self.confining_stress;
        ContactLaw {
            normal_stiffness: kn,
            tangential_stiffness: self.tangential_stiffness * kn,
            friction,
            cohesion: 0.0,
        }
    }

    /// The law of the finished packing, f_c = p* a σ0 with a = 1.
    pub fn law(&self) -> ContactLaw {
        ContactLaw {
            cohesion: self.cohesion_ratio * self.confining_stress,
            ..self.preparation_law(self.friction)
        }
    }

    pub(super) fn check(&self) -> Result<(), PreparationError> {
        self.sizes
            .check()
            .map_err(|error| PreparationError::Recipe(error.to_string()))?;
        if let Some(target) = &self.target {
            target.check()?;
        }
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let ranges = [
            (self.grains >= 16, "at least 16 grains are needed"),
            (
                self.confining_stress > 0.0 && self.confining_stress.is_finite(),
                "confining_stress must be > 0",
            ),
            (
                self.stiffness >= 10.0 && self.stiffness.is_finite(),
                "stiffness must be at least 10",
            ),
            (
                self.tangential_stiffness >= 0.0 && self.tangential_stiffness <= 10.0,
                "tangential_stiffness must be in [0, 10]",
            ),
            (not_negative(self.friction), "friction must be ≥ 0"),
            (
                not_negative(self.preparation_friction),
                "preparation_friction must be ≥ 0",
            ),
            (
                not_negative(self.cohesion_ratio),
                "cohesion_ratio must be ≥ 0",
            ),
            (
                ASPECT_RATIOS.contains(&self.aspect_ratio),
                "aspect_ratio must be in [0.1, 10]",
            ),
            (
                self.anisotropy.is_none_or(|anisotropy| {
                    (1.0..=LARGEST_STRESS_RATIO).contains(&anisotropy.stress_ratio)
                        && anisotropy.direction.is_finite()
                }),
                "the stress_ratio of the anisotropy must be in [1, 10], its direction a number",
            ),
            (
                self.orientation.is_finite(),
                "orientation must be a finite angle",
            ),
        ];
        match ranges.iter().find(|(fine, _)| !fine) {
            Some((_, problem)) => Err(PreparationError::Recipe((*problem).into())),
            None => Ok(()),
        }
    }
}

/// p·1.
pub(super) fn isotropic(pressure: f64) -> Tensor2<2> {
    [[pressure, 0.0], [0.0, pressure]]
}
