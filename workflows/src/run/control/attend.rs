//! The computing side: whoever directs a session is told to stop, to stand still or to flush.

use std::{
    convert::Infallible,
    path::Path,
    time::{Duration, Instant, SystemTime},
};

use engine::{CancelToken, PauseState, PauseToken};
use serde_json::json;
use store::{RunName, Store};
use tokio::{
    sync::watch,
    time::{MissedTickBehavior, interval, sleep},
};

use super::{
    Order, Stop, Urgency,
    mailbox::{Mailbox, Request},
    signals::Received,
};
use crate::{progress::Progress, run::event_log::EventLog};

/// How often requests and the deadline are looked for.
const LOOK: Duration = Duration::from_millis(300);

/// Attends to what reaches a session from outside.
pub struct Attendant<'a> {
    progress: &'a dyn Progress,
    received: watch::Receiver<Received>,
    deadline: Option<SystemTime>,
    desk: Option<Desk>,
    /// What was acted upon.
    seen: Received,
    stop: Option<Stop>,
}

/// Where requests to the session of a run come in, and where is written down what came of them.
pub struct Desk {
    store: Store,
    run: RunName,
    mailbox: Mailbox,
    log: EventLog,
    paused: Option<Pause>,
}

/// A pause that was asked for.
struct Pause {
    since: Instant,
    told: bool,
}

impl Desk {
    /// The desk of `session` of `run`.
    ///
    /// # Errors
    /// The run's event log cannot be opened.
    pub fn open(store: &Store, run: &RunName, session: &str) -> std::io::Result<Self> {
        let events = store.events_path(run);
        Ok(Self {
            store: store.clone(),
            run: run.clone(),
            mailbox: Mailbox::open(&folder(&events), session),
            log: EventLog::open(&events)?,
            paused: None,
        })
    }
}

/// Where requests for the run with this event log lie.
pub fn folder(events: &Path) -> std::path::PathBuf {
    events.with_file_name("control")
}

impl<'a> Attendant<'a> {
    /// Attends to signals and a deadline, and at the desk of a run where there is one.
    pub fn new(
        progress: &'a dyn Progress,
        received: watch::Receiver<Received>,
        deadline: Option<SystemTime>,
        desk: Option<Desk>,
    ) -> Self {
        let seen = Received {
            // What came before this session was for the one before it, or for nobody; a stop is for all.
            stops: 0,
            ..*received.borrow()
        };
        Self {
            progress,
            received,
            deadline,
            desk,
            seen,
            stop: None,
        }
    }

    /// Why the session was told to stop, if it was.
    pub fn stop(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// Attends until it is dropped.
    pub async fn attend(&mut self, cancel: &CancelToken, pause: &PauseToken) -> Infallible {
        let mut looks = interval(LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = looks.tick() => {}
                () = sleep(self.until_deadline()) => {}
                // Where nobody listens to signals any more, looking goes on.
                Ok(()) = self.received.changed() => {}
            }
            self.heed_signals(cancel).await;
            self.heed_deadline(cancel);
            self.heed_requests(cancel, pause);
            self.tell_of_pause(pause);
        }
    }

    /// How long to wait for the deadline, at most until the next look: a clock that is set is noticed then.
    fn until_deadline(&self) -> Duration {
        let ahead = self.deadline.filter(|_| self.stop.is_none());
        let left = ahead.and_then(|at| at.duration_since(SystemTime::now()).ok());
        left.map_or(LOOK, |left| left.min(LOOK))
    }

    async fn heed_signals(&mut self, cancel: &CancelToken) {
        let now = *self.received.borrow();
        if now.checkpoints != self.seen.checkpoints {
            self.checkpoint().await;
        }
        for _ in self.seen.stops..now.stops {
            self.stop_for(Stop::Signal(now.last), cancel);
        }
        self.seen = now;
    }

