//! Boundary conditions, as they are written.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Gradient;

/// One condition: `on` a boundary or node, exactly one of `displacement`, `pressure`, `traction`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Name of the boundary, or of the node (displacement only).
    pub on: String,
    /// Displacement, which moves by the *change* of its value: a number means "stays where it is", whatever the number, and a
    /// load counts from its initial value. A component that is not given is free. Held along the normal it makes a
    /// plane of symmetry or a smooth platen (which a second gradient tells apart, see `gradient`).
    pub displacement: Option<Components>,
    /// Pressure normal to the deforming boundary, positive in compression.
    pub pressure: Option<Amount>,
    /// Force per initial length, keeping its direction: components along x and y.
    pub traction: Option<[Amount; 2]>,
    /// With a second gradient: what is held of v on this boundary. Left out, it follows from the displacement
    /// (`platen`); on the cuts of a ring it is `symmetry`.
    pub gradient: Option<Gradient>,
}

/// Components of a vector.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Components {
    /// Component along x.
    pub x: Option<Amount>,
    /// Component along y.
    pub y: Option<Amount>,
}

/// A number, or the name of one of the `loads`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Amount {
    /// Constant in time.
    Number(f64),
    /// Follows this load.
    Load(String),
}
