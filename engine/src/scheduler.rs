//! The loop that starts what is ready and takes in what has ended.
//!
//! One async task owns the ledger; everything that happens reaches it through one inbox, so nothing
//! is shared and the order of events is the order of its decisions.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender};
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};

use crate::director::{Call, Reply};
use crate::event::{Emitter, EventKind};
use crate::graph::Growth;
use crate::ledger::{Ending, Ledger};
use crate::limit::within_limit;
use crate::{
    Attempt, CancelLevel, Cause, Executor, Finished, Graph, NodeId, OnFailure, PauseToken, RunEnd,
    RunSummary, TaskContext, TaskError, TaskFailure, Work,
};

/// What reaches the scheduler.
pub(crate) enum Message<W: Work> {
    AttemptEnded {
        id: NodeId,
        number: u32,
        attempt: Attempt<W::Output, W::Error>,
    },
    RetryDue(NodeId),
    Reply(Reply<W>),
    DirectorFailed,
}

/// The scheduler's ends of its channels.
pub(crate) struct Channels<W: Work> {
    pub(crate) inbox: UnboundedReceiver<Message<W>>,
    /// For those who report back.
    pub(crate) to_inbox: UnboundedSender<Message<W>>,
    pub(crate) calls: UnboundedSender<Call<W>>,
    pub(crate) cancel: watch::Receiver<CancelLevel>,
    /// Wakes the scheduler when a pause is asked for or ends.
    pub(crate) pause_asked: watch::Receiver<bool>,
    pub(crate) pause: PauseToken,
    pub(crate) events: Emitter,
}

pub(crate) struct Policy {
    pub(crate) on_failure: OnFailure,
    pub(crate) grace: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Running,
    /// Cancelled: starts nothing, waits for what runs.
    Draining,
    /// Cancelled at once: starts nothing, has given up what ran.
    Halted,
    DirectorFailed,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pause {
    Off,
    /// Asked for; something still runs.
    Asked,
    /// Nothing runs.
    Still,
}

/// An attempt with the executor; dropping it gives the attempt up.
struct InFlight {
    context: TaskContext,
    handle: AbortHandle,
}

impl Drop for InFlight {
    fn drop(&mut self) {
        // Neither does anything to an attempt that has ended.
        self.context.cancel();
        self.handle.abort();
    }
}

pub(crate) struct Scheduler<W: Work, E: ?Sized> {
    ledger: Ledger<W>,
    executor: Arc<E>,
    channels: Channels<W>,
    policy: Policy,
    mode: Mode,
    /// What was asked and has been acted upon.
    cancel_level: CancelLevel,
    pause: Pause,
    /// Attempts with the executor at most.
    max_in_flight: usize,
    /// Calls that the director has not answered at most, before nothing more is started.
    max_unanswered: usize,
    in_flight: BTreeMap<NodeId, InFlight>,
    unanswered: usize,
    delayed: usize,
    timers: JoinSet<()>,
    summary: RunSummary,
}

impl<W: Work, E: Executor<W> + ?Sized + 'static> Scheduler<W, E> {
    pub(crate) fn new(executor: Arc<E>, channels: Channels<W>, policy: Policy) -> Self {
        let (max_in_flight, max_unanswered) = match executor.slots() {
            // Strictly one thing after the other: the order that a test or a debugger wants.
            0 | 1 => (1, 1),
            // A slot that ends finds the next task waiting; more would make cancelling slow. A
            // director that is slower than the tasks must not pile up their outputs.
            slots => (2 * slots, 64 + 8 * slots),
        };
        Self {
            ledger: Ledger::new(),
            executor,
            channels,
            policy,
            mode: Mode::Running,
            cancel_level: CancelLevel::None,
            pause: Pause::Off,
            max_in_flight,
            max_unanswered,
            in_flight: BTreeMap::new(),
            unanswered: 0,
            delayed: 0,
            timers: JoinSet::new(),
            summary: RunSummary::default(),
        }
    }

