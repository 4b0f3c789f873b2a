//! The steps of an element test: one REV under mixed control, one task a step.

use std::sync::Arc;

use engine::{Finished, GraphHandle, NodeId, TaskOutcome, TaskSpec};
use serde::{Deserialize, Serialize};
use solver_dem::{Component, Control, Method, tensor};
use solver_fem::{GaussPointId, Tensor2, post, step_control::Taken};
use store::{Seal, StepIndex};

use super::{
    attempt::TaskPolicy,
    core::{Core, Ending, Stopwatch},
    error::RunError,
    failed_task::{self, Meaning},
    frames::{self, MACRO, PROGRESS},
    point::PointState,
    schedule::{Interval, Reached, Schedule},
    summary::StepSummary,
    work::{Done, DriveJob, Driven, Job},
};
use crate::{
    input::{
        problem::{Control as Prescribed, ElementTest},
        programme::Along,
    },
    progress::CommittedStep,
};

/// The macro state of an element test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestState {
    /// F from the initial cell.
    pub gradient: Tensor2<2>,
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
}

impl TestState {
    /// The state before the first step.
    pub fn initial(stress: Tensor2<2>) -> Self {
        Self {
            gradient: tensor::identity(),
            stress,
        }
    }
}

/// The committed state of an element test, as the programme asks for it.
pub struct TestReached {
    /// F and stress.
    pub state: TestState,
    /// Values of the loads.
    pub loads: Vec<f64>,
}

impl Reached for TestReached {
    fn loads(&self) -> &[f64] {
        &self.loads
    }

    /// It has none, and its input cannot ask for one.
    fn expansion(&self, _boundary: &str) -> f64 {
        f64::NAN
    }

    fn shear_strain(&self) -> f64 {
        post::second_invariant(&post::logarithmic(&self.state.gradient))
    }

    /// It has no boundary, and its input cannot ask for one.
    fn displacement(&self, _at: &Along) -> f64 {
        f64::NAN
    }

    /// Likewise.
    fn force(&self, _at: &Along) -> f64 {
        f64::NAN
    }
}

/// An element test on its way.
pub struct TestSteps {
    test: ElementTest,
    policy: TaskPolicy,
    schedule: Schedule,
    step: u32,
    reached: TestReached,
    point: Arc<PointState>,
    interval: Option<Interval>,
    waiting: Option<NodeId>,
    /// Since the step began; `None` before the first one.
    begun: Option<Stopwatch>,
    summary: StepSummary,
}

impl TestSteps {
    /// Goes on from committed step `step`.
    pub fn new(
        test: ElementTest,
        policy: TaskPolicy,
        schedule: Schedule,
        step: u32,
        reached: TestReached,
        point: Arc<PointState>,
    ) -> Self {
        Self {
            test,
            policy,
            schedule,
            step,
            reached,
            point,
            interval: None,
            waiting: None,
            begun: None,
            summary: StepSummary::default(),
        }
    }

    /// Sends the next step out; ends the run after the last.
    pub fn begin(
        &mut self,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let Some(interval) = self.schedule.next(&self.reached) else {
            core.ending = Some(Ending::Completed);
            return Ok(());
        };
        if self.schedule.cuts == 0 {
            self.begun = Some(core.stopwatch());
            self.summary = StepSummary::default();
        }
        core.step_started(self.step + 1, &interval, self.schedule.increments());
        let job = Job::Drive(DriveJob {
            base: Arc::clone(&self.point),
            from: self.reached.state.gradient,
            control: control(&self.test, &interval.to),
            method: Method::ReturnMapping,
            settings: self.policy.settings,
        });
        let spec = TaskSpec::new("element test", job)
            .retry(self.policy.retry)
            .time_limit(self.policy.time_limit);
        self.waiting = Some(graph.add_task(spec)?);
        self.interval = Some(interval);
        core.wave_started(self.step + 1, 0, 1, 0);
        Ok(())
    }

