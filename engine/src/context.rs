//! What a running task may know about its run: the attempt, and whether to stop.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Why a task should stop before it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The run, or the wave of this task, was cancelled.
    Cancelled,
    /// The task has used up its time limit.
    TimeLimit,
}

const WAITING: u8 = 0;
const BEGUN: u8 = 1;
const WITHDRAWN: u8 = 2;

const NONE_SEEN: u8 = 0;
const CANCEL_SEEN: u8 = 1;
const LIMIT_SEEN: u8 = 2;

/// One attempt at one task, seen from inside and outside; clones share the same attempt.
#[derive(Clone, Debug)]
pub struct TaskContext {
    attempt: u32,
    time_limit: Option<Duration>,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    phase: AtomicU8,
    begun_at: OnceLock<Instant>,
    cancelled: AtomicBool,
    seen: AtomicU8,
}

impl TaskContext {
    /// A context for attempt number `attempt` (the first is 1) with a limit on wall time, counted
    /// from [`TaskContext::begin`].
    ///
    /// The scheduler makes its own; this is for an executor's far end and for replaying one task.
    pub fn new(attempt: u32, time_limit: Option<Duration>) -> Self {
        Self {
            attempt,
            time_limit,
            shared: Arc::default(),
        }
    }

    /// The number of this attempt; the first is 1.
    pub fn attempt(&self) -> u32 {
        self.attempt
    }

    /// The limit on the wall time of this attempt.
    pub fn time_limit(&self) -> Option<Duration> {
        self.time_limit
    }

    /// Whether the task should stop now, and why. Cheap (one clock reading where there is a limit).
    pub fn should_stop(&self) -> Option<Stop> {
        let stop = self.pending_stop();
        let seen = match stop {
            None => return None,
            Some(Stop::Cancelled) => CANCEL_SEEN,
            Some(Stop::TimeLimit) => LIMIT_SEEN,
        };
        // The first reason seen is the reason reported, even if another one follows.
        let _ =
            self.shared
                .seen
                .compare_exchange(NONE_SEEN, seen, Ordering::AcqRel, Ordering::Acquire);
        stop
    }

    /// Marks the beginning of the work; the time limit counts from here, not from the queue.
    ///
    /// For executors; [`perform`](crate::perform) calls it.
    ///
    /// # Errors
    /// The reason not to begin at all: the task was cancelled or withdrawn while it was queued.
    pub fn begin(&self) -> Result<(), Stop> {
        if self.is_cancelled() {
            return Err(Stop::Cancelled);
        }
        self.shared
            .phase
            .compare_exchange(WAITING, BEGUN, Ordering::AcqRel, Ordering::Acquire)
            .map_err(|_| Stop::Cancelled)?;
        self.shared.begun_at.get_or_init(Instant::now);
        Ok(())
    }

    /// Asks the task to stop; it notices at its next [`TaskContext::should_stop`].
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Release);
    }

    /// Takes the task back if it has not begun; a task that has begun goes on.
    pub(crate) fn withdraw(&self) {
        let _ = self.shared.phase.compare_exchange(
            WAITING,
            WITHDRAWN,
            Ordering::AcqRel,
            Ordering::Acquire,
        );
    }

    /// Whether the task was taken back before it began.
    pub(crate) fn is_withdrawn(&self) -> bool {
        self.shared.phase.load(Ordering::Acquire) == WITHDRAWN
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.shared.cancelled.load(Ordering::Acquire)
    }

    /// When the work began, if it has.
    pub(crate) fn begun_at(&self) -> Option<Instant> {
        self.shared.begun_at.get().copied()
    }

    /// The first reason to stop that the task was shown.
    pub(crate) fn stop_seen(&self) -> Option<Stop> {
        match self.shared.seen.load(Ordering::Acquire) {
            CANCEL_SEEN => Some(Stop::Cancelled),
            LIMIT_SEEN => Some(Stop::TimeLimit),
            _ => None,
        }
    }

    fn pending_stop(&self) -> Option<Stop> {
        if self.is_cancelled() {
            return Some(Stop::Cancelled);
        }
        let (limit, begun_at) = (self.time_limit?, self.begun_at()?);
        (begun_at.elapsed() >= limit).then_some(Stop::TimeLimit)
    }
}
