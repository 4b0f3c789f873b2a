//! Carrying out one attempt at one task: the contract of executors and what they share.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::{NodeId, Stop, TaskContext, Work};

/// A boxed future that can move between threads.
pub type BoxFuture<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

/// Carries tasks out somewhere: on this machine's cores, on other processes, on other machines.
///
/// An executor sends `work` to where it runs, calls [`perform`] there and brings the [`Attempt`]
/// back; all of them serialise. Retry, limits and cancellation are the scheduler's.
pub trait Executor<W: Work>: Send + Sync {
    /// Carries out one attempt.
    ///
    /// The scheduler calls this in the order in which tasks are to start, so the task is to be queued
    /// in the call itself, not when the future is first polled. The call must not block.
    ///
    /// Dropping the future abandons the attempt: its result is no longer wanted. The executor must
    /// then see to it that [`Executor::slots`] tasks still make progress, even if the abandoned
    /// one never ends.
    fn execute(
        &self,
        task: NodeId,
        work: Arc<W>,
        context: TaskContext,
    ) -> BoxFuture<'static, Attempt<W::Output, W::Error>>;

    /// How many tasks run at the same time, at least 1. Up to twice as many are handed over, so that
    /// no slot waits for the scheduler; with one slot, one.
    fn slots(&self) -> usize;
}

/// How one attempt at a task ended, and what it cost.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Attempt<O, E> {
    /// What the task gave, or why it gave nothing.
    pub result: Result<O, TaskError<E>>,
    /// CPU time of the thread that ran it; zero where it is not known.
    pub cpu: Duration,
    /// Wall time from beginning to end; zero where it did not begin.
    pub wall: Duration,
}

impl<O, E> Attempt<O, E> {
    /// An attempt that failed before it cost anything.
    pub fn failed(error: TaskError<E>) -> Self {
        Self {
            result: Err(error),
            cpu: Duration::ZERO,
            wall: Duration::ZERO,
        }
    }
}

/// Why an attempt gave nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum TaskError<E> {
    /// The task's own failure.
    #[error("{0}")]
    Failed(E),
    /// The task panicked; the message of the panic.
    #[error("panicked: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// It ran longer than its time limit.
    #[error("ran longer than its time limit")]
    TimeLimit,
    /// It was told to stop.
    #[error("cancelled")]
    Cancelled,
    /// The executor lost it, for instance with the process it ran in.
    #[error("lost by the executor: {message}")]
    Lost {
        /// What the executor knows about it.
        message: String,
    },
}

impl<E> From<Stop> for TaskError<E> {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Cancelled => Self::Cancelled,
            Stop::TimeLimit => Self::TimeLimit,
        }
    }
}

/// Carries out `work` on this thread: contains a panic, measures the time, names the reason to stop.
///
/// For executors, wherever the work finally runs, so that all report alike; also to reproduce one
/// failed task alone. If the task returns an error after it was shown a reason to stop, that reason
/// is the error; a result is a result, also when it comes late.
pub fn perform<W: Work>(work: &W, context: &TaskContext) -> Attempt<W::Output, W::Error> {
    if let Err(stop) = context.begin() {
        return Attempt::failed(stop.into());
    }
    let (wall, cpu) = (Instant::now(), thread_cpu_time());
    // Unwind safety: the work is only borrowed, and the attempt ends here either way.
    let result = match catch_unwind(AssertUnwindSafe(|| work.run(context))) {
        Ok(Ok(output)) => Ok(output),
        Ok(Err(error)) => Err(match context.stop_seen() {
            Some(stop) => stop.into(),
            None => TaskError::Failed(error),
        }),
        Err(payload) => Err(TaskError::Panicked {
            message: panic_message(payload.as_ref()),
        }),
    };
    Attempt {
        result,
        cpu: thread_cpu_time().saturating_sub(cpu),
        wall: wall.elapsed(),
    }
}

/// The text of a panic, as far as it has one.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_string())
}

/// CPU time that the calling thread has used so far; a measurement, never to be used in a number.
pub fn thread_cpu_time() -> Duration {
    clock(rustix::time::ClockId::ThreadCPUTime)
}

/// CPU time that all threads of this process have used, those that have ended included.
pub fn process_cpu_time() -> Duration {
    clock(rustix::time::ClockId::ProcessCPUTime)
}

fn clock(id: rustix::time::ClockId) -> Duration {
    let time = rustix::time::clock_gettime(id);
    Duration::new(
        u64::try_from(time.tv_sec).unwrap_or(0),
        u32::try_from(time.tv_nsec).unwrap_or(0),
    )
}
