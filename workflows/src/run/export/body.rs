//! The committed states of a body, one step at a time.

use std::sync::Arc;

use solver_fem::newton::MacroState;
use store::{FrameId, StepReader};

use super::ExportError;
use crate::{
    input::problem::Body,
    run::{
        error::RunError,
        frames::{COST, MACRO, decode},
        load,
        model::Model,
        point::PointState,
        view::{RunView, StepView, View},
    },
};

/// A body and the way to its committed states.
pub struct BodyResults<'a> {
    view: &'a View,
    run: &'a RunView,
    /// Mesh and conditions.
    pub model: Model,
    /// Names of the materials.
    pub material_names: Vec<String>,
    dealt: Vec<Arc<PointState>>,
}

impl<'a> BodyResults<'a> {
    /// The results of a run of `body`.
    pub fn open(view: &'a View, run: &'a RunView, body: &Body) -> Result<Self, ExportError> {
        let problem = &run.manifest.problem;
        let model = Model::new(body, problem.loads.len())?;
        let dealt = load::dealt(&view.store, run.id())?;
        let points = model.problem.gauss_point_count();
        if dealt.len() != points {
            let what = format!(
                "step 0 deals packings to {} Gauss points, the mesh has {points}",
                dealt.len()
            );
            return Err(RunError::State(what).into());
        }
        let material_names = problem
            .materials
            .iter()
            .map(|material| material.name.clone())
            .collect();
        Ok(Self {
            view,
            run,
            model,
            material_names,
            dealt,
        })
    }

    fn reader(&self, step: &StepView) -> Result<StepReader, ExportError> {
        Ok(self.view.store.step(self.run.id(), step.record.index)?)
    }

    /// The macro state of a step.
    pub fn state(&self, step: &StepView) -> Result<MacroState<2>, ExportError> {
        let id = FrameId::new(MACRO, 0);
        let state: MacroState<2> =
            decode(id, &self.reader(step)?.frame(id)?).map_err(RunError::from)?;
        let checked = state.check(&self.model.problem);
        checked.map_err(|error| RunError::State(error.to_string()))?;
        Ok(state)
    }

    /// The states of its Gauss points.
    pub fn points(&self, step: &StepView) -> Result<Vec<Arc<PointState>>, ExportError> {
        Ok(load::points(&self.reader(step)?, &self.dealt)?)
    }

    /// CPU seconds of each element in the step.
    pub fn cost(&self, step: &StepView) -> Result<Vec<f64>, ExportError> {
        let (reader, id) = (self.reader(step)?, FrameId::new(COST, 0));
        let elements = self.model.problem.mesh().element_count();
        // The initial state cost nothing.
        if !reader.ids().contains(&id) {
            return Ok(vec![0.0; elements]);
        }
        let cost: Vec<f64> = decode(id, &reader.frame(id)?).map_err(RunError::from)?;
        if cost.len() == elements {
            Ok(cost)
        } else {
            let what = format!(
                "it knows the cost of {} elements, the mesh has {elements}",
                cost.len()
            );
            Err(RunError::State(what).into())
        }
    }
}
