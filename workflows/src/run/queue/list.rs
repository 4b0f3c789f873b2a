//! Looking at the queue and taking entries back.

use serde_json::json;
use store::{EntryId, EntryState, Queue, QueueEntry, RunName, StepIndex, Store};

use super::{Entry, Work, enqueue::unreadable, worker};
use crate::{
    failure::{Failure, FailureKind},
    report::Report,
    run::{
        Context,
        control::Asker,
        open::{Holder, refused},
        text::{self, Align, Table},
        view::owner,
    },
};

/// Lists what is queued.
pub fn list(context: &Context<'_>) -> Result<Report, Failure> {
    let queue = existing(context)?;
    let entries = queue.entries().map_err(unreadable)?;
    let store = Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    let names = store.names().unwrap_or_default();
    let holder = owner(&context.store);
    let works = working(&queue, holder.as_ref());
    if entries.is_empty() {
        return Ok(Report::new(
            "Nothing is queued.",
            &json!({ "queue": [], "worker": works }),
        ));
    }
    use Align::{Left, Right};
    let mut table = Table::new([
        ("number", Right),
        ("run", Left),
        ("from", Left),
        ("by", Left),
        ("queued (UTC)", Left),
        ("state", Left),
    ]);
    let mut data = Vec::new();
    for entry in &entries {
        let (word, why) = standing(entry, works.is_some());
        let says = said(entry).map(|says| says.shown(&names));
        let phrase = match why {
            "" => word.to_owned(),
            why => format!("{word}: {why}"),
        };
        let row = match &says {
            Ok(says) => [
                entry.id.to_string(),
                says.run.clone(),
                says.work.verb().to_owned(),
                says.by.to_string(),
                text::utc(says.queued),
                phrase,
            ],
            Err(damage) => [
                entry.id.to_string(),
                "?".to_owned(),
                String::new(),
                String::new(),
                String::new(),
                format!("{word}: failed to {damage}"),
            ],
        };
        table.row(row);
        let says = says.ok();
        data.push(json!({
            "id": entry.id.0,
            "name": says.as_ref().map(|says| &says.run),
            "verb": says.as_ref().map(|says| says.work.verb()),
            "by": says.as_ref().map(|says| &says.by),
            "queued": says.as_ref().map(|says| says.queued),
            "state": word,
            "why": why,
        }));
    }
    let mut text = table.render("");
    match (&works, &holder) {
        (Some(by), _) => text.push_str(&format!("{by} works on it.\n")),
        (None, Some(holder)) => text.push_str(&format!(
            "{holder} holds the store and takes nothing from the queue.\n"
        )),
        (None, None) => text.push_str(
            "Nobody works on it: `femdem-flow queue run` does, and so does the next `submit` or `resume`.\n",
        ),
    }
    Ok(Report::new(
        text,
        &json!({ "queue": data, "worker": works }),
    ))
}

/// Removes the entries with these numbers or run names; all of them or none.
pub fn remove(context: &Context<'_>, which: &[String]) -> Result<Report, Failure> {
    let queue = existing(context)?;
    let entries = queue.entries().map_err(unreadable)?;
    let works = working(&queue, owner(&context.store).as_ref()).is_some();
    let mut found: Vec<&QueueEntry> = Vec::new();
    for wanted in which {
        let named = |entry: &&QueueEntry| {
            entry.id.to_string() == *wanted || said(entry).is_ok_and(|says| says.run == *wanted)
        };
        let entry = entries.iter().find(named).ok_or_else(|| {
            Failure::new(
                FailureKind::Usage,
                format!("failed to find `{wanted}` in the queue"),
            )
            .hint("`femdem-flow queue` lists what is queued: its numbers and runs")
        })?;
        if entry.state == EntryState::Taken && works {
            let run = said(entry).map_or_else(|_| "RUN".to_owned(), |says| says.run);
            let what = format!("failed to remove `{wanted}`: it is being computed");
            return Err(Failure::new(FailureKind::Usage, what)
                .hint(format!("`femdem-flow cancel {run}` stops it")));
        }
        found.push(entry);
    }
    let mut text = String::new();
    let mut data = Vec::new();
    for entry in found {
        let run = said(entry).map_or_else(|_| "?".to_owned(), |says| says.run);
        let removed = queue.remove(entry.id, &entry.state).map_err(|error| {
            let what = format!("failed to remove number {}", entry.id);
            Failure::new(FailureKind::Store, what).because(error)
        })?;
        text.push_str(&match removed {
            true => format!("Number {}, run `{run}`, is no longer queued.\n", entry.id),
            false => format!(
                "Number {}, run `{run}`, was taken meanwhile: `femdem-flow cancel {run}` stops it.\n",
                entry.id
            ),
        });
        data.push(json!({ "id": entry.id.0, "name": run, "removed": removed }));
    }
    Ok(Report::new(text, &json!({ "queue": data })))
}

