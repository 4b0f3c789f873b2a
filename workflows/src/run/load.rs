//! Committed states back from the store.

use std::sync::Arc;

use solver_fem::{GaussPointId, Tensor2, newton::MacroState};
use store::{FrameId, RunName, RunRecord, StepIndex, StepReader, Store};

use super::{
    element_test::TestState,
    error::RunError,
    frames::{DEAL, Deal, MACRO, PACKING, POINT, PROGRESS, decode, read_point},
    point::PointState,
    schedule::Place,
    work::Packing,
};
use crate::input::{Problem, problem::Model};

/// Something that opens committed steps: the store, or a read-only view of it.
pub trait Steps {
    /// A committed step of a run or its ancestors.
    ///
    /// # Errors
    /// It is not there, or damaged.
    fn step(&self, run: &RunName, step: StepIndex) -> Result<StepReader, store::ReadError>;
    /// The record of a run.
    ///
    /// # Errors
    /// It is not there, or damaged.
    fn run(&self, run: &RunName) -> Result<RunRecord, store::ReadError>;
}

impl Steps for Store {
    fn step(&self, run: &RunName, step: StepIndex) -> Result<StepReader, store::ReadError> {
        Store::step(self, run, step)
    }

    fn run(&self, run: &RunName) -> Result<RunRecord, store::ReadError> {
        Store::run(self, run)
    }
}

impl Steps for store::ReadOnlyStore {
    fn step(&self, run: &RunName, step: StepIndex) -> Result<StepReader, store::ReadError> {
        store::ReadOnlyStore::step(self, run, step)
    }

    fn run(&self, run: &RunName) -> Result<RunRecord, store::ReadError> {
        store::ReadOnlyStore::run(self, run)
    }
}

/// The packings of a run, from its step 0.
///
/// # Errors
/// Step 0 cannot be read.
pub fn packings(store: &impl Steps, run: &RunName) -> Result<(Vec<Packing>, Deal), RunError> {
    let initial = store.step(run, StepIndex(0))?;
    let mut packings = Vec::new();
    for id in initial.ids().into_iter().filter(|id| id.kind == PACKING) {
        packings.push(decode::<Packing>(id, &initial.frame(id)?)?);
    }
    let id = FrameId::new(DEAL, 0);
    let deal = decode(id, &initial.frame(id)?)?;
    Ok((packings, deal))
}

/// The states dealt to all Gauss points at step 0, under the laws that hold in `run`: where those of a material were
/// replaced since, its states are taken under the new ones, and a scattered friction is that of the element.
///
/// # Errors
/// Step 0 or the run's record cannot be read, or step 0 lacks a packing that it deals out.
pub fn dealt(store: &impl Steps, run: &RunName) -> Result<Vec<Arc<PointState>>, RunError> {
    let (packings, deal) = packings(store, run)?;
    let states = deal
        .states(&packings)
        .ok_or_else(|| RunError::State("step 0 lacks a packing that it deals out".into()))?;
    let manifest = super::session::manifest(&store.run(run)?.manifest)?;
    super::relaw::relaw(states, &manifest.problem, &manifest.relawed)
}

/// The states of all Gauss points at the step open in `reader`, from those dealt at step 0.
///
/// # Errors
/// A step that cannot be read, or whose frames do not belong to the run's packings.
pub fn points(
    reader: &StepReader,
    dealt: &[Arc<PointState>],
) -> Result<Vec<Arc<PointState>>, RunError> {
    if reader.address().step.0 == 0 {
        return Ok(dealt.to_vec());
    }
    dealt
        .iter()
        .enumerate()
        .map(|(point, dealt)| {
            let id = GaussPointId(point as u32);
            let bytes = reader.frame(FrameId::new(POINT, id.0))?;
            Ok(Arc::new(read_point(id, &bytes, dealt)?))
        })
        .collect()
}

/// The stresses of all Gauss points at the step open in `reader`; none at a step that holds no macro state.
///
/// # Errors
/// A step that cannot be read.
pub fn stresses(problem: &Problem, reader: &StepReader) -> Result<Vec<Tensor2<2>>, RunError> {
    let id = FrameId::new(MACRO, 0);
    if !reader.ids().contains(&id) {
        return Ok(Vec::new());
    }
    let bytes = reader.frame(id)?;
    Ok(match problem.model {
        Model::Body(_) => {
            let state: MacroState<2> = decode(id, &bytes)?;
            let (rows, _) = state.stress.as_chunks::<4>();
            rows.iter()
                .map(|[xx, xy, yx, yy]| [[*xx, *xy], [*yx, *yy]])
                .collect()
        }
        Model::ElementTest(_) => vec![decode::<TestState>(id, &bytes)?.stress],
    })
}

/// The states of all Gauss points at a committed step.
///
/// # Errors
/// A step that cannot be read, or whose frames do not belong to the run's packings.
pub fn states(
    store: &impl Steps,
    run: &RunName,
    step: StepIndex,
) -> Result<Vec<Arc<PointState>>, RunError> {
    points(&store.step(run, step)?, &dealt(store, run)?)
}

/// The place in the programme at a committed step.
///
/// # Errors
/// The step cannot be read.
pub fn place(store: &impl Steps, run: &RunName, step: StepIndex) -> Result<Place, RunError> {
    let id = FrameId::new(PROGRESS, 0);
    Ok(decode(id, &store.step(run, step)?.frame(id)?)?)
}
