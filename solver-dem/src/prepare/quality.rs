//! How good a packing is.

use serde::{Deserialize, Serialize};

use crate::{
    Rev,
    anatomy::{Statistics, anatomy},
    relax::Relaxed,
};

/// What a preparation reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Largest unbalanced force over the mean contact force.
    pub residual: f64,
    /// Largest error of a stress component over σ0, shear included.
    pub stress_error: f64,
    /// e.
    pub void_ratio: f64,
    /// z, rattlers included.
    pub coordination: f64,
    /// Grains with fewer than two contacts.
    pub rattlers: u32,
    /// Cycles of all phases and trials.
    pub cycles: u32,
    /// z* of the grains that carry load, see [`Statistics::backbone_coordination`].
    #[serde(default)]
    pub backbone_coordination: Option<f64>,
    /// a_c of the contact directions, see [`Statistics::contact_anisotropy`]. N contacts at random have
    /// about √(π/N), so 0.06 for 800 means isotropic.
    #[serde(default)]
    pub anisotropy: f64,
    /// Where most contacts point, rad from x.
    #[serde(default)]
    pub direction: f64,
    /// μ while compressing: that of the recipe, or what its target asked for; `None` where the packing was made elsewhere.
    #[serde(default)]
    pub preparation_friction: Option<f64>,
    /// Cycles of shear or compression that densified the packing.
    #[serde(default)]
    pub densifying_cycles: u32,
}

impl Quality {
    /// The quality of `rev` after its last relaxation.
    pub(super) fn of(rev: &Rev<2, 1>, relaxed: &Relaxed) -> Self {
        let figures = statistics(rev);
        Self {
            residual: relaxed.residual,
            stress_error: relaxed.stress_error,
            void_ratio: rev.void_ratio(),
            coordination: rev.coordination(),
            rattlers: rev.rattlers() as u32,
            cycles: relaxed.cycles,
            backbone_coordination: figures.backbone_coordination,
            anisotropy: figures.contact_anisotropy.amplitude,
            direction: figures.contact_anisotropy.direction,
            preparation_friction: None,
            densifying_cycles: 0,
        }
    }
}

/// The figures of a packing that has just been at rest.
pub(super) fn statistics(rev: &Rev<2, 1>) -> Statistics {
    let anatomy = anatomy(rev).expect("grains that were moved in this cell can be listed in it");
    anatomy.statistics()
}
