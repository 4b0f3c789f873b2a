//! Holding a run up for a while.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;

/// Where a run is between going on and standing still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PauseState {
    /// Not paused.
    Running,
    /// A pause was asked for; something still runs.
    Pausing,
    /// Nothing runs.
    Paused,
}

/// A switch that holds a run up and lets it go on; clones share it.
///
/// While a run is paused nothing new starts, no join either; tasks that run end and are delivered, and those that are
/// queued with the executor and have not begun are taken back. Nothing is lost by it, and a time limit goes on counting
/// for what runs. A paused run can be cancelled; one that has nothing left to do ends.
#[derive(Clone, Debug)]
pub struct PauseToken {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    asked: watch::Sender<bool>,
    still: Mutex<Still>,
}

/// Standing still.
#[derive(Debug, Default)]
struct Still {
    /// Since when.
    since: Option<Instant>,
    /// For how long before that.
    before: Duration,
}

impl Shared {
    fn still(&self) -> MutexGuard<'_, Still> {
        // Nothing panics while it holds the lock.
        self.still.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PauseToken {
    /// A token that has not been used.
    pub fn new() -> Self {
        Self {
            shared: Arc::new(Shared {
                asked: watch::Sender::new(false),
                still: Mutex::default(),
            }),
        }
    }

    /// Asks for a pause.
    pub fn pause(&self) {
        self.ask(true);
    }

    /// Lets the run go on.
    pub fn go_on(&self) {
        self.ask(false);
    }

    /// What was asked, and whether the run has come to it.
    pub fn state(&self) -> PauseState {
        match (self.is_asked(), self.shared.still().since.is_some()) {
            (false, _) => PauseState::Running,
            (true, false) => PauseState::Pausing,
            (true, true) => PauseState::Paused,
        }
    }

    /// For how long the run has stood still in all: a measurement, to be taken off others.
    pub fn stood_still(&self) -> Duration {
        let still = self.shared.still();
        still.before + still.since.map_or(Duration::ZERO, |since| since.elapsed())
    }

    pub(crate) fn is_asked(&self) -> bool {
        *self.shared.asked.borrow()
    }

    pub(crate) fn subscribe(&self) -> watch::Receiver<bool> {
        self.shared.asked.subscribe()
    }

    /// The scheduler says whether anything runs.
    pub(crate) fn stands_still(&self, still: bool) {
        let mut state = self.shared.still();
        match (state.since, still) {
            (None, true) => state.since = Some(Instant::now()),
            (Some(since), false) => {
                state.since = None;
                state.before += since.elapsed();
            }
            (None, false) | (Some(_), true) => {}
        }
    }

    fn ask(&self, pause: bool) {
        self.shared.asked.send_if_modified(|asked| {
            let changed = *asked != pause;
            *asked = pause;
            changed
        });
    }
}

impl Default for PauseToken {
    fn default() -> Self {
        Self::new()
    }
}