    /// Runs the graph to its end.
    pub(crate) async fn run(mut self, graph: Graph<W>) -> RunSummary {
        let begun = Instant::now();
        let slots = self.executor.slots().max(1);
        // The token may have served another run before.
        self.channels.pause.stands_still(false);
        self.emit(|| EventKind::RunStarted { slots });
        self.grow(graph.growth);
        loop {
            self.notice_cancel();
            self.notice_pause();
            self.start_what_is_ready();
            if self.is_over() {
                break;
            }
            tokio::select! {
                biased;
                // What was asked is looked up at the top of the loop. Once every token is dropped, as
                // after a failure of the director, nothing can be asked and this branch is passed over.
                Ok(()) = self.channels.cancel.changed() => {}
                Ok(()) = self.channels.pause_asked.changed() => {}
                message = self.channels.inbox.recv() => {
                    if let Some(message) = message {
                        self.on_message(message);
                    }
                    self.take_messages();
                }
            }
        }
        self.summary.end = match self.mode {
            Mode::Running => RunEnd::Complete,
            Mode::Draining | Mode::Halted => RunEnd::Cancelled,
            Mode::DirectorFailed => RunEnd::DirectorFailed,
        };
        self.summary.not_run = self.ledger.open() as u64;
        self.summary.wall = begun.elapsed();
        let summary = self.summary.clone();
        self.emit(|| EventKind::RunFinished { summary });
        self.summary
    }

    fn is_over(&self) -> bool {
        let waits_for_retry = self.mode == Mode::Running && self.delayed > 0;
        self.stands_still() && !waits_for_retry && !self.holds_back()
    }

    fn stands_still(&self) -> bool {
        self.in_flight.is_empty() && self.unanswered == 0
    }

    /// Whether a pause is all that keeps the run from going on.
    fn holds_back(&self) -> bool {
        self.mode == Mode::Running && self.pause != Pause::Off && self.ledger.has_ready()
    }

    fn start_what_is_ready(&mut self) {
        if self.mode != Mode::Running || self.pause != Pause::Off {
            return;
        }
        while let Some((id, after)) = self.ledger.pop_skipped() {
            self.give_up(id, Cause::Skipped { after });
        }
        while let Some(id) = self.ledger.pop_ready_join() {
            if let Some(label) = self.ledger.label(id).cloned() {
                self.emit(|| EventKind::JoinStarted { id, label });
            }
            self.call(Call::Join { id });
        }
        while self.in_flight.len() < self.max_in_flight && self.unanswered < self.max_unanswered {
            if !self.start_next() {
                break;
            }
        }
    }

    fn start_next(&mut self) -> bool {
        let Some((id, task)) = self.ledger.start_next() else {
            return false;
        };
        let attempt = task.attempts;
        let work = task.spec.work.clone();
        let label = task.spec.label.clone();
        let context = TaskContext::new(attempt, task.spec.time_limit);
        self.emit(|| EventKind::TaskStarted { id, label, attempt });

        let mut report = Report {
            to_inbox: self.channels.to_inbox.clone(),
            id,
            number: attempt,
            attempt: None,
        };
        // Handed over here, not in the task below: tokio does not poll tasks in the order of spawning.
        // Unwind safety: an executor has to cope with its own panics; here it costs one attempt.
        let handed_over = catch_unwind(AssertUnwindSafe(|| {
            self.executor.execute(id, work, context.clone())
        }));
        let inner = context.clone();
        let grace = self.policy.grace;
        let handle = tokio::spawn(async move {
            // Without a future, the report that is dropped says that the executor panicked.
            if let Ok(execution) = handed_over {
                report.ended(within_limit(execution, inner, grace).await);
            }
        })
        .abort_handle();
        self.in_flight.insert(id, InFlight { context, handle });
        true
    }

    /// Takes in what has arrived. It ends: nothing is started meanwhile.
    fn take_messages(&mut self) {
        while let Ok(message) = self.channels.inbox.try_recv() {
            self.on_message(message);
        }
    }

    fn on_message(&mut self, message: Message<W>) {
        match message {
            Message::AttemptEnded {
                id,
                number,
                attempt,
            } => self.on_attempt_ended(id, number, attempt),
            Message::RetryDue(id) => {
                self.delayed -= 1;
                self.ledger.make_ready_again(id);
            }
            Message::Reply(reply) => self.on_reply(reply),
            Message::DirectorFailed => {
                self.mode = Mode::DirectorFailed;
                self.in_flight.clear();
                self.unanswered = 0;
            }
        }
    }