    fn heed_deadline(&mut self, cancel: &CancelToken) {
        if self.stop.is_none() && self.deadline.is_some_and(|at| SystemTime::now() >= at) {
            self.progress
                .note("the deadline has come: stopping when the running tasks have ended");
            self.stop = Some(Stop::Deadline);
            cancel.cancel();
        }
    }

    fn heed_requests(&mut self, cancel: &CancelToken, pause: &PauseToken) {
        let Some(desk) = &mut self.desk else { return };
        for Request { order, by, .. } in desk.mailbox.take() {
            let Some(desk) = &mut self.desk else { return };
            desk.log
                .append("asked", &json!({ "request": order.word(), "by": by }));
            match order {
                Order::Cancel(urgency, extent) => {
                    self.progress.note(&format!("{by} cancels the run"));
                    let stop = Stop::Request(by, extent);
                    if urgency == Urgency::AtOnce {
                        self.stop.get_or_insert(stop);
                        cancel.cancel_now();
                    } else {
                        self.stop_for(stop, cancel);
                    }
                }
                Order::Pause => {
                    if desk.paused.is_none() {
                        self.progress.note(&format!(
                            "{by} pauses the run: no new task starts until `femdem-flow continue {}`",
                            desk.run
                        ));
                        desk.paused = Some(Pause {
                            since: Instant::now(),
                            told: false,
                        });
                    }
                    pause.pause();
                }
                Order::Continue => {
                    pause.go_on();
                    let paused = desk.paused.take();
                    let seconds = paused.map_or(0.0, |pause| pause.since.elapsed().as_secs_f64());
                    desk.log
                        .append("continued", &json!({ "paused_s": seconds }));
                    self.progress.note(&format!(
                        "the run goes on after a pause of {}",
                        crate::run::text::duration(seconds)
                    ));
                }
            }
        }
    }

    /// Says once that nothing runs any more.
    fn tell_of_pause(&mut self, pause: &PauseToken) {
        let paused = self.desk.as_mut().and_then(|desk| {
            let told = &mut desk.paused.as_mut()?.told;
            (pause.state() == PauseState::Paused && !std::mem::replace(told, true))
                .then_some(&mut desk.log)
        });
        if let Some(log) = paused {
            log.append("paused", &json!({}));
            self.progress.note("paused: nothing runs");
        }
    }

    /// The first stop is in order, each further one at once.
    fn stop_for(&mut self, stop: Stop, cancel: &CancelToken) {
        match &self.stop {
            None => {
                self.progress
                    .note("stopping when the running tasks have ended; once more stops at once");
                cancel.cancel();
            }
            Some(_) => cancel.cancel_now(),
        }
        // The latest one says how the process ends, as it always did for signals.
        self.stop = Some(stop);
    }

    /// Brings what the run has journalled onto the disk.
    async fn checkpoint(&mut self) {
        let Some(desk) = &mut self.desk else {
            self.progress.note(
                "SIGUSR1: nothing is journalled here; each packing is kept as soon as it is made",
            );
            return;
        };
        let begun = Instant::now();
        let (store, run) = (desk.store.clone(), desk.run.clone());
        // Off the async thread: a disk may take its time, and tasks go on meanwhile.
        let synced = tokio::task::spawn_blocking(move || store.sync_run(&run)).await;
        let took = begun.elapsed().as_secs_f64();
        let note = match synced {
            Ok(Ok(bytes)) => {
                desk.log
                    .append("checkpoint", &json!({ "bytes": bytes, "took_s": took }));
                format!(
                    "checkpoint: {} of the running step are on the disk, nothing that is finished can be lost; the run goes on",
                    crate::run::text::bytes(bytes)
                )
            }
            Ok(Err(error)) => format!("the checkpoint failed, the run goes on: failed to {error}"),
            Err(error) => format!("the checkpoint failed, the run goes on: {error}"),
        };
        self.progress.note(&note);
    }
}
