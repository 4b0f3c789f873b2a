//! Queueing: without the lock, so that a process that computes is not disturbed.

use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::json;
use store::{EntryState, Names, Queue, RunName, Store};

use super::{Entry, Work, worker};
use crate::{
    failure::{Failure, FailureKind},
    report::Report,
    run::{
        Context,
        control::Asker,
        open::{Holder, explain, open, refused},
    },
};

/// Makes sure that there is a store to queue in.
pub fn ready(context: &Context<'_>) -> Result<(), Failure> {
    match Store::open_read_only(&context.store) {
        Ok(_) => Ok(()),
        Err(store::OpenError::Missing { .. }) => open(context).map(drop),
        Err(error) => Err(refused(context, error)),
    }
}

/// Queues runs: their wanted names and what is to be done for each. `holder` is the process that holds the store.
pub fn enqueue(
    context: &Context<'_>,
    holder: Option<&Holder>,
    works: Vec<(RunName, Work)>,
) -> Result<Report, Failure> {
    let queue = Queue::of(&context.store);
    let mut names = names(context, &queue)?;
    let mut queued = Vec::new();
    for (wanted, work) in works {
        let run = match work {
            Work::Resume => wanted.clone(),
            Work::Create { .. } => names.reserve(&wanted),
        };
        let entry = Entry {
            ticket: ticket(queued.len()),
            queued: since_1970().as_secs(),
            by: Asker::this(),
            run: run.to_string(),
            work,
        };
        let id = queue.put(entry.to_bytes()).map_err(|error| {
            Failure::new(FailureKind::Store, format!("failed to queue `{run}`")).because(error)
        })?;
        let taken = match run == wanted {
            true => String::new(),
            false => format!(" (`{wanted}` is taken)"),
        };
        queued.push((id, names.shown(&run), taken));
    }
    let entries = queue.entries().map_err(unreadable)?;
    let position = |id| {
        let before = |entry: &&store::QueueEntry| {
            entry.id <= id && !matches!(entry.state, EntryState::Failed(_))
        };
        entries.iter().filter(before).count()
    };
    let mut text = String::new();
    for (id, run, taken) in &queued {
        text.push_str(&format!(
            "Run `{run}` is queued as number {id}, at position {}{taken}.\n",
            position(*id)
        ));
    }
    let works = holder.and_then(|holder| worker(&queue, holder.pid, holder.host.as_deref()));
    text.push_str(&match (&works, holder) {
        (Some(by), _) => format!("{by} computes in this store and takes it when its turn comes."),
        (None, Some(holder)) => format!(
            "{holder} holds the store but takes nothing from the queue: `femdem-flow queue run` computes it once the store is free."
        ),
        (None, None) => "`femdem-flow queue run` computes what is queued.".to_owned(),
    });
    text.push_str("\nNext:  femdem-flow queue           what waits\n       femdem-flow queue remove N  take an entry back");
    let data: Vec<_> = queued
        .iter()
        .map(|(id, run, _)| json!({ "id": id.0, "name": run.as_str(), "position": position(*id) }))
        .collect();
    Ok(Report::new(
        text,
        &json!({ "queued": data, "worker": works }),
    ))
}

/// The names of the runs, those to come included.
fn names(context: &Context<'_>, queue: &Queue) -> Result<Names, Failure> {
    let store = Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    let mut names = store
        .names()
        .map_err(|error| explain("list the runs", error.into()))?;
    for entry in queue.entries().map_err(unreadable)? {
        let says = entry
            .payload
            .ok()
            .and_then(|bytes| Entry::from_bytes(&bytes).ok());
        let wanted = says.and_then(|says| RunName::new(says.run).ok());
        if let Some(name) = wanted {
            names.reserve(&name);
        }
    }
    Ok(names)
}

/// A name for the work of one entry that no other has, on whatever host.
fn ticket(number: usize) -> String {
    let this = Asker::this();
    let now = since_1970().as_nanos();
    format!("{}-{now}-{number}@{}", this.pid, this.host)
}

fn since_1970() -> std::time::Duration {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
}

/// The queue cannot be read.
pub fn unreadable(error: store::IoFailure) -> Failure {
    Failure::new(FailureKind::Store, "failed to read the queue").because(error)
}
