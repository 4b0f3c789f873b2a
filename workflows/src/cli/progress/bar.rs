//! Progress as one live line at a terminal, with a line that stays for each committed step.

use std::sync::{Mutex, MutexGuard, PoisonError};

use indicatif::{ProgressBar, ProgressStyle};

use super::lines::{committed, started};
use super::remaining::{Remaining, in_words};
use crate::progress::{CommittedStep, Progress};

/// A live line on stderr.
pub struct Bar {
    bar: ProgressBar,
    state: Mutex<State>,
}

struct State {
    step: String,
    steps_left: u64,
    residual: Option<f64>,
    remaining: Remaining,
}

impl Bar {
    pub fn new() -> Self {
        let style = ProgressStyle::with_template("{prefix} [{bar:24}] {pos}/{len} REV tasks {msg}")
            .expect("the template is a constant, and the test below has drawn it")
            .progress_chars("=> ");
        let state = State {
            step: String::new(),
            steps_left: 0,
            residual: None,
            remaining: Remaining::new(),
        };
        Self {
            bar: ProgressBar::no_length().with_style(style),
            state: Mutex::new(state),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // A view that was cut short by a panic elsewhere is no reason to show no more.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Bar {
    fn run_started(&self, run: &str, done: u64, of: u64) {
        self.state().remaining.restart();
        // A second run after the first one is finished.
        self.bar.reset();
        self.bar.println(started(run, done, of));
    }

    fn step_started(&self, step: u64, of: u64, stage: &str) {
        let mut state = self.state();
        state.step = format!("increment {step}/{of} {stage}");
        state.steps_left = of.saturating_sub(step) + 1;
        state.residual = None;
    }

    fn wave_started(&self, iteration: u32, tasks: u64, done: u64) {
        let state = self.state();
        let residual = state.residual.map_or(String::new(), |residual| {
            format!(", residual {residual:.1e}")
        });
        self.bar
            .set_prefix(format!("{}: iteration {iteration}{residual}", state.step));
        let left = state.remaining.estimate(state.steps_left);
        self.bar.set_message(left.map_or(String::new(), |time| {
            format!("about {} left", in_words(time))
        }));
        self.bar.set_length(tasks);
        self.bar.set_position(done);
    }

    fn task_done(&self) {
        self.bar.inc(1);
    }

    fn iteration(&self, _iteration: u32, residual: f64) {
        self.state().residual = Some(residual);
    }

    fn step_cut(&self, fraction: f64, reason: &str) {
        let line = format!(
            "{}: cut to {fraction} of the increment: {reason}",
            self.state().step
        );
        self.bar.println(line);
    }

    fn step_committed(&self, step: &CommittedStep) {
        let line = committed(step, &mut self.state().remaining);
        self.bar.println(line);
    }

    fn note(&self, text: &str) {
        self.bar.println(text);
    }

    fn warning(&self, text: &str) {
        self.bar.println(text);
    }

    fn finished(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_can_be_drawn() {
        let bar = Bar::new();
        bar.run_started("hollow", 1, 2);
        bar.step_started(2, 2, "unloading");
        bar.wave_started(1, 8, 3);
        bar.task_done();
        assert_eq!(bar.bar.position(), 4);
        bar.iteration(1, 1e-3);
        bar.step_committed(&CommittedStep {
            step: 2,
            of: 2,
            iterations: 1,
            residual: 1e-3,
            position: 1.0,
            loosely_accepted: false,
        });
        bar.finished();
    }
}
