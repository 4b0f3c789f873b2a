//! Mesh and regions, as they are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use solver_fem::element::PlaneElement;

/// Shape of the body and its division into elements.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mesh {
    /// A rectangle with sides along x and y.
    Rectangle(Rectangle),
    /// A ring around the origin, or a part of one.
    Annulus(Annulus),
    /// A mesh made with Gmsh.
    Gmsh(Gmsh),
}

/// A mesh file of Gmsh (`.msh`, format 4.1 or 2.2, ASCII or binary) of triangles or quadrangles, all of one kind: Q8
/// (of nine-node ones the middle node is left out), T6 or Q4. Physical groups of lines are boundaries, or nodes where
/// they run inside the body; groups of points are nodes; groups of surfaces can be given materials in `regions`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gmsh {
    /// The file, relative to the folder of the input. A run keeps the mesh and does not need the file any more.
    pub file: String,
    /// The kind of element, where it is not what the file suggests: the fuller integration rule of the same shape.
    pub element: Option<Element>,
}

/// The kind of element and its integration rule. Each Gauss point of a REV material is an assembly of grains, so that
/// the cost goes with their number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Element {
    /// Eight-node quadrilateral, 2×2 points: the standard.
    #[default]
    Q8,
    /// Eight-node quadrilateral, 3×3 points: free of spurious modes, stiffer where volume is kept, 2.25 times the REVs.
    #[serde(rename = "Q8_full")]
    Q8Full,
    /// Four-node quadrilateral, 2×2 points. Locks in bending and where volume is kept: for comparisons.
    Q4,
    /// Six-node triangle, 3 points. A grid is cut into two triangles a field, with alternating diagonals; field e
    /// becomes the elements 2e and 2e+1.
    T6,
    /// Six-node triangle, 6 points.
    #[serde(rename = "T6_full")]
    T6Full,
}

impl Element {
    /// Whether this is what an input that says nothing gets; a stored input says nothing then, either.
    pub fn is_standard(&self) -> bool {
        *self == Self::default()
    }

    /// The element of the macro solver.
    pub fn plane(self) -> PlaneElement {
        match self {
            Self::Q8 => PlaneElement::Q8,
            Self::Q8Full => PlaneElement::Q8Full,
            Self::Q4 => PlaneElement::Q4,
            Self::T6 => PlaneElement::T6,
            Self::T6Full => PlaneElement::T6Full,
        }
    }

    /// Elements that one field of a grid is cut into.
    pub fn per_field(self) -> u64 {
        match self {
            Self::Q8 | Self::Q8Full | Self::Q4 => 1,
            Self::T6 | Self::T6Full => 2,
        }
    }

    /// For people: `Q8`, `Q8 (3×3 points)`.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Q8 => "Q8",
            Self::Q8Full => "Q8 (3×3 points)",
            Self::Q4 => "Q4",
            Self::T6 => "T6",
            Self::T6Full => "T6 (6 points)",
        }
    }
}

/// A rectangle with sides along x and y. Boundaries: left, right, bottom, top; nodes: bottom_mid, top_mid,
/// bottom_left, bottom_right, top_left, top_right, corners. Element 0 is at the bottom left, x runs fastest. (Q4 has
/// bottom_mid and top_mid for an even number of elements along x only.)
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    /// Width and height.
    #[schemars(extend("items" = { "type": "number", "format": "double", "exclusiveMinimum": 0.0 }))]
    pub size: [f64; 2],
    /// Number of elements along x and along y; for triangles, of the fields that are cut in two.
    #[schemars(inner(range(min = 1, max = 10_000)))]
    pub elements: [u32; 2],
    /// The kind of element.
    #[serde(default, skip_serializing_if = "Element::is_standard")]
    pub element: Element,
}

/// A ring around the origin, or a part of one, graded towards the cavity. Boundaries: inner, outer and, where the ring
/// is cut, symmetry_x (the cut along the x axis) and symmetry_y (the cut along the y axis); nodes of a half ring: axis_y
/// (all on the y axis), of a full one: axis_x and, for an even number of elements, axis_y. (For Q4, where a node is there.) Element 0 is at the cavity on
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
    /// Number of elements along the circumference and along the radius; for triangles, of the fields that are cut in two.
    #[schemars(inner(range(min = 1, max = 10_000)))]
    pub elements: [u32; 2],
    /// Radial length of an element over that of its inner neighbour.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub growth: f64,
    /// The kind of element.
    #[serde(default, skip_serializing_if = "Element::is_standard")]
    pub element: Element,
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

/// A part of the mesh with its own material: given by `elements`, by `box` or by `group`.
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
    /// Name of a physical group of surfaces in the mesh file.
    pub group: Option<String>,
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
