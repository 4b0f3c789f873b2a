//! Progress as plain lines, one for each iteration and each step.

use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::remaining::{Remaining, in_words};
use crate::progress::{CommittedStep, Progress};
use crate::run::text;

/// Writes plain lines.
pub struct Lines<W: Write + Send> {
    state: Mutex<State<W>>,
}

struct State<W> {
    out: W,
    step: String,
    tasks: u64,
    remaining: Remaining,
}

impl<W: Write + Send> Lines<W> {
    /// Lines to `out`.
    pub fn new(out: W) -> Self {
        let state = State {
            out,
            step: String::new(),
            tasks: 0,
            remaining: Remaining::new(),
        };
        Self {
            state: Mutex::new(state),
        }
    }

    fn state(&self) -> MutexGuard<'_, State<W>> {
        // A line that was cut short by a panic elsewhere is no reason to say no more.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<W> State<W>
where
    W: Write,
{
    fn line(&mut self, text: &str) {
        // Progress is not worth ending a run for: a closed stderr is passed over.
        let _ = writeln!(self.out, "{text}");
    }
}

impl<W: Write + Send> Progress for Lines<W> {
    fn run_started(&self, run: &str, done: u64, of: u64) {
        let mut state = self.state();
        state.remaining.restart();
        state.line(&started(run, done, of));
    }

    fn step_started(&self, step: u64, of: u64, stage: &str) {
        self.state().step = format!("increment {step}/{of} {stage}");
    }

    fn wave_started(&self, _iteration: u32, tasks: u64, _done: u64) {
        self.state().tasks = tasks;
    }

    fn task_done(&self) {}

    fn iteration(&self, iteration: u32, residual: f64) {
        let mut state = self.state();
        let line = format!(
            "{}: iteration {iteration}, residual {residual:.1e}, {}",
            state.step,
            text::count(state.tasks as usize, "REV task")
        );
        state.line(&line);
    }

    fn step_cut(&self, fraction: f64, reason: &str) {
        let mut state = self.state();
        let line = format!(
            "{}: cut to {fraction} of the increment: {reason}",
            state.step
        );
        state.line(&line);
    }

    fn step_committed(&self, step: &CommittedStep) {
        let mut state = self.state();
        let line = committed(step, &mut state.remaining);
        state.line(&line);
    }

    fn note(&self, text: &str) {
        self.state().line(text);
    }

    fn warning(&self, text: &str) {
        self.state().line(text);
    }

    fn finished(&self) {}
}

/// The line for a run that begins or goes on, here and above the bar.
pub fn started(run: &str, done: u64, of: u64) -> String {
    let all = text::count(of as usize, "increment");
    match done {
        0 => format!("run {run}: {all}"),
        _ if done < of => format!("run {run}: {done} of {all} done, going on"),
        _ => format!("run {run}: {done} of {all} done"),
    }
}

/// The line for a committed step, here and above the bar.
pub fn committed(step: &CommittedStep, remaining: &mut Remaining) -> String {
    let took = in_words(remaining.step_done());
    let CommittedStep {
        step,
        of,
        iterations,
        residual,
        position,
        loosely_accepted,
    } = *step;
    let left = match (
        of.saturating_sub(step),
        remaining.estimate(of.saturating_sub(step)),
    ) {
        (0, _) | (_, None) => String::new(),
        (_, Some(time)) => format!(", about {} left", in_words(time)),
    };
    let plural = if iterations == 1 { "" } else { "s" };
    let part = match position {
        whole if whole >= 1.0 => String::new(),
        part => format!(" up to {part:.3} of it"),
    };
    let loose = match loosely_accepted {
        true => " (ABOVE the tolerance, no iteration came lower)",
        false => "",
    };
    format!(
        "increment {step}/{of} committed{part}: {iterations} iteration{plural}, residual {residual:.1e}{loose}, {took}{left}"
    )
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_log_says_where_the_run_is_without_a_terminal() {
        let out = Shared::default();
        let lines = Lines::new(out.clone());
        lines.run_started("hollow", 0, 2);
        for step in 1..=2 {
            lines.step_started(step, 2, "unloading");
            lines.wave_started(1, 192, 0);
            lines.task_done();
            lines.iteration(1, 3.16e-4);
            lines.step_committed(&CommittedStep {
                step,
                of: 2,
                iterations: 1,
                residual: 3.16e-4,
                position: 1.0,
                loosely_accepted: false,
            });
        }
        lines.step_committed(&CommittedStep {
            step: 2,
            of: 2,
            iterations: 28,
            residual: 1.5e-3,
            position: 0.25,
            loosely_accepted: true,
        });
        lines.finished();
        let text = String::from_utf8(out.0.lock().unwrap().clone()).unwrap();
        assert_eq!(
            text,
            "run hollow: 2 increments\n\
             increment 1/2 unloading: iteration 1, residual 3.2e-4, 192 REV tasks\n\
             increment 1/2 committed: 1 iteration, residual 3.2e-4, 0 s, about 0 s left\n\
             increment 2/2 unloading: iteration 1, residual 3.2e-4, 192 REV tasks\n\
             increment 2/2 committed: 1 iteration, residual 3.2e-4, 0 s\n\
             increment 2/2 committed up to 0.250 of it: 28 iterations, residual 1.5e-3 (ABOVE the tolerance, no iteration \
             came lower), 0 s\n"
        );
    }
}
