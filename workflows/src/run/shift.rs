//! A shift: the time that one process computes runs of a store, first what it was started for, then what is queued.

use std::{
    thread::sleep,
    time::{Duration, Instant, SystemTime},
};

use serde_json::{Value, json};
use store::{EntryState, Queue, RunName, RunRecord, RunState, Store};

use super::{
    Context,
    control::{Signals, Stop},
    ended,
    error::RunError,
    open::{self, Holder, explain},
    queue::{self, Worked},
    session::{self, Equipment, SessionEnd},
    view,
};
use crate::{
    failure::{Failure, FailureKind},
    input::Problem,
    report::Report,
};

/// How long a verb that holds the store for a moment, as `prune` does, is waited for.
const MOMENT: Duration = Duration::from_secs(5);

/// On what terms a process computes.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// When to stop in order, at the latest.
    pub deadline: Option<SystemTime>,
    /// How the store is shared with others who want to compute in it.
    pub sharing: Sharing,
    /// Names the work, so that a command that died and is given again makes no second run.
    pub ticket: Option<String>,
}

/// How a store is shared with others who want to compute in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sharing {
    /// Where it is in use the work is queued; what is queued is computed after one's own.
    #[default]
    Queue,
    /// Where it is in use the command is refused; what is queued is left alone.
    Alone,
    /// The work is queued, and nothing is computed.
    Later,
}

/// The time that a process computes.
pub struct Shift<'a> {
    /// Where and how.
    pub context: &'a Context<'a>,
    /// On what terms.
    pub terms: &'a Terms,
    signals: Signals,
}

/// Whether the store is there to be worked in.
pub enum Claim {
    /// It is.
    Ours(Place),
    /// Another process holds it.
    Held(Holder),
}

/// A store to work in.
pub struct Place {
    // Dropped first: who reads the mark and finds the lock free would take it for a lie.
    _mark: Option<queue::Mark>,
    /// The store.
    pub store: Store,
}

/// What came of what a process was started for.
pub struct Own {
    /// For the user.
    pub result: Result<Report, Failure>,
    /// Whether the process is to end with it.
    pub ends: bool,
}

impl<'a> Shift<'a> {
    /// Begins: from here on signals stop what is computed, and nothing else.
    pub fn begin(context: &'a Context<'a>, terms: &'a Terms) -> Result<Self, Failure> {
        let signals = Signals::listen().map_err(|error| {
            let why = RunError::Engine(format!("listen to signals: {error}"));
            explain("begin", why)
        })?;
        Ok(Self {
            context,
            terms,
            signals,
        })
    }

