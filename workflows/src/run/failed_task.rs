//! What a task without an answer means for the run.

use std::path::PathBuf;

use engine::{Cause, TaskFailure};

use super::{
    core::Core,
    error::RunError,
    frames,
    work::{Job, JobError},
};

/// What a task without an answer means, as far as it is no error of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// It was told to stop: the answer is missing until somebody asks again.
    Stopped,
    /// There is none, on no machine: the step has to be cut.
    NoAnswer,
}

/// What `failure` means for the run.
///
/// # Errors
/// The machine failed the task, not the physics. A step that is cut for that would make the result depend on how busy
/// the machine was; the run stops instead, and the task is asked again when it is resumed.
pub fn meaning(failure: &TaskFailure<Job>) -> Result<Meaning, RunError> {
    match &failure.cause {
        Cause::Cancelled | Cause::Failed(JobError::Stopped) => Ok(Meaning::Stopped),
        Cause::TimeLimit | Cause::Lost { .. } => Err(RunError::Task {
            label: failure.label.to_string(),
            attempts: failure.attempts,
            cause: failure.cause.to_string(),
        }),
        Cause::Failed(_) | Cause::Panicked { .. } | Cause::Skipped { .. } => Ok(Meaning::NoAnswer),
    }
}

/// Saves what a failed task was to do, for reproduction. Best effort: the run goes on without.
pub fn keep(core: &Core<'_>, step: u32, failure: &TaskFailure<Job>) -> Option<PathBuf> {
    let folder = core.store.dir().join("failed").join(core.run.as_str());
    let label = failure.label.replace(' ', "-");
    let path = folder.join(format!("step{step}-{label}.rmp"));
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&path, frames::encode(&*failure.work)))
        .map_err(|error| tracing::warn!(%error, "a failed task could not be saved"))
        .ok()?;
    Some(path)
}
