//! What is kept of a run: notes and log, pruning, deleting.

use std::fmt::Write as _;

use serde_json::{Value, json};
use store::{DeleteError, InUse, StepIndex};

use super::{
    Context,
    event_log::EventLog,
    events::{self, Event},
    open::{explain, find, open_existing},
    queue, text,
    view::View,
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    report::Report,
};

/// Which steps of a run stay, beside those that are needed to go on from or by other runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Keep {
    /// Every step whose number is a multiple of this.
    pub every: Option<std::num::NonZeroU32>,
    /// This many at the end.
    pub last: Option<u32>,
}

/// Whether something is done, or only said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doing {
    /// It is done.
    Really,
    /// It is said what would be done.
    Dry,
}

/// Removes the packs of the steps of `run` that are not to be kept.
pub fn prune(
    context: &Context<'_>,
    run: &RunName,
    keep: Keep,
    doing: Doing,
) -> Result<Report, Failure> {
    let store = open_existing(context)?;
    let name = existing(&store, run)?;
    let failed =
        |error| Failure::new(FailureKind::Store, format!("failed to prune `{run}`")).because(error);
    let last = store
        .run(&name)
        .map_err(|error| explain("find the run", error.into()))?
        .last_step
        .map_or(0, |step| step.0);
    let first_kept = keep
        .last
        .map(|count| last.saturating_sub(count.saturating_sub(1)));
    let queued: Vec<StepIndex> = queue::needed(store.dir(), &name)
        .filter_map(|work| work.step)
        .collect();
    let is_kept = |step: StepIndex| {
        keep.every
            .is_some_and(|every| step.0.is_multiple_of(every.get()))
            || first_kept.is_some_and(|first| step.0 >= first)
            || queued.contains(&step)
    };
    let steps = match doing {
        Doing::Really => store.prune(&name, is_kept),
        Doing::Dry => store.prunable(&name, is_kept),
    }
    .map_err(failed)?;
    let bytes: u64 = steps.iter().map(|step| step.bytes).sum();
    let numbers: Vec<u32> = steps.iter().map(|step| step.index.0).collect();
    let verb = match doing {
        Doing::Really => "pruned",
        Doing::Dry => "would be pruned",
    };
    let text = match steps.is_empty() {
        true => format!("Run `{run}`: nothing to prune"),
        false => format!(
            "Run `{run}`: {} {verb}, {}: {}\nTheir figures stay in `femdem-flow show {run}`; what is kept can be gone on from.",
            text::count(steps.len(), "load step"),
            text::bytes(bytes),
            ranges(&numbers)
        ),
    };
    let data = json!({ "name": run.as_str(), "steps": numbers, "bytes": bytes, "done": doing == Doing::Really });
    Ok(Report::new(text, &data))
}

/// Deletes a run.
pub fn delete(context: &Context<'_>, run: &RunName) -> Result<Report, Failure> {
    let store = open_existing(context)?;
    let name = existing(&store, run)?;
    if let Some(work) = queue::needed(store.dir(), &name).next() {
        let what = format!(
            "failed to delete `{run}`: number {} of the queue takes it up",
            work.id
        );
        return Err(Failure::new(FailureKind::Usage, what).hint(format!(
            "`femdem-flow queue remove {}` takes that back first",
            work.id
        )));
    }
    let bytes = store.delete_run(&name).map_err(|error| {
        let hint = match &error {
            DeleteError::InUse(InUse::Branch { child, .. }) => {
                format!("delete `{child}` first, or `femdem-flow prune {run}` to keep only what it needs")
            }
            _ => "`femdem-flow store check` says what is wrong".to_owned(),
        };
        let kind = match &error {
            DeleteError::InUse(_) => FailureKind::Usage,
            _ => FailureKind::Store,
        };
        Failure::new(kind, format!("failed to delete `{run}`"))
            .because(error)
            .hint(hint)
    })?;
    let text = format!(
        "Run `{run}` is deleted, {} are free again",
        text::bytes(bytes)
    );
    Ok(Report::new(
        text,
        &json!({ "name": run.as_str(), "bytes": bytes }),
    ))
}

/// Writes a note into the log of a run.
pub fn note(context: &Context<'_>, run: &RunName, words: &str) -> Result<Report, Failure> {
    // Appending a line disturbs nobody, so that a run can be annotated while it is computed.
    let view = View::open(context)?;
    let name = view.run(run)?.record.name;
    let path = view.store.events_path(&name);
    let mut log = EventLog::open(&path).map_err(|error| {
        explain(
            "write the note",
            super::error::RunError::File { path, error },
        )
    })?;
    log.append("note", &json!({ "text": words }));
    let text = format!("Noted; `femdem-flow show {run}` and `femdem-flow log {run}` have it.");
    Ok(Report::new(
        text,
        &json!({ "name": run.as_str(), "note": words }),
    ))
}

