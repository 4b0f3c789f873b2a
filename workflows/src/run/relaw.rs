//! States under other laws than those they came from: what a new start from a step of another run begins with.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    error::RunError,
    manifest::Manifest,
    model::Model,
    packings::{elastic_point, law},
    point::{PlaneRev, PointState},
};
use crate::input::{
    Problem,
    problem::{Law, Material, Model as InputModel},
};

/// `states` with the laws of those materials replaced that the manifest names; shared states stay shared.
///
/// # Errors
/// The input does not make a model, or a state belongs to another kind of material.
pub fn relaw(
    states: Vec<Arc<PointState>>,
    manifest: &Manifest,
) -> Result<Vec<Arc<PointState>>, RunError> {
    if manifest.relawed.is_empty() {
        return Ok(states);
    }
    let materials = materials_of_points(&manifest.problem, states.len())?;
    let mut replaced: BTreeMap<(usize, *const PointState), Arc<PointState>> = BTreeMap::new();
    // Points that share a state go on sharing it: the address says which do, and nothing else.
    states
        .iter()
        .zip(materials)
        .map(|(state, material)| {
            if !manifest.relawed.contains(&material) {
                return Ok(Arc::clone(state));
            }
            let key = (material, Arc::as_ptr(state));
            if let Some(done) = replaced.get(&key) {
                return Ok(Arc::clone(done));
            }
            let material = &manifest.problem.materials[material];
            let new = Arc::new(under(state, material)?);
            replaced.insert(key, Arc::clone(&new));
            Ok(new)
        })
        .collect()
}

/// The same state under the law of `material`.
fn under(state: &PointState, material: &Material) -> Result<PointState, RunError> {
    match (state, &material.law) {
        (PointState::Rev(rev), Law::Rev(input)) => Ok(PointState::Rev(PlaneRev {
            law: law(input, rev),
            ..rev.clone()
        })),
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

/// Index of the material of each of `count` Gauss points.
fn materials_of_points(problem: &Problem, count: usize) -> Result<Vec<usize>, RunError> {
    match &problem.model {
        InputModel::ElementTest(test) => Ok(vec![test.material; count]),
        InputModel::Body(body) => {
            let model = Model::new(body, problem.loads.len())?;
            let per_element = model.problem.points_per_element();
            let each = model.materials.iter();
            Ok(each
                .flat_map(|&material| std::iter::repeat_n(material, per_element))
                .collect())
        }
    }
}
