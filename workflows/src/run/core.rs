//! What all phases of a run share: the store, who is told, and how it ends.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use engine::PauseToken;
use serde::Serialize;
use serde_json::json;
use solver_fem::newton::SweepReport;
use store::{Committed, RunName, Store};

use super::{
    error::RunError,
    event_log::EventLog,
    schedule::Interval,
    summary::{StageEnd, StepSummary},
};
use crate::progress::{CommittedStep, Progress};

/// How a run ended by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// At the end of its programme.
    Completed,
    /// At a step that cannot be solved, in these words.
    Failed(String),
}

/// Since when something is done. Time in which the run was paused does not count.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    begun: Instant,
    paused: Duration,
}

/// What all phases of a run share.
pub struct Core<'a> {
    /// Where it is kept.
    pub store: &'a Store,
    /// Its name.
    pub run: &'a RunName,
    /// Who is shown the progress.
    pub progress: &'a dyn Progress,
    /// How it ended; `None` while it goes on, and when it was interrupted.
    pub ending: Option<Ending>,
    /// Holds the session up.
    pub pause: PauseToken,
    log: EventLog,
}

impl<'a> Core<'a> {
    /// The core of a session of `run`; its events are appended to the run's `events.jsonl`.
    ///
    /// # Errors
    /// The event log cannot be opened.
    pub fn new(
        store: &'a Store,
        run: &'a RunName,
        progress: &'a dyn Progress,
    ) -> Result<Self, RunError> {
        let path = store.events_path(run);
        let log = EventLog::open(&path).map_err(|error| RunError::File { path, error })?;
        Ok(Self {
            store,
            run,
            progress,
            ending: None,
            pause: PauseToken::new(),
            log,
        })
    }

    /// Begins to measure a time.
    pub fn stopwatch(&self) -> Stopwatch {
        Stopwatch {
            begun: Instant::now(),
            paused: self.pause.stood_still(),
        }
    }

    /// Wall seconds since `stopwatch` began.
    pub fn seconds(&self, stopwatch: &Stopwatch) -> f64 {
        let paused = self.pause.stood_still().saturating_sub(stopwatch.paused);
        stopwatch
            .begun
            .elapsed()
            .saturating_sub(paused)
            .as_secs_f64()
    }

    /// Appends one line to the event log: others read from it how far the run is.
    pub fn log(&mut self, event: &str, data: &impl Serialize) {
        self.log.append(event, data);
    }

    /// A load step begins, or is taken up again.
    pub fn step_started(&mut self, step: u32, interval: &Interval, increments: u64) {
        self.progress
            .step_started(interval.increment, increments, &interval.stage);
        self.log(
            "step_started",
            &json!({
                "step": step,
                "increment": interval.increment,
                "of": increments,
                "stage": interval.stage,
                "part": interval.part,
            }),
        );
    }

    /// A wave is out.
    pub fn wave_started(&mut self, step: u32, wave: u32, tasks: usize, done: usize) {
        self.progress
            .wave_started(wave + 1, tasks as u64, done as u64);
        self.log(
            "wave_started",
            &json!({ "step": step, "wave": wave, "tasks": tasks, "done": done }),
        );
    }

    /// A wave was assembled.
    pub fn iteration(&mut self, step: u32, sweep: &SweepReport) {
        self.progress.iteration(sweep.wave + 1, sweep.residual);
        self.log("iteration", &json!({ "step": step, "sweep": sweep }));
    }

    /// The step is tried again, shorter.
    pub fn step_cut(&mut self, step: u32, factor: f64, reason: &str) {
        self.progress.step_cut(factor, reason);
        self.log(
            "step_cut",
            &json!({ "step": step, "factor": factor, "reason": reason }),
        );
    }

    /// A task failed for good.
    pub fn log_failure(&mut self, element: u32, reason: &str, kept: Option<&Path>) {
        let kept = kept.map(|path| path.display().to_string());
        self.log(
            "task_failed",
            &json!({ "element": element, "reason": reason, "kept": kept }),
        );
    }

    /// A step is committed, and perhaps its stage has ended with it.
    pub fn step_committed(
        &mut self,
        step: u32,
        committed: &Committed,
        summary: &StepSummary,
        line: &CommittedStep,
    ) {
        self.progress.step_committed(line);
        self.log(
            "step_committed",
            &json!({
                "step": step,
                "digest": committed.digest.to_string(),
                "bytes": committed.bytes,
                "summary": summary,
            }),
        );
        if let Some(end) = StageEnd::of(step, summary) {
            self.progress
                .note(&format!("stage `{}` ends: {}", end.stage, end.ended));
            self.log("stage_ended", &end);
        }
    }
}
