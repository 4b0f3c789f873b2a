//! Working on the queue: for the owner of the store, after what it was started for.

use serde_json::{Value, json};
use store::{
    EntryState, Queue, QueueEntry, RunName, RunRecord, RunState, StepAddress, StepIndex, Store,
};

use super::{Entry, Work, enqueue::unreadable};
use crate::{
    failure::{Failure, FailureKind},
    run::{
        called,
        control::Stop,
        ended::ended,
        error::RunError,
        load::Steps,
        manifest::Manifest,
        open::explain,
        session::{self, SessionEnd},
        shift::Shift,
    },
};

/// What came of working on the queue.
#[derive(Debug, Default)]
pub struct Worked {
    /// What there is to say, for people.
    pub text: String,
    /// An object for each entry.
    pub data: Vec<Value>,
    /// Entries that could not be done.
    pub failed: usize,
    /// Why the process stopped before the queue was at its end.
    pub stop: Option<Stop>,
}

/// What became of one entry.
enum Came {
    /// It is done; its entry goes.
    Done,
    /// It cannot be done; its entry stays and says why.
    Failed(String),
    /// The process was stopped; the entry stays for the next one.
    Stopped(Stop),
}

/// Works on the queue until it is at its end or the process is stopped. An entry that cannot be done does not keep the
/// next one from being done.
///
/// # Errors
/// Something is wrong with the store, which would fail the next entry as well; the queue stays.
pub fn work(shift: &Shift<'_>, store: &Store, worked: &mut Worked) -> Result<(), Failure> {
    let queue = Queue::of(store.dir());
    loop {
        let entries = queue.entries().map_err(unreadable)?;
        let mut open = entries
            .into_iter()
            .filter(|entry| !matches!(entry.state, EntryState::Failed(_)));
        let Some(entry) = open.next() else {
            return Ok(());
        };
        if let Some(stop) = shift.stopped() {
            worked.stop = Some(stop);
            return Ok(());
        }
        let failed = |error: store::IoFailure| {
            let what = format!("failed to take number {} from the queue", entry.id);
            Failure::new(FailureKind::Store, what).because(error)
        };
        if entry.state == EntryState::Waiting && !queue.take(entry.id).map_err(failed)? {
            // Its user was faster.
            continue;
        }
        match carry_out(shift, store, &entry, open.count(), worked)? {
            Came::Done => queue.finish(entry.id).map_err(failed)?,
            Came::Failed(why) => {
                worked.failed += 1;
                let note = format!("queue: number {} failed: {why}", entry.id);
                shift.context.progress.note(&note);
                worked.text.push_str(&format!("{note}\n"));
                worked
                    .data
                    .push(json!({ "id": entry.id.0, "state": "failed", "why": why }));
                queue.fail(entry.id, &why).map_err(failed)?;
            }
            Came::Stopped(stop) => {
                worked.stop = Some(stop);
                return Ok(());
            }
        }
    }
}

