//! Materials, as they are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::{Anisotropy, Sizes, Target};

/// A material: `rev` (an assembly of grains at every Gauss point) or `elastic`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Take over everything from this material; what is written here replaces it key by key.
    #[expect(dead_code, reason = "followed before this type is read")]
    pub like: Option<String>,
    /// A periodic assembly of grains that answers by discrete elements.
    pub rev: Option<Rev>,
    /// Isotropic linear elasticity.
    pub elastic: Option<Elastic>,
}

/// A periodic assembly of grains (representative elementary volume), its preparation and its contact law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rev {
    /// Number of grains.
    #[schemars(range(min = 16, max = 20_000))]
    pub grains: u32,
    /// Largest over smallest grain diameter, uniform in size between the two: short for `sizes: { uniform: … }`.
    #[schemars(range(min = 1.0, max = 20.0))]
    pub size_ratio: f64,
    /// Distribution of the grain diameters, in place of `size_ratio`.
    pub sizes: Option<Sizes>,
    /// Isotropic stress σ0 under which the assembly is prepared, positive in compression.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub confining_stress: f64,
    /// Contact stiffness κ = kn/σ0 (2D, per unit thickness).
    #[schemars(range(min = 10.0))]
    pub stiffness: f64,
    /// Tangential over normal contact stiffness, kt/kn.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub tangential_stiffness: f64,
    /// Coefficient of friction between grains.
    #[schemars(range(min = 0.0))]
    pub friction: f64,
    /// Scatter of the friction from element to element, a trigger of localisation: with 0.05 the grains of every element
    /// have their own coefficient, within ±5 % of `friction`, drawn evenly from `seed` and the number of the element. The
    /// packings do not depend on it, and an element test has `friction` itself.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub friction_scatter: f64,
    /// Friction during the preparation: 0 gives a dense assembly, the value of `friction` a loose one.
    #[schemars(range(min = 0.0))]
    pub preparation_friction: f64,
    /// What the finished assembly must reach; what is to be varied for it, `by` says.
    pub target: Option<Target>,
    /// Width over height of the cell.
    #[schemars(range(min = 0.1, max = 10.0))]
    pub aspect_ratio: f64,
    /// An anisotropic stress during the preparation, which leaves an inherent anisotropy of the contacts.
    pub anisotropy: Option<Anisotropy>,
    /// Angle in degrees by which the finished assembly is turned with its cell, counter-clockwise.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub orientation: f64,
    /// Attraction between touching grains, f_c/(a σ0) with the mean grain diameter a. Note: part of the literature uses
    /// the inverse.
    #[schemars(range(min = 0.0))]
    pub cohesion_ratio: f64,
    /// Which assemblies the Gauss points get.
    pub packings: Packings,
    /// Seed of the random preparation, and of the draws that deal a gallery out and scatter the friction.
    pub seed: u64,
    /// A file with a prepared packing to start from, relative to this input. It replaces the preparation.
    pub import: Option<String>,
}

impl Default for Rev {
    fn default() -> Self {
        Self {
            grains: 400,
            size_ratio: 2.5,
            sizes: None,
            confining_stress: 1.0,
            stiffness: 1000.0,
            tangential_stiffness: 1.0,
            friction: 0.5,
            friction_scatter: 0.0,
            preparation_friction: 0.0,
            target: None,
            aspect_ratio: 1.0,
            anisotropy: None,
            orientation: 0.0,
            cohesion_ratio: 0.0,
            packings: Packings::Shared,
            seed: 1,
            import: None,
        }
    }
}

/// Which assemblies the Gauss points get.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Packings {
    /// The same for all: a homogeneous specimen.
    Shared,
    /// This many different ones, dealt out by a seeded draw.
    Gallery(#[schemars(range(min = 1, max = 100_000))] u32),
    /// Another one in every element, the same at its Gauss points.
    OnePerElement,
    /// Another one at every Gauss point.
    OnePerGaussPoint,
}

/// Isotropic linear elasticity in plane strain, in rate form at large strain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Elastic {
    /// Young's modulus E.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub young: Option<f64>,
    /// Poisson's ratio ν.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: Option<f64>,
    /// Isotropic stress at the beginning, positive in tension: −1 beside a REV prepared at `confining_stress` 1.
    #[serde(default)]
    pub initial_stress: f64,
}
