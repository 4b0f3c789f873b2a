//! A session of a run: one task graph that prepares packings and then takes load step after load step.

use std::{collections::BTreeSet, sync::Arc};

use engine::{Director, GraphHandle, NodeId, TaskOutcome};
use store::{Seal, StepIndex};

use super::{
    attempt::TaskPolicy,
    body::{BodyStart, BodySteps},
    core::{Core, Ending},
    element_test::{TestReached, TestState, TestSteps},
    error::RunError,
    frames::{self, DEAL, MACRO, PACKING, PROGRESS, decode},
    model::{self, Model},
    packings::Plan,
    point::PointState,
    preparing::{Prepared, Preparing},
    relaw::relaw,
    schedule::{Place, Schedule},
    summary::StepSummary,
    text,
    work::{Job, Packing},
};
use crate::input::{Problem, problem::Model as InputModel};
use solver_fem::newton::MacroState;

/// Directs a session.
pub struct Campaign<'a> {
    /// What all phases share.
    pub core: Core<'a>,
    problem: &'a Problem,
    policy: TaskPolicy,
    phase: Phase,
}

enum Phase {
    /// Before the first node.
    Start,
    /// Packings are being made.
    Preparing(Preparing, Option<Box<Model>>),
    /// A body is stepped.
    Body(Box<BodySteps>),
    /// An element test is stepped.
    Test(Box<TestSteps>),
}

impl<'a> Campaign<'a> {
    /// A session of a run of `problem`.
    pub fn new(core: Core<'a>, problem: &'a Problem) -> Self {
        let iterates = match &problem.model {
            InputModel::Body(_) => model::iterate_settings(&problem.solver),
            InputModel::ElementTest(_) => model::rev_settings(&problem.solver),
        };
        Self {
            core,
            problem,
            policy: super::body::policy(&problem.solver, iterates),
            phase: Phase::Start,
        }
    }

    /// The session's first node has come: from the last committed step, or from the preparation.
    fn start(&mut self, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        let record = self.core.store.run(self.core.run)?;
        match record.last_step {
            Some(step) => self.go_on(step, graph),
            None => self.prepare(graph),
        }
    }

    fn schedule(&self) -> Schedule {
        let control = model::step_control(&self.problem.solver);
        Schedule::new(self.problem, control)
    }

    fn prepare(&mut self, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        let (plan, model) = Plan::of_problem(self.problem)?;
        let preparing = Preparing::begin(plan, self.core.store, graph)?;
        let (needed, cached) = (preparing.needed(), preparing.cached());
        if cached < needed {
            let all = text::count(needed, "packing");
            let note = format!("preparing {} of {all}", needed - cached);
            self.core.progress.note(&note);
        }
        self.core.log(
            "preparing",
            &serde_json::json!({ "packings": needed, "cached": cached }),
        );
        graph.add_join("initial state", preparing.tasks())?;
        self.phase = Phase::Preparing(preparing, model.map(Box::new));
        Ok(())
    }

    /// All packings are there: commits the initial state as step 0.
    fn prepared(&mut self, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        let Phase::Preparing(preparing, model) = std::mem::replace(&mut self.phase, Phase::Start)
        else {
            return Ok(());
        };
        let Some(Prepared { deal, packings, .. }) = preparing.finish()? else {
            return Ok(());
        };
        let states = deal
            .states(&packings)
            .ok_or_else(|| RunError::Engine("a point was dealt no packing".into()))?;
        // Nothing is committed yet whose laws another input could replace.
        let states = relaw(states, self.problem, &BTreeSet::new())?;
        let schedule = self.schedule();
        let mut extra: Vec<_> = packings
            .iter()
            .enumerate()
            .map(|(number, packing)| frames::content(PACKING, number as u32, packing))
            .collect();
        extra.push(frames::content(DEAL, 0, &deal));
        extra.push(frames::content(PROGRESS, 0, &schedule.place));
        let loads = self.problem.programme.initial.clone();
        let summary = StepSummary {
            loads: loads.clone(),
            ..StepSummary::default()
        };
        let seal = |extra| Seal {
            final_wave: None,
            extra,
            summary: frames::encode(&summary),
        };
        let journal = self.core.store.journal(self.core.run, StepIndex(0))?;
        match (&self.problem.model, model) {
            (InputModel::Body(_), Some(model)) => {
                let (stress, tangents) = initial_fields(&deal, &packings, &states)
                    .ok_or_else(|| RunError::Engine("a point was dealt another state".into()))?;
                let state = MacroState::initial(&model.problem, &stress, &tangents, &loads)
                    .map_err(|error| RunError::State(error.to_string()))?;
                extra.push(frames::content(MACRO, 0, &state));
                let committed = journal.commit(seal(extra), |_| false)?;
                let start = BodyStart {
                    step: 0,
                    digest: committed.digest,
                    state,
                    points: states,
                    bytes: committed.bytes,
                };
                self.step_body(*model, schedule, start, graph)
            }
            (InputModel::ElementTest(test), _) => {
                let state = TestState::initial(packings[0].stress);
                extra.push(frames::content(MACRO, 0, &state));
                let reached = TestReached { state, loads };
                journal.commit(seal(extra), |_| false)?;
                let steps = TestSteps::new(
                    test.clone(),
                    self.policy,
                    schedule,
                    0,
                    reached,
                    Arc::clone(&states[0]),
                );
                self.step_test(steps, graph)
            }
            (InputModel::Body(_), None) => Err(RunError::Engine("the mesh is gone".into())),
        }
    }

