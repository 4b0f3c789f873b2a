//! Mesh and regions, as they are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of the body and its division into Q8 elements with 2×2 Gauss points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mesh {
    /// A rectangle with sides along x and y.
    Rectangle(Rectangle),
    /// A ring around the origin, or a part of one.
    Annulus(Annulus),
}

impl Mesh {
    /// Number of elements.
    pub fn element_count(&self) -> u64 {
        let [first, second] = match self {
            Mesh::Rectangle(rectangle) => rectangle.elements,
            Mesh::Annulus(annulus) => annulus.elements,
        };
        u64::from(first) * u64::from(second)
    }
}

/// A rectangle with sides along x and y. Boundaries: left, right, bottom, top; nodes: bottom_mid, top_mid,
/// bottom_left, bottom_right, top_left, top_right, corners. Element 0 is at the bottom left, x runs fastest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    /// Width and height.
    #[schemars(extend("items" = { "type": "number", "format": "double", "exclusiveMinimum": 0.0 }))]
    pub size: [f64; 2],
    /// Number of elements along x and along y.
    #[schemars(inner(range(min = 1, max = 10_000)))]
    pub elements: [u32; 2],
}

/// A ring around the origin, or a part of one, graded towards the cavity. Boundaries: inner, outer and, where the ring
/// is cut, symmetry_x (the cut along the x axis) and symmetry_y (the cut along the y axis); nodes of a half ring: axis_y
/// (all on the y axis), of a full one: axis_x and, for an even number of elements, axis_y. Element 0 is at the cavity on
/// the positive x axis; the numbers run outwards along a ray, then ray by ray.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Annulus {
    /// How much of the ring is computed.
    #[serde(default)]
    pub sector: Sector,
    /// Radius of the cavity.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_radius: f64,
    /// Radius of the outer boundary.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer_radius: f64,
    /// Number of elements along the circumference and along the radius.
    #[schemars(inner(range(min = 1, max = 10_000)))]
    pub elements: [u32; 2],
    /// Radial length of an element over that of its inner neighbour.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub growth: f64,
}

/// How much of a ring is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sector {
    /// The quarter x ≥ 0, y ≥ 0.
    #[default]
    Quarter,
    /// The half y ≥ 0.
    Half,
    /// All of it.
    Full,
}

/// A part of the mesh with its own material: given by `elements` or by `box`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the region.
    pub name: String,
    /// Its material.
    pub material: String,
    /// Numbers of its elements, counted from 0.
    #[schemars(length(min = 1), inner(range(min = 0)))]
    pub elements: Option<Vec<i64>>,
    /// A box; the elements belong whose centre lies in it.
    #[serde(rename = "box")]
    pub within: Option<Box2>,
}

/// A box with sides along x and y.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Box2 {
    /// The corner of least coordinates.
    pub from: [f64; 2],
    /// The corner of greatest coordinates.
    pub to: [f64; 2],
}

fn one() -> f64 {
    1.0
}
