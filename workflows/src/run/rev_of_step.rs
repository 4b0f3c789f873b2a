//! One REV out of a committed step.

use store::StepIndex;

use super::{
    Context, load,
    open::explain,
    place,
    point::{PlaneRev, PointState},
    view::View,
};
use crate::{
    address::RevAddress,
    failure::{Failure, FailureKind},
    input::{
        body,
        problem::{Law, Model, Problem},
    },
};

/// A REV as a committed step has it.
pub struct RevOfStep {
    /// The step.
    pub step: StepIndex,
    /// Its state.
    pub rev: PlaneRev,
    /// σ0 of its material, > 0, stress units.
    pub confining_stress: f64,
}

/// The REV at this address.
pub fn find(context: &Context<'_>, address: &RevAddress) -> Result<RevOfStep, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    let record = &run.step(address.step)?.record;
    let step = record.index;
    // Under the laws of the run that committed it: one that takes the step up may have others.
    let states = load::states(&view.store, &record.run, step)
        .map_err(|error| explain(&format!("read {}@{step}", run.name()), error))?;
    let problem = &run.manifest.problem;
    let refused = |why: &str| {
        let what = format!("failed to find the REV {address}: {why}");
        Failure::new(FailureKind::Usage, what)
    };
    let point = place::gauss_point(&run, address.place, states.len())
        .map_err(|existing| refused("it is not in the mesh").hint(existing))?;
    match &*states[point.index()] {
        PointState::Rev(rev) => Ok(RevOfStep {
            step,
            rev: rev.clone(),
            confining_stress: confining_stress(problem, address.place.element as usize),
        }),
        PointState::Elastic { .. } => Err(refused("that point is elastic, it has no grains")),
    }
}

/// σ0 of the material of an element.
fn confining_stress(problem: &Problem, element: usize) -> f64 {
    let material = match &problem.model {
        Model::ElementTest(test) => Some(test.material),
        Model::Body(body) => body::divided(body)
            .ok()
            .and_then(|divided| divided.materials.get(element).copied()),
    };
    match material
        .and_then(|k| problem.materials.get(k))
        .map(|material| &material.law)
    {
        Some(Law::Rev(rev)) => rev.confining_stress,
        _ => 1.0,
    }
}