/// What happened to a run, a line for each event.
pub fn log(context: &Context<'_>, run: &RunName) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let name = view.run(run)?.record.name;
    let path = view.store.events_path(&name);
    let events = events::list(&path).map_err(|error| {
        let what = format!("failed to read {}", path.display());
        Failure::new(FailureKind::Store, what).because(error)
    })?;
    let mut text = String::new();
    for Event { at, event, data } in &events {
        let _ = writeln!(text, "{}  {}", text::utc(*at as u64), in_words(event, data));
    }
    Ok(Report::new(
        text,
        &json!({ "name": run.as_str(), "events": events }),
    ))
}

/// An event as a line of the log says it.
pub fn in_words(event: &str, data: &Value) -> String {
    let number = |key: &str| data[key].as_u64().unwrap_or(0);
    let word = |key: &str| data[key].as_str().unwrap_or_default().to_owned();
    match event {
        "session" => format!(
            "session of process {} on {}: {} of {} done",
            number("pid"),
            text::count(number("threads") as usize, "thread"),
            number("done"),
            text::count(number("of") as usize, "increment")
        ),
        "preparing" => format!(
            "preparing {}, {} in the cache",
            text::count(number("packings") as usize, "packing"),
            number("cached")
        ),
        "packing_ready" => "a packing is ready".to_owned(),
        "wave_started" => format!(
            "step {}: iteration {}, {}, {} of them done before",
            number("step"),
            number("wave") + 1,
            text::count(number("tasks") as usize, "REV task"),
            number("done")
        ),
        "step_started" => format!("step {} begins, stage {}", number("step"), word("stage")),
        "iteration" => format!(
            "step {}: residual {:.1e}",
            number("step"),
            data["sweep"]["residual"].as_f64().unwrap_or(f64::NAN)
        ),
        "step_cut" => format!("step {} is cut: {}", number("step"), word("reason")),
        "step_committed" => format!(
            "step {} committed, {}, digest {:.12}",
            number("step"),
            text::bytes(number("bytes")),
            word("digest"),
        ),
        "stage_ended" => format!(
            "stage `{}` ends with step {}: {}",
            word("stage"),
            number("step"),
            word("ended")
        ),
        "task_failed" => format!(
            "a task of element {} failed: {}",
            number("element"),
            word("reason")
        ),
        "ended" => format!(
            "session ended: {}, {}",
            word("state").to_lowercase(),
            word("note")
        ),
        "asked" => format!(
            "process {} on {} asks: {}",
            data["by"]["pid"].as_u64().unwrap_or(0),
            data["by"]["host"].as_str().unwrap_or_default(),
            word("request")
        ),
        "paused" => "paused: nothing runs".to_owned(),
        "continued" => format!(
            "goes on after a pause of {}",
            text::duration(data["paused_s"].as_f64().unwrap_or(0.0))
        ),
        "checkpoint" => format!(
            "checkpoint: {} of the running step are on the disk",
            text::bytes(number("bytes"))
        ),
        "restart" => format!(
            "{}: restart {} of {} in {}",
            word("why"),
            number("number"),
            number("of"),
            text::duration(data["pause_s"].as_f64().unwrap_or(0.0))
        ),
        "note" => format!("note: {}", word("text")),
        "imported" => format!("imported from {}", word("from")),
        "renamed" => format!("renamed from `{}` to `{}`", word("from"), word("to")),
        other => format!("{other} {data}"),
    }
}

fn existing(store: &store::Store, run: &RunName) -> Result<store::RunName, Failure> {
    let names = store
        .names()
        .map_err(|error| explain("list the runs", error.into()))?;
    find(&names, run)
}

/// Ascending numbers in short: `1 to 4, 6`.
pub fn ranges(numbers: &[u32]) -> String {
    let mut parts: Vec<(u32, u32)> = Vec::new();
    for &number in numbers {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => parts.push((number, number)),
        }
    }
    let parts: Vec<String> = parts
        .into_iter()
        .map(|(first, last)| match first == last {
            true => first.to_string(),
            false => format!("{first} to {last}"),
        })
        .collect();
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_in_short() {
        assert_eq!(ranges(&[1, 2, 3, 5, 7, 8]), "1 to 3, 5, 7 to 8");
    }
}
