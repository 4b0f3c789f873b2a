//! What happens in a run, in order, for people and logs.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::{CancelLevel, NodeId, RunSummary};

/// Something that happened in a run.
///
/// Durations are measurements: fine to show, never to be used in a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Position in the stream of this run, from 0 without gaps.
    pub seq: u64,
    /// What happened.
    pub kind: EventKind,
}

/// The kinds of events. Of one task: a `TaskStarted` for each attempt, followed by `TaskFinished`,
/// `TaskRetried`, `TaskWithdrawn` or `TaskFailed`; a task that never started has one `TaskFailed`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// The run begins.
    RunStarted {
        /// How many tasks run at the same time.
        slots: usize,
    },
    /// Nodes were added; their numbers are consecutive.
    NodesAdded {
        /// The first of them.
        first: NodeId,
        /// How many.
        count: u64,
    },
    /// An attempt at a task was handed to the executor.
    TaskStarted {
        /// The task.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// The number of the attempt, from 1.
        attempt: u32,
    },
    /// A task succeeded.
    TaskFinished {
        /// The task.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// The attempt that succeeded.
        attempt: u32,
        /// CPU time of all its attempts.
        cpu: Duration,
        /// Wall time of this attempt.
        wall: Duration,
    },
    /// An attempt failed, another one follows.
    TaskRetried {
        /// The task.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// The attempt that failed.
        attempt: u32,
        /// Why it failed.
        cause: String,
    },
    /// A task failed, was cancelled or was skipped.
    TaskFailed {
        /// The task.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// How often it was tried.
        attempts: u32,
        /// Why it failed.
        cause: String,
    },
    /// A join was handed to the director.
    JoinStarted {
        /// The join.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
    },
    /// The director has done with a join.
    JoinFinished {
        /// The join.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// How long the director took.
        wall: Duration,
    },
    /// An attempt was taken back from the executor before it began, because of a pause; it does not count.
    TaskWithdrawn {
        /// The task.
        id: NodeId,
        /// Its name.
        label: Arc<str>,
        /// The attempt that was not made.
        attempt: u32,
    },
    /// A pause was asked for: nothing new starts.
    Pausing,
    /// Nothing runs any more.
    Paused,
    /// The pause is over.
    Continued,
    /// The run was asked to stop.
    Cancelled {
        /// How urgently.
        level: CancelLevel,
    },
    /// The run has ended; the last event.
    RunFinished {
        /// What it did.
        summary: RunSummary,
    },
}

/// Where events go.
pub struct EventSink(Option<Box<dyn FnMut(Event) + Send>>);

impl EventSink {
    /// Calls `sink` for each event, in order, on a thread of its own, so that a slow sink does not
    /// hold up the run. Events queue up in memory meanwhile, and [`run`](crate::run) returns only
    /// after the last one is handled. A sink that panics gets no more events.
    pub fn new(sink: impl FnMut(Event) + Send + 'static) -> Self {
        Self(Some(Box::new(sink)))
    }

    /// Drops all events.
    pub fn none() -> Self {
        Self(None)
    }

    /// Splits into the end that emits and the loop that hands on.
    pub(crate) fn start(self) -> (Emitter, Option<impl FnOnce() + Send + 'static>) {
        let (sender, pump) = match self.0 {
            None => (None, None),
            Some(mut sink) => {
                let (sender, receiver) = mpsc::channel();
                let pump = move || receiver.into_iter().for_each(&mut sink);
                (Some(sender), Some(pump))
            }
        };
        (Emitter { sender, next: 0 }, pump)
    }
}

impl Default for EventSink {
    fn default() -> Self {
        Self::none()
    }
}

impl fmt::Debug for EventSink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("EventSink").field(&self.0.is_some()).finish()
    }
}

/// Numbers events and sends them off.
#[derive(Debug)]
pub(crate) struct Emitter {
    sender: Option<mpsc::Sender<Event>>,
    next: u64,
}

impl Emitter {
    /// Emits what `kind` makes; it is not called where nobody listens.
    pub(crate) fn emit(&mut self, kind: impl FnOnce() -> EventKind) {
        let Some(sender) = &self.sender else { return };
        let event = Event {
            seq: self.next,
            kind: kind(),
        };
        self.next += 1;
        if sender.send(event).is_err() {
            // The sink panicked; its end of the channel is gone.
            self.sender = None;
        }
    }
}
