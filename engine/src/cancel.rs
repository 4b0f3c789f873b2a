//! Asking a run to stop.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tokio::sync::watch;

/// How urgently a run was asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CancelLevel {
    /// Not at all.
    None,
    /// Start nothing new; what runs may finish and is delivered.
    Graceful,
    /// Do not wait for what runs.
    Now,
}

/// A switch that stops a run; clones share it. It only ever becomes more urgent.
///
/// Safe to use from any thread, also from a task that waits for Ctrl-C. (Not from inside a signal
/// handler itself: it takes a lock.)
#[derive(Clone, Debug)]
pub struct CancelToken {
    level: Arc<watch::Sender<CancelLevel>>,
}

impl CancelToken {
    /// A token that has not been used.
    pub fn new() -> Self {
        Self {
            level: Arc::new(watch::Sender::new(CancelLevel::None)),
        }
    }

    /// Asks for a stop in order: tasks that run may finish, nothing new starts (no join either), and
    /// what has finished is still delivered to the director.
    pub fn cancel(&self) {
        self.raise(CancelLevel::Graceful);
    }

    /// Asks for a stop at once: tasks that run are told to stop and reported as cancelled without
    /// waiting for them. A call of the director in progress is still waited for.
    pub fn cancel_now(&self) {
        self.raise(CancelLevel::Now);
    }

    /// What has been asked so far.
    pub fn level(&self) -> CancelLevel {
        *self.level.borrow()
    }

    pub(crate) fn subscribe(&self) -> watch::Receiver<CancelLevel> {
        self.level.subscribe()
    }

    fn raise(&self, to: CancelLevel) {
        self.level.send_if_modified(|level| {
            let raised = *level < to;
            *level = to.max(*level);
            raised
        });
    }
}

impl Default for CancelToken {
    fn default() -> Self {
        Self::new()
    }
}
