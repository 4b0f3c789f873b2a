//! The load steps of a body: waves of element tasks, joined by the Newton machine, committed one by one.

use std::{sync::Arc, time::Duration};

use engine::{Cause, Finished, GraphHandle, NodeId, TaskOutcome, thread_cpu_time};
use solver_fem::{
    ConstitutiveResponse, GaussPointId,
    newton::{FailureReason, MacroState, Request, StepFailure, StepOutcome, StepSettings},
    post,
    step_control::Taken,
};
use store::{Digest, Frame, FrameId, Role, Seal, StepIndex};

use super::{
    ahead::{Ahead, begin_step, beside},
    asked::AskedWave,
    attempt::{Attempt, Committed, Opened, TaskPolicy},
    core::{Core, Ending, Stopwatch},
    error::RunError,
    failed_task::{self, Meaning},
    frames::{self, COST, MACRO, POINT, PROGRESS},
    model::Model,
    point::PointState,
    schedule::{Interval, Reached, Schedule},
    summary::StepSummary,
    work::{Done, Job, JobError},
};
use crate::{
    input::{SolverSettings, programme::Along},
    progress::CommittedStep,
};

/// A body on its way through the load programme.
pub struct BodySteps {
    model: Model,
    settings: StepSettings,
    policy: TaskPolicy,
    schedule: Schedule,
    /// The last committed step.
    step: u32,
    digest: Digest,
    state: MacroState<2>,
    points: Vec<Arc<PointState>>,
    attempt: Option<Attempt>,
    interval: Option<Interval>,
    summary: StepSummary,
    /// CPU seconds of each element in this step.
    cost: Vec<f64>,
    /// Since the step began; `None` before the first one.
    begun: Option<Stopwatch>,
    /// CPU seconds of the last commit.
    commit_s: f64,
    last_bytes: u64,
    /// The next step as far as it was begun beside the commit of the last one.
    ahead: Option<Ahead>,
}

/// A committed step to go on from.
pub struct BodyStart {
    /// Its number.
    pub step: u32,
    /// Its digest.
    pub digest: Digest,
    /// Its macro state.
    pub state: MacroState<2>,
    /// Its Gauss points.
    pub points: Vec<Arc<PointState>>,
    /// Bytes of its pack.
    pub bytes: u64,
}

impl BodySteps {
    /// Goes on from a committed step.
    pub fn new(
        model: Model,
        settings: StepSettings,
        policy: TaskPolicy,
        schedule: Schedule,
        start: BodyStart,
    ) -> Self {
        let elements = model.materials.len();
        Self {
            model,
            settings,
            policy,
            schedule,
            step: start.step,
            digest: start.digest,
            state: start.state,
            points: start.points,
            attempt: None,
            interval: None,
            summary: StepSummary::default(),
            cost: vec![0.0; elements],
            begun: None,
            commit_s: 0.0,
            last_bytes: start.bytes,
            ahead: None,
        }
    }

    /// Begins the next load step, or takes it up where the journal ends; ends the run after the last.
    pub fn begin(
        &mut self,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        if self.schedule.cuts == 0 {
            self.begun = Some(core.stopwatch());
            self.summary = StepSummary {
                director_s: std::mem::take(&mut self.commit_s),
                ..StepSummary::default()
            };
            self.cost.fill(0.0);
            core.store.free_space_guard(self.last_bytes)?;
        }
        let journal = core.store.journal(core.run, StepIndex(self.step + 1))?;
        let committed = Committed {
            digest: self.digest,
            points: &self.points,
        };
        let opened = Attempt::open(journal, &self.model.problem, committed)?;
        if let Opened::TakenUp { place, cuts, .. } = &opened {
            self.schedule.place = place.clone();
            self.schedule.cuts = *cuts;
        }
        let Some(interval) = self.schedule.next(&BodyReached {
            model: &self.model,
            state: &self.state,
        }) else {
            core.ending = Some(Ending::Completed);
            return Ok(());
        };
        core.step_started(self.step + 1, &interval, self.schedule.increments());
        self.interval = Some(interval.clone());
        let attempt = match opened {
            Opened::TakenUp { attempt, .. } => *attempt,
            Opened::Empty(journal) => {
                let ahead = self.ahead.take();
                let ahead = match ahead.filter(|ahead| ahead.interval == interval) {
                    Some(ahead) => ahead,
                    None => begin_step(&self.model, &self.settings, &self.state, interval)?,
                };
                self.summary.director_s += ahead.cpu_s;
                Attempt::new(ahead.solver, journal)
            }
        };
        let request = attempt.solver.next();
        self.attempt = Some(attempt);
        self.handle(request, core, graph)
    }

