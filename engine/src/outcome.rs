//! How a task ended, as the director is told.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use crate::{NodeId, TaskError, Work};

/// How a task ended, after all its attempts.
pub type TaskOutcome<W> = Result<Finished<<W as Work>::Output>, TaskFailure<W>>;

/// A task that succeeded.
#[derive(Clone, Debug)]
pub struct Finished<O> {
    /// What it gave.
    pub output: O,
    /// CPU time of all its attempts. A measurement, never to be used in a number.
    pub cpu: Duration,
    /// The attempt that succeeded; the first is 1.
    pub attempt: u32,
}

/// A task that did not succeed, with what is needed to reproduce it.
#[derive(thiserror::Error)]
#[error("{label}: {cause}")]
pub struct TaskFailure<W: Work> {
    /// The name of the task.
    pub label: Arc<str>,
    /// What it was to do; [`perform`](crate::perform) does it again, alone.
    pub work: Arc<W>,
    /// How often it was tried; 0 if it never started.
    pub attempts: u32,
    /// CPU time of all its attempts, as far as known.
    pub cpu: Duration,
    /// Why the last attempt failed, or why there was none.
    pub cause: Cause<W::Error>,
}

impl<W: Work> fmt::Debug for TaskFailure<W> {
    /// Without the work, which may be large.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TaskFailure")
            .field("label", &self.label)
            .field("attempts", &self.attempts)
            .field("cpu", &self.cpu)
            .field("cause", &self.cause)
            .finish_non_exhaustive()
    }
}

/// Why a task did not succeed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Cause<E> {
    /// The task's own failure.
    #[error("{0}")]
    Failed(E),
    /// The task panicked.
    #[error("panicked: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// It ran longer than its time limit.
    #[error("ran longer than its time limit")]
    TimeLimit,
    /// The run or the wave was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The executor lost it.
    #[error("lost by the executor: {message}")]
    Lost {
        /// What the executor knows about it.
        message: String,
    },
    /// It was not started, because a node that it waits for did not succeed.
    #[error("skipped, as node {after} did not succeed")]
    Skipped {
        /// The first such node that ended.
        after: NodeId,
    },
}

impl<E> From<TaskError<E>> for Cause<E> {
    fn from(error: TaskError<E>) -> Self {
        match error {
            TaskError::Failed(error) => Self::Failed(error),
            TaskError::Panicked { message } => Self::Panicked { message },
            TaskError::TimeLimit => Self::TimeLimit,
            TaskError::Cancelled => Self::Cancelled,
            TaskError::Lost { message } => Self::Lost { message },
        }
    }
}
