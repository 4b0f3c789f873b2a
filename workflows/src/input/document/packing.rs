//! How assemblies of grains are prepared, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A distribution of grain diameters. Only ratios count: the mean diameter (by number) is 1 in what is computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sizes {
    /// All diameters between the smallest and the largest are equally frequent (by number).
    Uniform(Uniform),
    /// The logarithm of the diameter is normally distributed (by number) between two cut-offs.
    LogNormal(LogNormal),
    /// A grading curve.
    Table(Table),
}

/// All diameters between the smallest and the largest are equally frequent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Uniform {
    /// Largest over smallest diameter.
    #[schemars(range(min = 1.0, max = 20.0))]
    pub ratio: f64,
}

/// A log-normal distribution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogNormal {
    /// Standard deviation of the natural logarithm of the diameter, before the cut.
    #[schemars(range(min = 1e-3, max = 10.0))]
    pub deviation: f64,
    /// Smallest diameter over the median.
    #[serde(default = "half")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub smallest: f64,
    /// Largest diameter over the median.
    #[serde(default = "two")]
    #[schemars(extend("exclusiveMinimum" = 1.0))]
    pub largest: f64,
}

/// A grading curve, linear between its points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// What the fractions count.
    #[serde(default)]
    pub by: Fraction,
    /// Points `[diameter, fraction that is not larger]`, from fraction 0 to fraction 1; diameters in any unit.
    #[schemars(length(min = 2))]
    pub curve: Vec<[f64; 2]>,
}

/// What the fractions of a grading curve count.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fraction {
    /// Grains.
    Number,
    /// Area of grains, which is mass per unit thickness, as sieves give it.
    #[default]
    Area,
}

/// What the finished assembly must reach: `void_ratio` or `coordination`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Volume of voids over volume of grains.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub void_ratio: Option<f64>,
    /// Mean number of contacts of a grain, rattlers included.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 6.0))]
    pub coordination: Option<f64>,
    /// How far from it is close enough: 0.002 for the void ratio, 0.02 for the coordination if it is not given.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub tolerance: Option<f64>,
    /// What is varied until it is reached.
    #[serde(default)]
    pub by: Means,
}

/// What is varied until a target is reached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Means {
    /// The friction while compressing, from 0 to 1, in place of `preparation_friction`.
    #[default]
    Friction,
    /// Cycles of simple shear of the assembly that `preparation_friction` gives. They only densify.
    ShearCycles(ShearCycles),
    /// Cycles of isotropic compression of the assembly that `preparation_friction` gives. They only densify.
    CompressionCycles(CompressionCycles),
}

/// Cycles of simple shear at constant pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShearCycles {
    /// Shear strain to either side.
    #[serde(default = "two_percent")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 0.2))]
    pub amplitude: f64,
    /// Friction during the cycles.
    #[serde(default = "low_friction")]
    #[schemars(range(min = 0.0))]
    pub friction: f64,
}

/// Cycles of isotropic compression from the confining stress and back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompressionCycles {
    /// Largest pressure over the confining stress.
    #[serde(default = "four")]
    #[schemars(extend("exclusiveMinimum" = 1.0), range(max = 100.0))]
    pub ratio: f64,
    /// Friction during the cycles.
    #[serde(default = "low_friction")]
    #[schemars(range(min = 0.0))]
    pub friction: f64,
}

/// An anisotropic stress during the preparation, of the same mean; the finished assembly is under an isotropic one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Anisotropy {
    /// Larger over smaller principal stress. Without `preparation_friction` grains flow from about 1.2 on, with 0.5 from
    /// about 2.
    #[schemars(range(min = 1.0, max = 10.0))]
    pub stress_ratio: f64,
    /// Direction of the larger principal pressure, degrees from the x axis, counter-clockwise.
    #[serde(default = "upright")]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub direction: f64,
}

fn half() -> f64 {
    0.5
}

fn two() -> f64 {
    2.0
}

fn four() -> f64 {
    4.0
}

fn two_percent() -> f64 {
    0.02
}

fn low_friction() -> f64 {
    0.1
}

fn upright() -> f64 {
    90.0
}
