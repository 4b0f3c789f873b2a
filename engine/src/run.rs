//! Running a graph.

use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tokio::sync::mpsc::unbounded_channel;
use tokio::task::JoinSet;

use crate::director::{DirectorFailure, serve};
use crate::scheduler::{Channels, Policy, Scheduler};
use crate::{CancelToken, Director, EventSink, Executor, Graph, GraphHandle, PauseToken, Work};

/// What the failure of one task means for others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnFailure {
    /// Nothing, except that tasks that wait for it are skipped.
    #[default]
    Continue,
    /// Its wave is stopped: every other task that the same joins wait for. Those not started are
    /// reported as cancelled, those running are told to stop; then the joins are called.
    StopWave,
}

/// How to run a graph.
#[derive(Debug)]
pub struct RunOptions {
    /// Stops the run.
    pub cancel: CancelToken,
    /// Holds the run up and lets it go on.
    pub pause: PauseToken,
    /// Where events go.
    pub events: EventSink,
    /// What the failure of one task means for others.
    pub on_failure: OnFailure,
    /// How long after its time limit a task may still stop by itself, before it is given up.
    pub grace: Duration,
}

impl Default for RunOptions {
    /// No cancellation, no pause, no events, failures do not affect others, half a second of grace.
    fn default() -> Self {
        Self {
            cancel: CancelToken::new(),
            pause: PauseToken::new(),
            events: EventSink::none(),
            on_failure: OnFailure::Continue,
            grace: Duration::from_millis(500),
        }
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunEnd {
    /// Every node has ended.
    #[default]
    Complete,
    /// It was cancelled, in order or at once.
    Cancelled,
    /// The director failed; [`run`] returns its error.
    DirectorFailed,
}

/// What a run did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// How it ended.
    pub end: RunEnd,
    /// Tasks that succeeded.
    pub succeeded: u64,
    /// Tasks that failed after all their attempts.
    pub failed: u64,
    /// Tasks that were cancelled and reported as such.
    pub cancelled: u64,
    /// Tasks that were skipped because something before them failed.
    pub skipped: u64,
    /// Attempts that failed and were followed by another one.
    pub retries: u64,
    /// Joins that the director has done.
    pub joins: u64,
    /// Nodes that had not ended when the run did; 0 if it is complete.
    pub not_run: u64,
    /// CPU time of all attempts, as far as known.
    pub cpu: Duration,
    /// Wall time of the run.
    pub wall: Duration,
}

/// Why a run did not end in order.
#[derive(Debug, thiserror::Error)]
pub enum RunError<E: std::error::Error + 'static> {
    /// The director returned an error.
    #[error("decide what comes next")]
    Director(#[source] E),
    /// The director panicked.
    #[error("decide what comes next: panicked: {message}")]
    DirectorPanicked {
        /// What the panic said.
        message: String,
    },
    /// The scheduler ended before the run did: the runtime was shut down, or there is a bug.
    #[error("schedule tasks")]
    Scheduler(#[source] Option<tokio::task::JoinError>),
    /// No runtime could be started for the run.
    #[error("start the async runtime")]
    Runtime(#[source] std::io::Error),
    /// [`run_blocking`] was called on an async thread, where [`run`] is the one to use.
    #[error("start the async runtime: already inside one")]
    NestedRuntime,
}

/// Runs a graph to its end, growth included.
///
/// Needs a Tokio runtime with time enabled. Dropping the future gives up all that runs. Calls to
/// the director are made off the async threads where the runtime has several.
///
/// # Errors
/// [`RunError`] if the director fails: nothing more is started, what runs is given up, and the
/// director is not called again. Failing tasks and cancellation are no errors.
pub async fn run<W, D, E>(
    graph: Graph<W>,
    director: &mut D,
    executor: Arc<E>,
    options: RunOptions,
) -> Result<RunSummary, RunError<D::Error>>
where
    W: Work,
    D: Director<W>,
    E: Executor<W> + ?Sized + 'static,
{
    let (events, pump) = options.events.start();
    let pump = pump.map(tokio::task::spawn_blocking);
    let (calls, calls_receiver) = unbounded_channel();
    let (to_inbox, inbox) = unbounded_channel();
    let channels = Channels {
        inbox,
        to_inbox: to_inbox.clone(),
        calls,
        cancel: options.cancel.subscribe(),
        pause_asked: options.pause.subscribe(),
        pause: options.pause,
        events,
    };
    let policy = Policy {
        on_failure: options.on_failure,
        grace: options.grace,
    };
    let handle = GraphHandle::new(graph.growth.next(), options.cancel);

    // A set of one, as it aborts the scheduler if this future is dropped.
    let mut scheduler = JoinSet::new();
    scheduler.spawn(Scheduler::new(executor, channels, policy).run(graph));
    let served = serve(director, handle, calls_receiver, to_inbox).await;
    let summary = match scheduler.join_next().await {
        Some(Ok(summary)) => Ok(summary),
        Some(Err(error)) => Err(RunError::Scheduler(Some(error))),
        None => Err(RunError::Scheduler(None)),
    };
    if let Some(pump) = pump
        && pump.await.is_err()
    {
        tracing::warn!("the event sink panicked; later events were dropped");
    }
    match served {
        Ok(()) => summary,
        Err(DirectorFailure::Error(error)) => Err(RunError::Director(error)),
        Err(DirectorFailure::Panicked { message }) => Err(RunError::DirectorPanicked { message }),
    }
}

/// Runs a graph to its end on a runtime made for it; the director is called on this thread.
///
/// # Errors
/// As [`run`]; and if no runtime can be started, or if called from inside one.
pub fn run_blocking<W, D, E>(
    graph: Graph<W>,
    director: &mut D,
    executor: Arc<E>,
    options: RunOptions,
) -> Result<RunSummary, RunError<D::Error>>
where
    W: Work,
    D: Director<W>,
    E: Executor<W> + ?Sized + 'static,
{
    if tokio::runtime::Handle::try_current().is_ok() {
        return Err(RunError::NestedRuntime);
    }
    // The one worker schedules; the computing is done by the executor's threads and this one.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("scheduler")
        .enable_time()
        .build()
        .map_err(RunError::Runtime)?;
    runtime.block_on(run(graph, director, executor, options))
}
