//! The input as it is written: one type per part of the language.
//!
//! From these types come the schema that `femdem-flow schema` prints, the check of every file against it
//! ([`super::check`]) and the reading of the values (serde). What a type cannot say (a name that refers to nothing,
//! say) is checked in [`super::resolve`]. Descriptions here are what an editor shows to the user.

mod boundary;
mod element_test;
mod material;
mod mesh;
mod packing;
mod programme;
mod second_gradient;
mod settings;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

pub use boundary::{Amount, Components, Condition};
pub use element_test::{Component, Control, ElementTest, LoadPath};
pub use material::{Elastic, Material, Packings, Rev};
pub use mesh::{Annulus, Box2, Element, Gmsh, Mesh, Rectangle, Region, Sector};
pub use packing::{Fraction, Means, Sizes, Target};
pub use programme::{Axis, Control as StageControl, Sense, Stage, Until};
pub use second_gradient::{Gradient, SecondGradient};
pub use settings::{Field, LinearSolver, LossOfConfinement, OutputSettings, SolverSettings};

/// The input of one run of femdem-flow.
///
/// Units are the user's own consistent set. Stresses and strains are positive in tension, pressures in compression.
/// Describe either a `mesh` with `boundary` conditions, or an `element_test`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(
    dead_code,
    reason = "the whole serves the schema; its parts are read one by one"
)]
pub struct Document {
    /// Name of the run: letters, digits, `-` and `_`.
    pub name: String,
    /// Shape of the body and its division into elements.
    pub mesh: Option<Mesh>,
    /// One REV (or one point of another material) under a prescribed path, in place of a mesh.
    pub element_test: Option<ElementTest>,
    /// The materials by name.
    pub materials: BTreeMap<String, Material>,
    /// The material of the element test, or of all elements outside `regions`. May be left out where only one material
    /// is defined.
    pub material: Option<String>,
    /// Parts of the mesh of another material. Where two of them overlap, the later one holds.
    #[serde(default)]
    pub regions: Vec<Region>,
    /// A second gradient, against bands as thin as the mesh. Left out, the elements are plain.
    pub second_gradient: Option<SecondGradient>,
    /// Quantities that the load programme drives, each with its initial value.
    #[serde(default)]
    pub loads: BTreeMap<String, f64>,
    /// Conditions on the boundaries of the mesh. What is not named is free of load.
    #[serde(default)]
    pub boundary: Vec<Condition>,
    /// A force on the whole body, such as its own weight: components along x and y per initial volume. It keeps its total
    /// whatever the deformation, as mass does. Let it follow a load that begins at 0 where the materials begin under an
    /// even stress.
    pub body_force: Option<Components>,
    /// The stages of loading, one after the other.
    #[schemars(length(min = 1))]
    pub programme: Vec<Stage>,
    /// How the equations are solved.
    #[serde(default)]
    pub solver: SolverSettings,
    /// What is written for other programs to read.
    #[serde(default)]
    pub output: OutputSettings,
}