    fn on_attempt_ended(&mut self, id: NodeId, number: u32, attempt: Attempt<W::Output, W::Error>) {
        let is_current = |flight: &InFlight| flight.context.attempt() == number;
        if !self.in_flight.get(&id).is_some_and(is_current) {
            // Given up before.
            return;
        }
        let Some(flight) = self.in_flight.remove(&id) else {
            return;
        };
        self.summary.cpu += attempt.cpu;
        if let Some(task) = self.ledger.task_mut(id) {
            task.cpu += attempt.cpu;
        }
        let taken_back = flight.context.is_withdrawn() && !flight.context.is_cancelled();
        if taken_back && self.mode == Mode::Running {
            let label = self.ledger.label(id).cloned().unwrap_or_default();
            self.ledger.take_back(id);
            self.emit(|| EventKind::TaskWithdrawn {
                id,
                label,
                attempt: number,
            });
            return;
        }
        match attempt.result {
            Ok(output) => self.succeed(id, output, attempt.wall),
            Err(error) => self.retry_or_give_up(id, &flight.context, error),
        }
    }

    fn succeed(&mut self, id: NodeId, output: W::Output, wall: Duration) {
        let Some(task) = self.ledger.end(id, Ending::Succeeded) else {
            return;
        };
        self.summary.succeeded += 1;
        let (label, cpu, attempt) = (task.spec.label, task.cpu, task.attempts);
        self.emit(|| EventKind::TaskFinished {
            id,
            label,
            attempt,
            cpu,
            wall,
        });
        self.call(Call::Finished {
            id,
            outcome: Ok(Finished {
                output,
                cpu,
                attempt,
            }),
        });
    }

    fn retry_or_give_up(&mut self, id: NodeId, context: &TaskContext, error: TaskError<W::Error>) {
        let cancelled = context.is_cancelled() || matches!(error, TaskError::Cancelled);
        let repeats = matches!(&error, TaskError::Failed(error) if W::repeats(error));
        let Some(task) = self.ledger.task_mut(id) else {
            return;
        };
        let retry = task.spec.retry;
        let attempt = task.attempts;
        let last = repeats || attempt >= retry.attempts.get();
        if cancelled || last || self.mode != Mode::Running {
            self.give_up(id, error.into());
            return;
        }
        let label = task.spec.label.clone();
        self.summary.retries += 1;
        self.emit(|| EventKind::TaskRetried {
            id,
            label,
            attempt,
            cause: error.to_string(),
        });
        if retry.delay.is_zero() {
            self.ledger.make_ready_again(id);
            return;
        }
        self.ledger.delay(id);
        self.delayed += 1;
        let to_inbox = self.channels.to_inbox.clone();
        while self.timers.try_join_next().is_some() {}
        self.timers.spawn(async move {
            tokio::time::sleep(retry.delay).await;
            // Nobody waits any more if the run is over.
            let _ = to_inbox.send(Message::RetryDue(id));
        });
    }

    /// Ends a task without success and tells the director.
    fn give_up(&mut self, id: NodeId, cause: Cause<W::Error>) {
        let of_itself = !matches!(cause, Cause::Cancelled | Cause::Skipped { .. });
        let stops_wave = of_itself
            && self.mode == Mode::Running
            && self.policy.on_failure == OnFailure::StopWave;
        let joins = if stops_wave {
            self.ledger.joins_of(id)
        } else {
            Vec::new()
        };
        let Some(task) = self.ledger.end(id, Ending::Failed) else {
            return;
        };
        match cause {
            Cause::Cancelled => self.summary.cancelled += 1,
            Cause::Skipped { .. } => self.summary.skipped += 1,
            _ => self.summary.failed += 1,
        }
        let (label, attempts) = (task.spec.label, task.attempts);
        self.emit(|| EventKind::TaskFailed {
            id,
            label: label.clone(),
            attempts,
            cause: cause.to_string(),
        });
        self.call(Call::Finished {
            id,
            outcome: Err(TaskFailure {
                label,
                work: task.spec.work,
                attempts,
                cpu: task.cpu,
                cause,
            }),
        });
        for join in joins {
            self.stop_wave(join);
        }
    }

