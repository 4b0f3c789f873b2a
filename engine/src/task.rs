//! What is asked of a task: its work, what it waits for, and how patient to be with it.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use crate::NodeId;

/// A task to be added to a graph.
#[derive(Clone, Debug)]
pub struct TaskSpec<W> {
    /// A name for people, for events and failures; it need not be unique.
    pub label: Arc<str>,
    /// What to do.
    pub work: Arc<W>,
    /// The nodes that must have succeeded before.
    pub after: Vec<NodeId>,
    /// How often to try.
    pub retry: RetryPolicy,
    /// Limit on the wall time of one attempt, from the moment it begins to run.
    ///
    /// It is there for tasks that hang. A limit close to the normal duration makes the outcome
    /// depend on the load of the machine.
    pub time_limit: Option<Duration>,
    /// Of several ready tasks the one with the higher priority starts first, then the older one.
    pub priority: i32,
}

impl<W> TaskSpec<W> {
    /// A task that waits for nothing, is tried once, has no time limit, and priority 0.
    pub fn new(label: impl Into<Arc<str>>, work: W) -> Self {
        Self {
            label: label.into(),
            work: Arc::new(work),
            after: Vec::new(),
            retry: RetryPolicy::never(),
            time_limit: None,
            priority: 0,
        }
    }

    /// Also waits for these nodes.
    pub fn after(mut self, nodes: impl IntoIterator<Item = NodeId>) -> Self {
        self.after.extend(nodes);
        self
    }

    /// Sets how often to try.
    pub fn retry(mut self, retry: RetryPolicy) -> Self {
        self.retry = retry;
        self
    }

    /// Limits the wall time of one attempt.
    pub fn time_limit(mut self, limit: Duration) -> Self {
        self.time_limit = Some(limit);
        self
    }

    /// Sets the priority; higher starts first.
    pub fn priority(mut self, priority: i32) -> Self {
        self.priority = priority;
        self
    }
}

/// How often to try a task, and how long to wait in between.
///
/// Failures, panics, exceeded limits and losses are tried again; a cancelled task is not. As work is
/// pure, this helps against what is outside the work (a lost process, a limit exceeded on a busy
/// machine), and for work that looks at [`TaskContext::attempt`](crate::TaskContext::attempt).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetryPolicy {
    /// How many attempts in all.
    pub attempts: NonZeroU32,
    /// The wait between the end of an attempt and the next.
    pub delay: Duration,
}

impl RetryPolicy {
    /// One attempt.
    pub const fn never() -> Self {
        Self::attempts(NonZeroU32::MIN)
    }

    /// That many attempts in all, without a wait in between.
    pub const fn attempts(attempts: NonZeroU32) -> Self {
        Self {
            attempts,
            delay: Duration::ZERO,
        }
    }

    /// Waits that long between attempts.
    pub const fn with_delay(mut self, delay: Duration) -> Self {
        self.delay = delay;
        self
    }
}

impl Default for RetryPolicy {
    fn default() -> Self {
        Self::never()
    }
}