    /// Goes on from the committed step `step`.
    fn go_on(&mut self, step: StepIndex, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        let states = super::load::states(self.core.store, self.core.run, step)?;
        let reader = self.core.store.step(self.core.run, step)?;
        let progress_id = store::FrameId::new(PROGRESS, 0);
        let macro_id = store::FrameId::new(MACRO, 0);
        let place: Place = decode(progress_id, &reader.frame(progress_id)?)?;
        let control = model::step_control(&self.problem.solver);
        let schedule = Schedule::at(self.problem, control, place);
        match &self.problem.model {
            InputModel::Body(body) => {
                let loads = self.problem.loads.len();
                let model = Model::to_solve(body, loads, &self.problem.solver)?;
                let start = BodyStart {
                    step: step.0,
                    digest: reader.digest(),
                    state: decode(macro_id, &reader.frame(macro_id)?)?,
                    points: states,
                    bytes: reader.bytes(),
                };
                self.step_body(model, schedule, start, graph)
            }
            InputModel::ElementTest(test) => {
                let summary: StepSummary = rmp_serde::from_slice(&reader.summary()?)
                    .map_err(|error| RunError::Manifest(error.to_string()))?;
                let reached = TestReached {
                    state: decode(macro_id, &reader.frame(macro_id)?)?,
                    loads: summary.loads,
                };
                let steps = TestSteps::new(
                    test.clone(),
                    self.policy,
                    schedule,
                    step.0,
                    reached,
                    Arc::clone(&states[0]),
                );
                self.step_test(steps, graph)
            }
        }
    }

    fn step_body(
        &mut self,
        model: Model,
        schedule: Schedule,
        start: BodyStart,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let settings = model::step_settings(&self.problem.solver, &self.problem.materials);
        let mut steps = BodySteps::new(model, settings, self.policy, schedule, start);
        let begun = steps.begin(&mut self.core, graph);
        self.phase = Phase::Body(Box::new(steps));
        begun
    }

    fn step_test(
        &mut self,
        mut steps: TestSteps,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let begun = steps.begin(&mut self.core, graph);
        self.phase = Phase::Test(Box::new(steps));
        begun
    }

    /// How the run ended, if it did by itself.
    pub fn ending(&self) -> Option<&Ending> {
        self.core.ending.as_ref()
    }
}

impl Director<Job> for Campaign<'_> {
    type Error = RunError;

    fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        match &mut self.phase {
            Phase::Start => Ok(()),
            Phase::Preparing(preparing, _) => {
                if let Some(number) = preparing.take(id, outcome, self.core.store)? {
                    self.core.log("packing_ready", &number);
                }
                Ok(())
            }
            Phase::Body(steps) => steps.task_finished(id, outcome, &mut self.core),
            Phase::Test(steps) => steps.task_finished(id, outcome, &mut self.core, graph),
        }
    }

    fn join(&mut self, id: NodeId, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        match &mut self.phase {
            Phase::Start => self.start(graph),
            Phase::Preparing(..) => self.prepared(graph),
            Phase::Body(steps) => steps.join(id, &mut self.core, graph),
            Phase::Test(_) => Ok(()),
        }
    }
}

/// Stress and elastic tangent of every Gauss point before the first step. `None` where deal and states do not belong
/// together.
fn initial_fields(
    deal: &frames::Deal,
    packings: &[Packing],
    states: &[Arc<PointState>],
) -> Option<(Vec<solver_fem::Tensor2<2>>, Vec<solver_fem::Tensor4<2>>)> {
    deal.points
        .iter()
        .zip(states)
        .map(|(dealt, state)| match (dealt, &**state) {
            (frames::Dealt::Packing(k), _) => {
                let packing = packings.get(*k as usize)?;
                Some((packing.stress, packing.elastic_tangent))
            }
            (_, PointState::Elastic { law, stress }) => Some((*stress, law.tangent_at(stress))),
            (frames::Dealt::Elastic(_), PointState::Rev(_)) => None,
        })
        .collect()
}
