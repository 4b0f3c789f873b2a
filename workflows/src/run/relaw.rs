//! States under the laws that hold in a run, where those are not the laws of their packings: a new start from a step of
//! another run replaces them, and a scatter gives every element a friction of its own.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use super::{
    draw::scattered_friction,
    error::RunError,
    packings::{elastic_point, law},
    point::{PlaneRev, PointState},
};
use crate::input::{
    Problem, body,
    problem::{Body, Law, Material, Model as InputModel},
};

/// The states of all Gauss points under the laws of `problem`: those of the materials `relawed` anew, and the friction
/// of each element where a material scatters it. Shared states stay shared as far as their laws are the same.
///
/// # Errors
/// The mesh cannot be built, or a state belongs to another kind of material.
pub fn relaw(
    states: Vec<Arc<PointState>>,
    problem: &Problem,
    relawed: &BTreeSet<usize>,
) -> Result<Vec<Arc<PointState>>, RunError> {
    let scatters = scattering(problem);
    if relawed.is_empty() && scatters.is_empty() {
        return Ok(states);
    }
    let places = places_of_points(problem, states.len())?;
    let mut replaced: BTreeMap<(Place, *const PointState), Arc<PointState>> = BTreeMap::new();
    // Points that share a state go on sharing it: the address says which do, and nothing else.
    states
        .iter()
        .zip(places)
        .map(|(state, place)| {
            let Place { material, element } = place;
            let element = element.filter(|_| scatters.contains(&material));
            if element.is_none() && !relawed.contains(&material) {
                return Ok(Arc::clone(state));
            }
            let key = (Place { material, element }, Arc::as_ptr(state));
            if let Some(done) = replaced.get(&key) {
                return Ok(Arc::clone(done));
            }
            let new = Arc::new(under(state, &problem.materials[material], element)?);
            replaced.insert(key, Arc::clone(&new));
            Ok(new)
        })
        .collect()
}

/// Materials, by index, that scatter the friction from element to element; an element test has no elements.
fn scattering(problem: &Problem) -> BTreeSet<usize> {
    let scatters =
        |material: &Material| matches!(&material.law, Law::Rev(rev) if rev.friction_scatter > 0.0);
    match &problem.model {
        InputModel::ElementTest(_) => BTreeSet::new(),
        InputModel::Body(_) => {
            let materials = problem.materials.iter().enumerate();
            materials
                .filter_map(|(index, material)| scatters(material).then_some(index))
                .collect()
        }
    }
}

/// The same state under the law of `material`, with the friction of `element` where that is its own.
fn under(
    state: &PointState,
    material: &Material,
    element: Option<u64>,
) -> Result<PointState, RunError> {
    match (state, &material.law) {
        (PointState::Rev(rev), Law::Rev(input)) => {
            let mut law = law(input, rev);
            if let Some(element) = element {
                let scatter = input.friction_scatter;
                law.friction = scattered_friction(law.friction, scatter, input.seed, element);
            }
            Ok(PointState::Rev(PlaneRev { law, ..rev.clone() }))
        }
        (PointState::Elastic { stress, .. }, Law::Elastic(input)) => match elastic_point(input)? {
            PointState::Elastic { law, .. } => Ok(PointState::Elastic {
                law,
                stress: *stress,
            }),
            other => Ok(other),
        },
        _ => Err(RunError::State(format!(
            "a point of material `{}` was dealt another kind of state",
            material.name
        ))),
    }
}

/// Where a Gauss point is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    /// Index of its material.
    material: usize,
    /// Number of its element; `None` in an element test.
    element: Option<u64>,
}

/// Where each of `count` Gauss points is.
fn places_of_points(problem: &Problem, count: usize) -> Result<Vec<Place>, RunError> {
    match &problem.model {
        InputModel::ElementTest(test) => {
            let place = Place {
                material: test.material,
                element: None,
            };
            Ok(vec![place; count])
        }
        InputModel::Body(body) => places_in(body),
    }
}

fn places_in(body: &Body) -> Result<Vec<Place>, RunError> {
    let per_element = body.mesh.points_per_element();
    let materials = body::divided(body)?.materials;
    let each = materials.into_iter().zip(0..);
    let places = each.map(|(material, element)| Place {
        material,
        element: Some(element),
    });
    Ok(places
        .flat_map(|place| std::iter::repeat_n(place, per_element))
        .collect())
}
