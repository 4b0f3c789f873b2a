//! Second gradient, as it is written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// A second gradient: the body also resists the gradient of its strain, which gives localisation bands a width of
/// their own, whatever the mesh.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SecondGradient {
    /// Modulus D, a stress times a length squared. Where the material softens with slope −H, a band is about 2π√(D/H)
    /// wide; `femdem-flow rev test … --internal-length D` measures H. Choose D so that a band spans at least 3, better 5
    /// elements. 0 is no second gradient.
    #[serde(rename = "D")]
    #[schemars(range(min = 0.0))]
    pub modulus: f64,
    /// Regions with another D, by name; 0 makes a region of plain elements.
    #[serde(default)]
    pub regions: BTreeMap<String, f64>,
}

/// What is held of v on a boundary: v stands for the displacement gradient, v_xy for ∂u_x/∂y. What is not held is free
/// of double traction.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gradient {
    /// What follows from the displacement: where a component is prescribed, its derivative along the boundary is zero.
    Platen,
    /// A plane of symmetry: the shear components v_xy and v_yx are zero.
    Symmetry,
    /// Nothing is held.
    Free,
    /// These components are zero.
    Held(Vec<Component>),
}

/// A component of v.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// ∂u_x/∂x.
    Xx,
    /// ∂u_x/∂y.
    Xy,
    /// ∂u_y/∂x.
    Yx,
    /// ∂u_y/∂y.
    Yy,
}

impl Component {
    /// Row and column, from 0.
    pub fn indices(self) -> [usize; 2] {
        match self {
            Self::Xx => [0, 0],
            Self::Xy => [0, 1],
            Self::Yx => [1, 0],
            Self::Yy => [1, 1],
        }
    }
}
