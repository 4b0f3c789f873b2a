//! From the input's words to the macro solver's problem.

use solver_fem::{
    boundary::{Condition, Target, Value},
    mesh::{Annulus, AnnulusExtent, Mesh, Rectangle},
    problem::{Problem, Setup},
    second_gradient::SecondGradient,
};
use thiserror::Error;

use super::document::{Element, Sector};
use super::problem::{Amount, Body, ConditionKind, Selection};

/// The mesh or the conditions make no problem after all, in the words of the solver.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct BodyError(String);

/// A mesh and what its elements are made of.
pub struct Divided {
    /// The mesh with its regions.
    pub mesh: Mesh<2>,
    /// Index of the material of each element.
    pub materials: Vec<usize>,
    /// Index of the region that gave each element its material; `None` outside of all regions.
    pub regions: Vec<Option<usize>>,
}

/// The mesh of a body and its regions; where those overlap, the later one holds.
///
/// # Errors
/// What the mesh refuses.
pub fn divided(body: &Body) -> Result<Divided, BodyError> {
    let mut mesh = mesh(&body.mesh)?;
    let mut materials = vec![body.material; mesh.element_count()];
    let mut regions = vec![None; mesh.element_count()];
    for (index, region) in body.regions.iter().enumerate() {
        let elements = match &region.selection {
            Selection::Elements(elements) => elements.iter().map(|&e| e as usize).collect(),
            Selection::Box(within) => mesh.elements_in_box(within.from, within.to),
        };
        mesh.assign_region(&region.name, &elements)
            .map_err(|error| BodyError(error.to_string()))?;
        for element in elements {
            materials[element] = region.material;
            regions[element] = Some(index);
        }
    }
    Ok(Divided {
        mesh,
        materials,
        regions,
    })
}

/// The boundary value problem of a body under this number of loads, and the index of the material of each element.
///
/// # Errors
/// What the mesh or the conditions refuse.
pub fn problem(body: &Body, loads: usize) -> Result<(Problem<2>, Vec<usize>), BodyError> {
    let Divided {
        mesh, materials, ..
    } = divided(body)?;
    let mut conditions = conditions(body, &mesh);
    conditions.extend(body_force(body));
    let element = body.mesh.element().plane().element();
    let second_gradient = second_gradient(body, &mesh);
    let setup = Setup {
        second_gradient,
        ..Setup::new(mesh, element, conditions, loads)
    };
    let problem = Problem::build(setup).map_err(|error| BodyError(error.to_string()))?;
    Ok((problem, materials))
}

/// The modulus of every region of the mesh.
fn second_gradient(body: &Body, mesh: &Mesh<2>) -> SecondGradient {
    let Some(spec) = &body.second_gradient else {
        return SecondGradient::default();
    };
    let of_region = |name: &String| spec.regions.get(name).copied().unwrap_or(spec.modulus);
    SecondGradient {
        moduli: mesh.region_names.iter().map(of_region).collect(),
        sides: spec.sides.clone(),
    }
}

fn mesh(mesh: &super::Mesh) -> Result<Mesh<2>, BodyError> {
    let (grid, per_row) = match mesh {
        super::Mesh::Rectangle(rectangle) => {
            let elements = rectangle.elements.map(|n| n as usize);
            let size = rectangle.size;
            (Mesh::rectangle(&Rectangle { size, elements }), elements[0])
        }
        super::Mesh::Annulus(annulus) => {
            let [circumferential, radial] = annulus.elements.map(|n| n as usize);
            let ring = Annulus {
                inner_radius: annulus.inner_radius,
                outer_radius: annulus.outer_radius,
                circumferential,
                radial,
                growth: annulus.growth,
                extent: match annulus.sector {
                    Sector::Quarter => AnnulusExtent::Quarter,
                    Sector::Half => AnnulusExtent::Half,
                    Sector::Full => AnnulusExtent::Full,
                },
            };
            (Mesh::annulus(&ring), radial)
        }
        super::Mesh::Imported(imported) => return Ok(imported.mesh()),
    };
    let grid = grid.map_err(|error| BodyError(error.to_string()))?;
    Ok(match mesh.element() {
        Element::Q8 | Element::Q8Full => grid,
        Element::Q4 => grid.into_linear(),
        Element::T6 | Element::T6Full => grid.into_triangles(per_row),
    })
}

fn conditions(body: &Body, mesh: &Mesh<2>) -> Vec<Condition> {
    let mut conditions = Vec::new();
    for condition in &body.conditions {
        let on = &condition.on;
        match condition.kind {
            ConditionKind::Displacement { component, value } => {
                let condition = Condition::displacement(target(mesh, on), component, amount(value));
                conditions.push(condition);
            }
            ConditionKind::Pressure(value) => {
                conditions.push(Condition::Pressure {
                    boundary: on.clone(),
                    value: amount(value),
                });
            }
            ConditionKind::Traction(values) => {
                for (component, value) in values.into_iter().enumerate() {
                    // Along a held component a zero is how the input says that nothing acts.
                    if value == Amount::Constant(0.0) {
                        continue;
                    }
                    conditions.push(Condition::Traction {
                        boundary: on.clone(),
                        component,
                        value: amount(value),
                    });
                }
            }
        }
    }
    conditions
}

/// The boundary of this name, or the node set where there is no such boundary.
pub fn target(mesh: &Mesh<2>, name: &str) -> Target {
    if mesh.boundaries.contains_key(name) {
        Target::boundary(name)
    } else {
        Target::node_set(name)
    }
}

/// The components of a body force that are not 0 throughout.
fn body_force(body: &Body) -> impl Iterator<Item = Condition> {
    let components = body.body_force.into_iter().flatten().enumerate();
    components
        .filter(|(_, value)| *value != Amount::Constant(0.0))
        .map(|(component, value)| Condition::body_force(component, amount(value)))
}

fn amount(amount: Amount) -> Value {
    match amount {
        Amount::Constant(value) => Value::Constant(value),
        Amount::Load(index) => Value::load(index),
    }
}