    fn stop_wave(&mut self, join: NodeId) {
        let stopped = self.ledger.stop_wave(join);
        for id in stopped.started {
            if let Some(flight) = self.in_flight.get(&id) {
                flight.context.cancel();
            }
        }
        for id in stopped.idle {
            self.give_up(id, Cause::Cancelled);
        }
    }

    fn on_reply(&mut self, mut reply: Reply<W>) {
        if self.mode == Mode::DirectorFailed {
            return;
        }
        self.unanswered -= 1;
        let stop_waves = std::mem::take(&mut reply.growth.stop_waves);
        self.grow(reply.growth);
        if self.mode == Mode::Running {
            for join in stop_waves {
                self.stop_wave(join);
            }
        }
        if let Some((id, wall)) = reply.joined {
            self.summary.joins += 1;
            if let Some(label) = self.ledger.label(id).cloned() {
                self.emit(|| EventKind::JoinFinished { id, label, wall });
            }
            self.ledger.end(id, Ending::Succeeded);
        }
    }

    fn grow(&mut self, growth: Growth<W>) {
        let (first, count) = (growth.first, growth.nodes.len() as u64);
        self.ledger.grow(growth);
        if count > 0 {
            self.emit(|| EventKind::NodesAdded { first, count });
        }
    }

    /// Before anything is started, so that nothing starts once a cancel was asked for.
    fn notice_cancel(&mut self) {
        let level = *self.channels.cancel.borrow();
        if level <= self.cancel_level || self.mode == Mode::DirectorFailed {
            return;
        }
        self.cancel_level = level;
        self.emit(|| EventKind::Cancelled { level });
        if level == CancelLevel::Now {
            // What has finished is not to be reported as cancelled.
            self.take_messages();
            if self.mode == Mode::DirectorFailed {
                return;
            }
            self.mode = Mode::Halted;
            // Dropping them gives the attempts up.
            for id in std::mem::take(&mut self.in_flight).into_keys() {
                self.give_up(id, Cause::Cancelled);
            }
        } else {
            self.mode = Mode::Draining;
            for flight in self.in_flight.values() {
                flight.context.withdraw();
            }
        }
    }

    /// Before anything is started, so that nothing starts once a pause was asked for.
    fn notice_pause(&mut self) {
        let asked = self.channels.pause.is_asked();
        match (self.pause, asked) {
            (Pause::Off, true) => {
                self.pause = Pause::Asked;
                self.emit(|| EventKind::Pausing);
                for flight in self.in_flight.values() {
                    flight.context.withdraw();
                }
            }
            (Pause::Asked | Pause::Still, false) => {
                self.pause = Pause::Off;
                self.channels.pause.stands_still(false);
                self.emit(|| EventKind::Continued);
            }
            (Pause::Off | Pause::Still, _) | (Pause::Asked, true) => {}
        }
        if self.pause == Pause::Asked && self.stands_still() {
            self.pause = Pause::Still;
            self.channels.pause.stands_still(true);
            self.emit(|| EventKind::Paused);
        }
    }

    fn call(&mut self, call: Call<W>) {
        if self.channels.calls.send(call).is_ok() {
            self.unanswered += 1;
        }
    }

    fn emit(&mut self, kind: impl FnOnce() -> EventKind) {
        self.channels.events.emit(kind);
    }
}

/// Reports the end of an attempt when it is dropped, so that a panicking executor is heard of too.
struct Report<W: Work> {
    to_inbox: UnboundedSender<Message<W>>,
    id: NodeId,
    number: u32,
    attempt: Option<Attempt<W::Output, W::Error>>,
}

impl<W: Work> Report<W> {
    fn ended(&mut self, attempt: Attempt<W::Output, W::Error>) {
        self.attempt = Some(attempt);
    }
}

impl<W: Work> Drop for Report<W> {
    fn drop(&mut self) {
        let attempt = self.attempt.take().unwrap_or_else(|| {
            Attempt::failed(TaskError::Lost {
                message: "the executor panicked".to_string(),
            })
        });
        // Nobody listens any more if the run is over.
        let _ = self.to_inbox.send(Message::AttemptEnded {
            id: self.id,
            number: self.number,
            attempt,
        });
    }
}
