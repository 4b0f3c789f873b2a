//! No progress; warnings all the same.

use crate::progress::{CommittedStep, Progress};

/// Says nothing but warnings, on stderr.
pub struct Quiet;

impl Progress for Quiet {
    fn run_started(&self, _run: &str, _done: u64, _of: u64) {}
    fn step_started(&self, _step: u64, _of: u64, _stage: &str) {}
    fn wave_started(&self, _iteration: u32, _tasks: u64, _done: u64) {}
    fn task_done(&self) {}
    fn iteration(&self, _iteration: u32, _residual: f64) {}
    fn step_cut(&self, _fraction: f64, _reason: &str) {}
    fn step_committed(&self, _step: &CommittedStep) {}
    fn note(&self, _text: &str) {}
    fn warning(&self, text: &str) {
        use std::io::Write;
        // A closed stderr is passed over, as it is for progress.
        let _ = writeln!(std::io::stderr(), "{text}");
    }
    fn finished(&self) {}
}