    /// The step's task ended.
    pub fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        if self.waiting != Some(id) {
            return Ok(());
        }
        graph.forget_before(id);
        match outcome {
            Ok(Finished {
                output: Done::Drive(driven),
                cpu,
                ..
            }) => {
                self.summary.cpu_s += cpu.as_secs_f64();
                self.summary.revs.add(&driven.report);
                core.progress.task_done();
                core.progress.iteration(1, driven.report.residual);
                self.commit(*driven, core)?;
                self.begin(core, graph)
            }
            Ok(_) => Err(RunError::Engine(
                "an element test gave something else".into(),
            )),
            Err(failure) => {
                if failed_task::meaning(&failure)? == Meaning::Stopped {
                    return Ok(());
                }
                let reason = failure.cause.to_string();
                let kept = failed_task::keep(core, self.step + 1, &failure);
                core.log_failure(0, &reason, kept.as_deref());
                match self.schedule.cut() {
                    Ok(()) => {
                        core.step_cut(self.step + 1, self.schedule.place.control.factor(), &reason);
                        self.begin(core, graph)
                    }
                    Err(too_small) => {
                        core.ending = Some(Ending::Failed(format!(
                            "load step {} cannot be solved: {reason}; {too_small}",
                            self.step + 1
                        )));
                        Ok(())
                    }
                }
            }
        }
    }

    fn commit(&mut self, driven: Driven, core: &mut Core<'_>) -> Result<(), RunError> {
        let Some(interval) = self.interval.take() else {
            return Ok(());
        };
        let journal = core.store.journal(core.run, StepIndex(self.step + 1))?;
        let cuts = self.schedule.cuts;
        self.schedule.accept(Taken {
            sweeps: 1,
            ..Taken::default()
        });
        self.reached = TestReached {
            state: TestState {
                gradient: driven.gradient,
                stress: driven.stress,
            },
            loads: interval.to.clone(),
        };
        let ended = self.schedule.stop(&self.reached);
        let summary = StepSummary {
            increment: interval.increment,
            stage: interval.stage,
            position: interval.part.1,
            loads: interval.to,
            ended: ended.unwrap_or_default(),
            residual: driven.report.residual,
            cuts,
            wall_s: self.begun.map_or(0.0, |begun| core.seconds(&begun)),
            ..std::mem::take(&mut self.summary)
        };
        let seal = Seal {
            final_wave: None,
            extra: vec![
                frames::point_frame(GaussPointId(0), &driven.state),
                frames::content(MACRO, 0, &self.reached.state),
                frames::content(PROGRESS, 0, &self.schedule.place),
            ],
            summary: frames::encode(&summary),
        };
        let committed = journal.commit(seal, |_| false)?;
        self.step += 1;
        self.point = Arc::new(driven.state);
        let line = CommittedStep {
            step: interval.increment,
            of: self.schedule.increments(),
            iterations: 1,
            residual: summary.residual,
            position: summary.position,
            loosely_accepted: summary.loosely_accepted,
        };
        core.step_committed(self.step, &committed, &summary, &line);
        Ok(())
    }
}

/// The control of one step: F = [[1 + xx, xy], [0, 1 + yy]], some of it free to follow its stress.
pub fn control(test: &ElementTest, loads: &[f64]) -> Control {
    let stretch = |own: Prescribed, other: Prescribed| match own {
        Prescribed::Strain(amount) => Component::Gradient(1.0 + amount.at(loads)),
        Prescribed::Stress(amount) => Component::Stress(amount.at(loads)),
        // det F = (1 + xx)(1 + yy) = 1; the input takes it only beside a prescribed strain.
        Prescribed::KeepVolume => match other {
            Prescribed::Strain(amount) => Component::Gradient(1.0 / (1.0 + amount.at(loads))),
            _ => Component::Gradient(1.0),
        },
    };
    let shear = match test.xy {
        Prescribed::Strain(amount) => Component::Gradient(amount.at(loads)),
        Prescribed::Stress(amount) => Component::Stress(amount.at(loads)),
        Prescribed::KeepVolume => Component::Gradient(0.0),
    };
    Control {
        components: [
            [stretch(test.xx, test.yy), shear],
            [Component::Gradient(0.0), stretch(test.yy, test.xx)],
        ],
    }
}
