//! The input as resolved: defaults filled in, names replaced by indices, every check passed.
//!
//! A run stores its [`Problem`]; what the program does follows from it alone, not from the YAML it came from.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize};
use solver_dem::{AnisotropicStress, Sizes, Target};
use solver_fem::second_gradient::Side;

use super::document::{Box2, OutputSettings, Packings, SolverSettings};
use super::mesh::Mesh;
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
    /// The second gradient, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_gradient: Option<SecondGradient>,
    /// Force per initial volume along x and y, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_force: Option<[Amount; 2]>,
}

/// A second gradient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SecondGradient {
    /// Modulus D of all elements that are in none of `regions`; stress × length².
    pub modulus: f64,
    /// D of these regions, by name; 0 is a region of plain elements.
    pub regions: BTreeMap<String, f64>,
    /// Boundaries on which what is held of v does not follow from the displacement.
    pub sides: BTreeMap<String, Side>,
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
    /// Seed of preparation, of the dealing out, and of the scatter.
    pub seed: u64,
    /// Largest relative deviation of the friction of an element from `friction`, ≥ 0 and < 1. Runs of before there was a
    /// scatter have none.
    #[serde(default)]
    pub friction_scatter: f64,
}

/// How the assemblies of a material are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Origin {
    /// From a recipe.
    Prepared(Preparation),
    /// From this file: the path of the input's folder joined with the path in the input.
    Imported(String),
}

/// The part of a recipe that ends with the preparation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Preparation {
    /// Number of grains.
    pub grains: u32,
    /// Their sizes. Runs of before there were several distributions have Rmax/Rmin here.
    #[serde(alias = "size_ratio", deserialize_with = "sizes_or_ratio")]
    pub sizes: Sizes,
    /// Friction while compressing.
    pub friction: f64,
    /// What the finished assembly must reach.
    #[serde(default)]
    pub target: Option<Target>,
    /// Width over height of the cell.
    #[serde(default = "square")]
    pub aspect_ratio: f64,
    /// Anisotropic stress of the preparation.
    #[serde(default)]
    pub anisotropy: Option<AnisotropicStress>,
    /// Angle by which the finished assembly is turned, rad.
    #[serde(default)]
    pub orientation: f64,
}

fn square() -> f64 {
    1.0
}

fn sizes_or_ratio<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Sizes, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Ratio(f64),
        Sizes(Sizes),
    }
    Ok(match Written::deserialize(deserializer)? {
        Written::Ratio(ratio) => Sizes::Uniform { ratio },
        Written::Sizes(sizes) => sizes,
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs of before there were several distributions must go on.
    #[test]
    fn a_preparation_with_a_size_ratio_alone_is_still_read() {
        let old = serde_json::json!({ "Prepared": { "grains": 100, "size_ratio": 1.5, "friction": 0.1 } });
        let bytes = rmp_serde::to_vec_named(&old).unwrap();
        let Origin::Prepared(read) = rmp_serde::from_slice(&bytes).unwrap() else {
            panic!("another origin");
        };
        assert_eq!(read.sizes, Sizes::Uniform { ratio: 1.5 });
        assert_eq!((read.aspect_ratio, read.orientation), (1.0, 0.0));
        let again = rmp_serde::to_vec_named(&read).unwrap();
        assert_eq!(rmp_serde::from_slice::<Preparation>(&again).unwrap(), read);
    }
}