    /// An element's task ended.
    pub fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        core: &mut Core<'_>,
    ) -> Result<(), RunError> {
        let Some(attempt) = &mut self.attempt else {
            return Ok(());
        };
        let Some(&element) = attempt.tasks.get(&id) else {
            return Ok(());
        };
        match outcome {
            Ok(Finished {
                output: Done::Element(answers),
                cpu,
                ..
            }) => {
                for report in answers.iter().filter_map(|answer| answer.report.as_ref()) {
                    self.summary.revs.add(report);
                }
                self.summary.cpu_s += cpu.as_secs_f64();
                self.cost[element as usize] += cpu.as_secs_f64();
                let begun = thread_cpu_time();
                attempt.take(answers)?;
                self.summary.director_s += cpu_since(begun);
                core.progress.task_done();
            }
            Ok(_) => return Err(RunError::Engine("an element gave something else".into())),
            Err(failure) => {
                self.summary.cpu_s += failure.cpu.as_secs_f64();
                if failed_task::meaning(&failure)? == Meaning::Stopped {
                    return Ok(());
                }
                let per_element = self.model.problem.points_per_element() as u32;
                let point = match &failure.cause {
                    Cause::Failed(JobError::Point(error)) => error.point,
                    _ => GaussPointId(element * per_element),
                };
                let kept = failed_task::keep(core, self.step + 1, &failure);
                core.log_failure(element, &failure.to_string(), kept.as_deref());
                attempt.failed.push((point, failure.cause.to_string()));
            }
        }
        Ok(())
    }

    /// All tasks of the wave ended.
    pub fn join(
        &mut self,
        id: NodeId,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let Some(attempt) = &mut self.attempt else {
            return Ok(());
        };
        if attempt.join != Some(id) {
            return Ok(());
        }
        let begun = thread_cpu_time();
        graph.forget_before(id);
        let request = if attempt.failed.is_empty() {
            let Some(answers) = attempt.collect() else {
                // Cancelled: what is missing stays missing until the run is resumed.
                return Ok(());
            };
            let committed = Committed {
                digest: self.digest,
                points: &self.points,
            };
            attempt.lacking = attempt.lacks(&answers, committed, &self.policy);
            let voids = self.policy.voids(&answers);
            let responses: Vec<ConstitutiveResponse<2>> = answers
                .iter()
                .map(|answer| answer.response(voids))
                .collect();
            let request = attempt.solver.advance(&responses);
            if let Some(sweep) = attempt.solver.sweeps().last() {
                core.iteration(self.step + 1, sweep);
            }
            request
        } else {
            let mut failed = std::mem::take(&mut attempt.failed);
            failed.sort_by_key(|(point, _)| *point);
            attempt.solver.advance_failed(failed)
        };
        self.summary.director_s += cpu_since(begun);
        self.handle(request, core, graph)
    }

    fn handle(
        &mut self,
        request: Request<2>,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        match request {
            Request::Evaluate(wave) => {
                let Some(attempt) = &mut self.attempt else {
                    return Ok(());
                };
                let begun = thread_cpu_time();
                attempt.forget();
                let committed = Committed {
                    digest: self.digest,
                    points: &self.points,
                };
                attempt.send(
                    wave,
                    &self.model.problem,
                    committed,
                    &self.schedule,
                    &self.policy,
                    graph,
                )?;
                self.summary.director_s += cpu_since(begun);
                core.wave_started(
                    self.step + 1,
                    attempt.wave(),
                    attempt.elements,
                    attempt.done,
                );
                Ok(())
            }
            Request::Converged(outcome) => {
                self.commit(*outcome, core)?;
                self.begin(core, graph)
            }
            Request::Failed(failure) => self.cut(&failure, core, graph),
        }
    }

    fn cut(
        &mut self,
        failure: &StepFailure,
        core: &mut Core<'_>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let mut reason = failure.to_string();
        if let Some(attempt) = self.attempt.take() {
            if let Some((point, why)) = attempt.lacking.first()
                && matches!(failure.reason, FailureReason::Provisional { .. })
            {
                let (element, local) = self.model.problem.locate(*point);
                reason = format!("{reason}; e{element}.{local}: {why}");
            }
            attempt.journal.abandon()?;
        }
        let step = self.step + 1;
        // No shorter step would give the load an effect.
        if let FailureReason::NoControl { load } = failure.reason {
            let name = self.schedule.load(load);
            core.ending = Some(Ending::Failed(format!(
                "load step {step} cannot be solved: the load `{name}` does not move what the stage follows"
            )));
            return Ok(());
        }
        match self.schedule.cut() {
            Ok(()) => {
                core.step_cut(step, self.schedule.place.control.factor(), &reason);
                self.begin(core, graph)
            }
            Err(too_small) => {
                let stage = self
                    .interval
                    .as_ref()
                    .map_or("", |interval| interval.stage.as_str());
                core.ending = Some(Ending::Failed(format!(
                    "load step {step} (stage `{stage}`) cannot be solved: {reason}; {too_small}"
                )));
                Ok(())
            }
        }
    }

    fn commit(&mut self, outcome: StepOutcome<2>, core: &mut Core<'_>) -> Result<(), RunError> {
        let Some(attempt) = self.attempt.take() else {
            return Ok(());
        };
        let Some(interval) = self.interval.take() else {
            return Ok(());
        };
        let begun = thread_cpu_time();
        let points = attempt
            .states_of(outcome.wave)
            .ok_or_else(|| RunError::Engine(format!("wave {} is gone", outcome.wave)))?;
        let cuts = self.schedule.cuts;
        self.schedule.accept(Taken {
            sweeps: outcome.sweeps.len(),
            work: outcome.work,
            damped: outcome.damped,
        });
        let reached = BodyReached {
            model: &self.model,
            state: &outcome.state,
        };
        let ended = self.schedule.stop(&reached);
        let summary = StepSummary {
            increment: interval.increment,
            stage: interval.stage,
            position: interval.part.1,
            loads: outcome.state.loads.clone(),
            ended: ended.unwrap_or_default(),
            sweeps: outcome.sweeps.clone(),
            cuts,
            work: outcome.work,
            released: outcome.released,
            damped: outcome.damped,
            voids: points.iter().filter(|point| point.is_void()).count() as u32,
            wall_s: self.begun.map_or(0.0, |begun| core.seconds(&begun)),
            ..std::mem::take(&mut self.summary)
        };
        let mut summary = summary;
        summary.accept(outcome.accepted, outcome.residual);
        let cost = Frame {
            id: FrameId::new(COST, 0),
            role: Role::Diagnostic,
            encoding: store::Encoding::Raw,
            payload: frames::encode(&self.cost),
        };
        summary.director_s += cpu_since(begun);
        let mut extra = vec![
            frames::content(MACRO, 0, &outcome.state),
            frames::content(PROGRESS, 0, &self.schedule.place),
            cost,
        ];
        let asked = attempt.asked.leading_to(outcome.wave).unwrap_or_default();
        extra.extend(asked.into_iter().map(AskedWave::frame));
        let seal = Seal {
            final_wave: Some(store::WaveIndex(outcome.wave)),
            extra,
            summary: frames::encode(&summary),
        };
        let next = self.schedule.next(&reached);
        let (committed, ahead) = beside(
            || {
                let begun = thread_cpu_time();
                let committed = attempt.journal.commit(seal, |id| id.kind == POINT);
                committed.map(|committed| (committed, cpu_since(begun)))
            },
            // One that cannot be begun is begun again when it is its turn, and says why.
            || begin_step(&self.model, &self.settings, &outcome.state, next?).ok(),
        )?;
        let (committed, commit_s) = committed?;
        self.commit_s = commit_s;
        self.ahead = ahead;
        self.step += 1;
        self.digest = committed.digest;
        self.last_bytes = committed.bytes;
        self.state = outcome.state;
        self.points = points;
        let line = CommittedStep {
            step: interval.increment,
            of: self.schedule.increments(),
            iterations: summary.sweeps.len() as u32,
            residual: summary.residual,
            position: summary.position,
            loosely_accepted: summary.loosely_accepted,
        };
        core.step_committed(self.step, &committed, &summary, &line);
        Ok(())
    }
}