    /// What sessions on `store` work with.
    pub fn equipment(&'a self, store: &'a Store) -> Equipment<'a> {
        Equipment {
            store,
            threads: self.context.threads(),
            progress: self.context.progress,
            signals: &self.signals,
            deadline: self.terms.deadline,
        }
    }

    /// Why the process is to compute nothing more, if it is.
    pub fn stopped(&self) -> Option<Stop> {
        let passed = |deadline: &SystemTime| SystemTime::now() >= *deadline;
        match self.signals.stop() {
            Some(signal) => Some(Stop::Signal(signal)),
            None => self.terms.deadline.filter(passed).map(|_| Stop::Deadline),
        }
    }

    /// Opens the store, and waits a moment for those who hold it only for one.
    ///
    /// # Errors
    /// It cannot be opened; or it is held by another process and the terms are to be alone.
    pub fn claim(&self) -> Result<Claim, Failure> {
        let begun = Instant::now();
        loop {
            let held = match open::try_open(self.context)? {
                Ok(store) => return Ok(Claim::Ours(self.place(store))),
                Err(held) => held,
            };
            let holder = Holder::of(&held);
            if self.terms.sharing == Sharing::Alone {
                return Err(open::refused(self.context, held));
            }
            let queue = Queue::of(&self.context.store);
            let taken = queue::worker(&queue, holder.pid, holder.host.as_deref()).is_some();
            if taken || begun.elapsed() >= MOMENT {
                return Ok(Claim::Held(holder));
            }
            sleep(Duration::from_millis(50));
        }
    }

    /// The store, if nobody holds it.
    pub fn free(&self) -> Result<Option<Place>, Failure> {
        let opened = open::try_open(self.context)?;
        Ok(opened.ok().map(|store| self.place(store)))
    }

    fn place(&self, store: Store) -> Place {
        let mark = match self.terms.sharing {
            Sharing::Alone => None,
            Sharing::Queue | Sharing::Later => {
                Some(queue::Mark::set(&Queue::of(&self.context.store)))
            }
        };
        Place { _mark: mark, store }
    }

    /// Computes one run, or tells how it ended before, in an earlier life of this command.
    ///
    /// # Errors
    /// Something other than the physics went wrong.
    pub fn compute(
        &self,
        place: &Place,
        run: &RunName,
        problem: &Problem,
    ) -> Result<SessionEnd, Failure> {
        let store = &place.store;
        let explained = |error| {
            let called = super::called(store, run);
            explain(&format!("compute run `{called}`"), error)
        };
        let record = store.run(run).map_err(|error| explained(error.into()))?;
        refuse_lost(store, &record)?;
        match record.state {
            RunState::Completed => Ok(SessionEnd::Completed),
            RunState::Failed if self.terms.ticket.is_some() => Ok(SessionEnd::Failed(record.note)),
            _ => session::advance(&self.equipment(store), run, problem).map_err(explained),
        }
    }

    /// Computes the one run that the process was started for.
    pub fn own(&self, place: &Place, run: &RunName, problem: &Problem) -> Own {
        let ended = self.compute(place, run, problem).map(|end| {
            let ends = matches!(&end, SessionEnd::Interrupted(stop) if stop.ends_the_process());
            (ended::ended(self.context, &place.store, run, &end), ends)
        });
        match ended {
            Ok((result, ends)) => Own { result, ends },
            Err(failure) => Own {
                // Whatever is wrong with the store is wrong with the next run too.
                ends: failure.kind() == FailureKind::Store,
                result: Err(failure),
            },
        }
    }

    /// Ends the shift: computes what is queued, unless the process is to end with its own work.
    pub fn end(&self, place: Place, own: Own) -> Result<Report, Failure> {
        if own.ends || self.terms.sharing != Sharing::Queue {
            return own.result;
        }
        if let Ok(report) = &own.result
            && waits(&self.context.store)
        {
            // It may be hours until the command ends and says so.
            let first = report.text.lines().next().unwrap_or_default();
            self.context.progress.note(first);
        }
        match self.work(place) {
            Ok(worked) => together(own.result, &worked),
            Err(failure) => Err(match own.result {
                Ok(report) => failure.with(report),
                Err(own) => own,
            }),
        }
    }

    /// Computes what is queued, and nothing else.
    pub fn work_alone(&self, place: Place) -> Result<Report, Failure> {
        let worked = self.work(place)?;
        let nothing = match worked.data.is_empty() && worked.stop.is_none() {
            true => "Nothing is queued.",
            false => "",
        };
        let report = together(Ok(Report::new(nothing, &json!({ "queue": [] }))), &worked)?;
        match worked.failed {
            0 => Ok(report),
            failed => {
                let what = format!("{failed} of {} queued runs failed", worked.data.len());
                Err(Failure::new(FailureKind::Run, what)
                    .hint("`femdem-flow queue` and `femdem-flow runs` say why")
                    .with(report))
            }
        }
    }

    fn work(&self, place: Place) -> Result<Worked, Failure> {
        let mut worked = Worked::default();
        let mut next = Some(place);
        while let Some(place) = next.take() {
            queue::work(self, &place.store, &mut worked)?;
            if worked.stop.is_some() {
                break;
            }
            drop(place);
            // Somebody may have queued something between the last look and the end of the lock, relying on it.
            if waits(&self.context.store) {
                next = self.free()?;
            }
        }
        Ok(worked)
    }
}

/// A run whose last step is lost cannot be gone on with; the hint says what can be done.
fn refuse_lost(store: &Store, record: &RunRecord) -> Result<(), Failure> {
    let steps = store
        .steps(&record.name)
        .map_err(|error| explain("read the run", error.into()))?;
    let Some(last) = steps.last().filter(|last| last.is_lost()) else {
        return Ok(());
    };
    let called = record.shown();
    let hint = view::way_out(called, steps.iter());
    let what = format!("failed to resume `{called}` from load step {}", last.index);
    let failure = Failure::new(FailureKind::Store, what).hint(hint);
    Err(match store.step(&record.name, last.index) {
        Err(error) => failure.because(error),
        Ok(_) => failure,
    })
}

/// Whether something is queued that can be done.
fn waits(store: &std::path::Path) -> bool {
    let entries = Queue::of(store).entries().unwrap_or_default();
    let open = |entry: &store::QueueEntry| !matches!(entry.state, EntryState::Failed(_));
    entries.iter().any(open)
}

/// The report on one's own work with that on the queue behind it. How one's own ended decides how the command does, unless
/// that went well and the process was stopped later.
fn together(own: Result<Report, Failure>, worked: &Worked) -> Result<Report, Failure> {
    if worked.data.is_empty() && worked.stop.is_none() {
        return own;
    }
    let with = |report: &Report| {
        let mut json = report.json.clone();
        if let Value::Object(fields) = &mut json {
            fields.insert("queue".to_owned(), Value::Array(worked.data.clone()));
        }
        let text = match report.text.is_empty() {
            true => format!("Queue:\n{}", worked.text),
            false => format!("{}\nQueue:\n{}", report.text, worked.text),
        };
        Report { text, json }
    };
    match (own, &worked.stop) {
        (Err(failure), _) => {
            let report = failure.report().cloned();
            Err(match report {
                Some(report) => failure.with(with(&report)),
                None => failure,
            })
        }
        (Ok(report), None) => Ok(with(&report)),
        (Ok(report), Some(stop)) => Err(Failure::new(
            stop.kind(),
            format!("work on the queue was {}", stop.in_words()),
        )
        .hint("`femdem-flow queue run` goes on with it")
        .with(with(&report))),
    }
}