fn carry_out(
    shift: &Shift<'_>,
    store: &Store,
    entry: &QueueEntry,
    behind: usize,
    worked: &mut Worked,
) -> Result<Came, Failure> {
    let bytes = match &entry.payload {
        Ok(bytes) => bytes,
        Err(damage) => return Ok(Came::Failed(format!("failed to {damage}"))),
    };
    let says = match Entry::from_bytes(bytes) {
        Ok(says) => says,
        Err(why) => return Ok(Came::Failed(why)),
    };
    let record = match record(shift, store, &says) {
        Ok(record) => record,
        Err(error) if is_its_own_fault(&error) => {
            return Ok(Came::Failed(format!("failed to {error}")));
        }
        Err(error) => return Err(explain("take a run from the queue", error)),
    };
    let run = record.name;
    let called = called(store, &run);
    if is_over(&says.work, record.state) {
        // An owner was killed before it could remove the entry, or somebody resumed the run by hand.
        return Ok(Came::Done);
    }
    shift.context.progress.note(&format!(
        "queue: number {}, run `{called}`; {behind} more behind it",
        entry.id
    ));
    let problem = match session::manifest(&record.manifest) {
        Ok(manifest) => manifest.problem,
        Err(error) => return Ok(Came::Failed(format!("failed to {error}"))),
    };
    let end = match session::advance(&shift.equipment(store), &run, &problem) {
        Ok(end) => end,
        Err(error) if is_everyones(&error) => {
            return Err(explain(&format!("compute run `{called}`"), error));
        }
        Err(error) => {
            let why = format!(
                "failed to compute run `{called}`: failed to {error}; `femdem-flow resume {called}` tries again"
            );
            return Ok(Came::Failed(why));
        }
    };
    if let SessionEnd::Interrupted(stop) = &end
        && stop.ends_the_process()
    {
        return Ok(Came::Stopped(stop.clone()));
    }
    let (text, data) = match ended(shift.context, store, &run, &end) {
        Ok(report) => (report.text, report.json),
        Err(failure) => {
            if matches!(end, SessionEnd::Failed(_)) {
                worked.failed += 1;
            }
            let data = failure.report().map(|report| report.json.clone());
            (failure.causes().join(": "), data.unwrap_or_default())
        }
    };
    let first = text.lines().next().unwrap_or_default();
    shift.context.progress.note(first);
    worked.text.push_str(&format!("{first}\n"));
    worked.data.push(data);
    Ok(Came::Done)
}

/// Whether there is nothing left to do for a run.
fn is_over(work: &Work, state: RunState) -> bool {
    match (work, state) {
        (_, RunState::Completed) | (Work::Create { .. }, RunState::Failed) => true,
        // A step that could not be solved is what a `resume` is for.
        (Work::Resume, RunState::Failed)
        | (_, RunState::Prepared | RunState::Running | RunState::Interrupted) => false,
    }
}

/// The run of an entry; made where it is to be made and is not there yet.
fn record(shift: &Shift<'_>, store: &Store, says: &Entry) -> Result<RunRecord, RunError> {
    let name = RunName::new(&says.run).map_err(|error| RunError::Manifest(error.to_string()))?;
    let Work::Create {
        parent, manifest, ..
    } = &says.work
    else {
        return Ok(store.run(&name)?);
    };
    if let Some(record) = find_ticket(store.run_names()?, store, &says.ticket) {
        return Ok(record);
    }
    let parent = match parent {
        Some((run, step)) => Some(StepAddress {
            run: RunName::new(run).map_err(|error| RunError::Manifest(error.to_string()))?,
            step: StepIndex(*step),
        }),
        None => None,
    };
    let asked = session::manifest(manifest)?;
    // Machine and version are those that compute it.
    let ticket = Some(says.ticket.clone());
    let manifest = Manifest {
        descent: asked.descent,
        relawed: asked.relawed,
        ..session::described(asked.problem, shift.context.threads(), ticket)
    };
    let run = session::create(store, name, parent, &manifest)?;
    Ok(store.run(&run)?)
}

/// The run among `names` that was made for `ticket`, if there is one.
pub fn find_ticket(names: Vec<RunName>, store: &impl Steps, ticket: &str) -> Option<RunRecord> {
    let has_it = |record: &RunRecord| {
        session::manifest(&record.manifest).is_ok_and(|manifest| manifest.ticket == ticket)
    };
    // A run that cannot be read is none of ours: it would have been made a moment ago.
    let records = names.iter().filter_map(|name| store.run(name).ok());
    records.into_iter().find(has_it)
}

/// Whether the next entry would fail as well, as on a full disk. Damage is the run's own.
fn is_everyones(error: &RunError) -> bool {
    matches!(
        error,
        RunError::Run(_)
            | RunError::Journal(_)
            | RunError::Commit(_)
            | RunError::Space(_)
            | RunError::File { .. }
    )
}

/// Whether an entry is to blame, rather than the store.
fn is_its_own_fault(error: &RunError) -> bool {
    matches!(
        error,
        RunError::Manifest(_)
            | RunError::Read(store::ReadError::NoSuchRun(_))
            | RunError::Run(store::RunError::Parent { .. })
    )
}
