//! The element test, as it is written.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Amount;

/// One point of a material under a prescribed path: exactly one of `path` and `control`.
///
/// The deformation gradient from the initial cell is F = [[1 + xx, xy], [0, 1 + yy]]: xx and yy are engineering strains
/// (stretch − 1, negative in compression), xy is the displacement of the top over the initial height, and lines along
/// x stay along x.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementTest {
    /// One of the usual paths, which brings its load along.
    pub path: Option<LoadPath>,
    /// How each component is controlled.
    pub control: Option<Control>,
}

/// The usual paths, from the initial isotropic stress −σ0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadPath {
    /// Strain yy follows the load `axial` (from 0), stress xx stays −σ0, no shear strain.
    Biaxial,
    /// Both normal stresses follow the load `mean_stress` (from −σ0), no shear strain.
    Isotropic,
    /// Shear strain xy follows the load `shear` (from 0), strain xx is 0, stress yy stays −σ0.
    SimpleShear,
    /// Strain yy follows the load `axial` (from 0), strain xx keeps the volume, no shear strain: undrained loading.
    ConstantVolume,
}

/// Control of each component.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Normal component along x.
    pub xx: Component,
    /// Normal component along y.
    pub yy: Component,
    /// Shear component.
    pub xy: Component,
}

/// What is prescribed in one component.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// This strain from the initial cell (see the element test for its definition).
    Strain(Amount),
    /// This Cauchy stress, positive in tension.
    Stress(Amount),
    /// The strain that keeps the volume; xx or yy only.
    KeepVolume,
}