/// A committed state of a body, as the programme asks for it.
struct BodyReached<'a> {
    model: &'a Model,
    state: &'a MacroState<2>,
}

impl Reached for BodyReached<'_> {
    fn loads(&self) -> &[f64] {
        &self.state.loads
    }

    fn expansion(&self, boundary: &str) -> f64 {
        let cavity = self.model.problem.cavity(boundary);
        // Every boundary that the programme names was measured when the run was set up.
        cavity.map_or(f64::NAN, |cavity| cavity.expansion(&self.state.coordinates))
    }

    fn shear_strain(&self) -> f64 {
        let gradients = post::deformation_gradients(&self.model.problem, &self.state.coordinates);
        let strains = gradients
            .iter()
            .map(|f| post::second_invariant(&post::logarithmic(f)));
        strains.fold(0.0, f64::max)
    }

    fn displacement(&self, at: &Along) -> f64 {
        let (problem, target) = (&self.model.problem, self.model.target(&at.on));
        post::boundary_mean_displacement(problem, &target, &self.state.displacement)[at.component]
    }

    fn force(&self, at: &Along) -> f64 {
        let (problem, target) = (&self.model.problem, self.model.target(&at.on));
        post::boundary_force(problem, &target, &self.state.reactions)[at.component]
    }
}

/// CPU seconds that this thread has used since it had used `begun`.
pub fn cpu_since(begun: Duration) -> f64 {
    thread_cpu_time().saturating_sub(begun).as_secs_f64()
}

/// How the tasks of a problem are run, REVs solved as `settings` say: one attempt more than the retries asked for, and no limit below a second.
pub fn policy(solver: &SolverSettings, settings: solver_dem::Settings) -> TaskPolicy {
    let attempts = std::num::NonZeroU32::MIN.saturating_add(solver.task_retries);
    let limit = solver.task_time_limit.max(1.0);
    TaskPolicy {
        settings,
        loss_of_confinement: solver.loss_of_confinement,
        retry: engine::RetryPolicy::attempts(attempts),
        time_limit: Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX),
    }
}