/// How many entries are to be done, and how many could not be.
pub fn counts(store: &std::path::Path) -> (usize, usize) {
    let entries = Queue::of(store).entries().unwrap_or_default();
    let failed = |entry: &&QueueEntry| matches!(entry.state, EntryState::Failed(_));
    let failed = entries.iter().filter(failed).count();
    (entries.len() - failed, failed)
}

/// Queued work that is about a run.
pub struct Needs {
    /// Its number.
    pub id: EntryId,
    /// The step that it takes up; `None` where it goes on with the run.
    pub step: Option<StepIndex>,
}

/// The queued work that is about the run that the store calls `run`.
pub fn needed(store: &std::path::Path, run: &RunName) -> impl Iterator<Item = Needs> {
    let entries = Queue::of(store).entries().unwrap_or_default();
    let needs = |entry: QueueEntry| {
        let id = entry.id;
        match said(&entry).ok()?.work {
            _ if matches!(entry.state, EntryState::Failed(_)) => None,
            Work::Create { parent, .. } => {
                let (of, step) = parent?;
                (of == run.as_str()).then_some(Needs {
                    id,
                    step: Some(StepIndex(step)),
                })
            }
            Work::Resume => {
                (said(&entry).ok()?.run == run.as_str()).then_some(Needs { id, step: None })
            }
        }
    };
    entries.into_iter().filter_map(needs)
}

/// Whether an entry about this run, named so or to be named so, is not begun yet.
pub fn is_waiting(store: &std::path::Path, run: &str) -> bool {
    waiting(store, run).is_some()
}

/// The number of the first entry about this run, named so or to be named so, that is not begun yet.
pub fn waiting(store: &std::path::Path, run: &str) -> Option<u64> {
    let entries = Queue::of(store).entries().unwrap_or_default();
    let waiting = |entry: &&QueueEntry| {
        entry.state == EntryState::Waiting && said(entry).is_ok_and(|says| says.run == run)
    };
    entries.iter().find(waiting).map(|entry| entry.id.0)
}

fn existing(context: &Context<'_>) -> Result<Queue, Failure> {
    Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    Ok(Queue::of(&context.store))
}

fn working(queue: &Queue, holder: Option<&Holder>) -> Option<Asker> {
    let holder = holder?;
    worker(queue, holder.pid, holder.host.as_deref())
}

/// What an entry says, or why it cannot be read.
fn said(entry: &QueueEntry) -> Result<Entry, String> {
    Entry::from_bytes(entry.payload.as_ref().map_err(String::clone)?)
}

/// State and reason.
fn standing(entry: &QueueEntry, works: bool) -> (&'static str, &str) {
    match &entry.state {
        EntryState::Waiting => ("waiting", ""),
        EntryState::Taken if works => ("running", ""),
        EntryState::Taken => ("interrupted", ""),
        EntryState::Failed(why) => ("failed", why),
    }
}
