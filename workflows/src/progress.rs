//! What a run tells about its progress while it goes on. The run calls, the command line shows.

/// Listens to a run. Called from one thread after the other, perhaps from several at once in [`Progress::task_done`].
///
/// Steps are counted from 1, iterations from 1. Nothing here may influence the computation.
pub trait Progress: Send + Sync {
    /// A run begins, or goes on: `done` of its `of` load steps are committed already.
    fn run_started(&self, run: &str, done: u64, of: u64);
    /// Load step `step` begins, in stage `stage` of the programme.
    fn step_started(&self, step: u64, of: u64, stage: &str);
    /// A wave of `tasks` REV tasks begins, for Newton iteration `iteration`; `done` of them were in the journal.
    fn wave_started(&self, iteration: u32, tasks: u64, done: u64);
    /// One more task of the wave is done.
    fn task_done(&self);
    /// The wave is done: the unbalanced force over the reactions is now `residual`.
    fn iteration(&self, iteration: u32, residual: f64);
    /// The step could not be solved and is tried again with `fraction` of its increment.
    fn step_cut(&self, fraction: f64, reason: &str);
    /// The step is committed.
    fn step_committed(&self, step: &CommittedStep);
    /// Something the user should read, once.
    fn note(&self, text: &str);
    /// Something went wrong that does not end the run; shown whatever else is.
    fn warning(&self, text: &str);
    /// The run ends, well or not; nothing more comes.
    fn finished(&self);
}

/// A committed load step, as it is reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommittedStep {
    /// Its number, from 1.
    pub step: u64,
    /// The number of load steps of the run.
    pub of: u64,
    /// Newton iterations it took.
    pub iterations: u32,
    /// Unbalanced force over the reactions at its end.
    pub residual: f64,
    /// How much of the load step of the programme is done with it: 1, unless the step was cut.
    pub position: f64,
    /// Whether the residual is above the tolerance, and was accepted because no iteration got it lower.
    pub loosely_accepted: bool,
}

/// Tells nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn run_started(&self, _run: &str, _done: u64, _of: u64) {}
    fn step_started(&self, _step: u64, _of: u64, _stage: &str) {}
    fn wave_started(&self, _iteration: u32, _tasks: u64, _done: u64) {}
    fn task_done(&self) {}
    fn iteration(&self, _iteration: u32, _residual: f64) {}
    fn step_cut(&self, _fraction: f64, _reason: &str) {}
    fn step_committed(&self, _step: &CommittedStep) {}
    fn note(&self, _text: &str) {}
    fn warning(&self, _text: &str) {}
    fn finished(&self) {}
}
