//! The input as resolved: defaults filled in, names replaced by indices, every check passed.
//!
//! A run stores its [`Problem`]; what the program does follows from it alone, not from the YAML it came from.

use serde::{Deserialize, Serialize};

use super::document::{Box2, Mesh, OutputSettings, Packings, SolverSettings};
use super::programme::Programme;
use crate::address::RunName;

/// Everything one run computes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// Name of the run, as wished by the input.
    pub name: RunName,
    /// Names of the loads; their values are in [`Programme`]. A load is meant by its index here.
    pub loads: Vec<String>,
    /// The materials, by name in alphabetical order. A material is meant by its index here.
    pub materials: Vec<Material>,
    /// What is loaded.
    pub model: Model,
    /// How it is loaded.
    pub programme: Programme,
    /// How the equations are solved.
    pub solver: SolverSettings,
    /// What is written for other programs.
    pub output: OutputSettings,
    /// The YAML this comes from, to the letter.
    pub source: String,
}

/// What is loaded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Model {
    /// A body divided into finite elements.
    Body(Body),
    /// One point of a material.
    ElementTest(ElementTest),
}

/// A body divided into finite elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Shape and division.
    pub mesh: Mesh,
    /// Index of the material of all elements that are in no region.
    pub material: usize,
    /// Regions; where they overlap, the later one holds.
    pub regions: Vec<Region>,
    /// Boundary conditions, one per component.
    pub conditions: Vec<Condition>,
}

/// A part of the mesh with its own material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Its name.
    pub name: String,
    /// Index of its material.
    pub material: usize,
    /// Which elements belong to it.
    pub selection: Selection,
}

/// A set of elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Selection {
    /// These numbers, from 0, all of them in the mesh.
    Elements(Vec<u32>),
    /// Those whose centre lies in the box, its sides included.
    Box(Box2),
}

/// One condition on one boundary or node set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Name of the boundary or node set of the mesh.
    pub on: String,
    /// What is prescribed.
    pub kind: ConditionKind,
}

/// What a condition prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ConditionKind {
    /// Displacement from the initial position, in one component.
    Displacement {
        /// 0 is x, 1 is y.
        component: usize,
        /// Its value.
        value: Amount,
    },
    /// Pressure normal to the deforming boundary, positive in compression.
    Pressure(Amount),
    /// Force per initial length in fixed direction, along x and y.
    Traction([Amount; 2]),
}

/// A value that is constant or follows a load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Amount {
    /// Constant in time.
    Constant(f64),
    /// The load of this index.
    Load(usize),
}

impl Amount {
    /// Its value where the loads have the values `loads`; a load that `loads` is too short for counts as 0.
    pub fn at(self, loads: &[f64]) -> f64 {
        match self {
            Self::Constant(value) => value,
            Self::Load(index) => loads.get(index).copied().unwrap_or(0.0),
        }
    }
}

/// One point of a material on a prescribed path.
///
/// The deformation gradient from the initial cell is F = [[1 + xx, xy], [0, 1 + yy]].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ElementTest {
    /// Index of the material.
    pub material: usize,
    /// Control of xx (the stretch along x minus 1, or the Cauchy stress σ_xx, tension positive).
    pub xx: Control,
    /// Control of yy, likewise.
    pub yy: Control,
    /// Control of xy (displacement of the top over the initial height, or the Cauchy stress σ_xy).
    pub xy: Control,
}

/// What is prescribed in one component of an element test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// The component of F − 1.
    Strain(Amount),
    /// The component of the Cauchy stress, tension positive.
    Stress(Amount),
    /// The strain for which det F = 1.
    KeepVolume,
}

/// A material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// Its law.
    pub law: Law,
}

impl Material {
    /// The isotropic stress that the material is in before loading, tension positive.
    pub fn initial_stress(&self) -> f64 {
        match &self.law {
            Law::Rev(rev) => -rev.confining_stress,
            Law::Elastic(elastic) => elastic.initial_stress,
        }
    }
}

/// A constitutive law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Law {
    /// An assembly of grains at every Gauss point.
    Rev(Rev),
    /// Isotropic elasticity.
    Elastic(Elastic),
}

/// Where the assemblies of a material come from, and the contact law (physics: see `solver-dem`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rev {
    /// How they are made.
    pub origin: Origin,
    /// Isotropic stress σ0 of the preparation, positive in compression.
    pub confining_stress: f64,
    /// κ = kn/σ0.
    pub stiffness: f64,
    /// kt/kn.
    pub tangential_stiffness: f64,
    /// Coefficient of friction between grains.
    pub friction: f64,
    /// f_c/(a σ0), with a the mean grain diameter.
    pub cohesion_ratio: f64,
    /// Which assemblies the Gauss points get.
    pub packings: Packings,
    /// Seed of preparation and of the dealing out.
    pub seed: u64,
}

/// How the assemblies of a material are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Origin {
    /// By isotropic compression of a random gas of grains.
    Prepared {
        /// Number of grains.
        grains: u32,
        /// Rmax/Rmin, uniform in size.
        size_ratio: f64,
        /// Friction while compressing.
        friction: f64,
    },
    /// From this file: the path of the input's folder joined with the path in the input.
    Imported(String),
}

/// Isotropic elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Elastic {
    /// Young's modulus.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Isotropic stress before loading, tension positive.
    pub initial_stress: f64,
}
