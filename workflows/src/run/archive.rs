//! Runs as one portable file, and back.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use store::{ArchiveError, Extent, ImportError, Imported, Naming, Taking};

use super::{
    Context,
    event_log::EventLog,
    list,
    open::{explain, open, store_name},
    text,
    view::View,
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    report::Report,
};

/// Writes `run` into the new file `to`. Works while another process computes it.
///
/// # Errors
/// There is no such run; one of its steps is damaged; the file exists or cannot be written.
pub fn export(
    context: &Context<'_>,
    run: &RunName,
    extent: Extent,
    to: &Path,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let found = view.run(run)?;
    let exported = view
        .store
        .export_archive(found.id(), extent, to)
        .map_err(|error| unwritten(run, error))?;
    let place = to.display();
    let with = match extent {
        Extent::Run => String::new(),
        Extent::Subtree => format!(" ({})", list::names(&exported.runs)),
    };
    let mut out = format!(
        "{place}: {}{with}, {}, {}\n",
        text::count(exported.runs.len(), "run"),
        text::count(exported.steps, "step"),
        text::bytes(exported.bytes)
    );
    for ancestor in &exported.ancestors {
        let _ = writeln!(
            out,
            "  with the load steps of `{}` up to {}",
            ancestor.run, ancestor.step
        );
    }
    let _ = writeln!(
        out,
        "`femdem-flow import {place}` takes it into another store"
    );
    let ancestors: Vec<String> = exported.ancestors.iter().map(ToString::to_string).collect();
    let data = json!({
        "name": found.name(),
        "file": place.to_string(),
        "runs": exported.runs,
        "ancestors": ancestors,
        "steps": exported.steps,
        "bytes": exported.bytes,
    });
    Ok(Report::new(out, &data))
}

fn unwritten(run: &RunName, error: ArchiveError) -> Failure {
    let (kind, hint) = match &error {
        ArchiveError::Exists { .. } => (
            FailureKind::Usage,
            "name another file: an archive may be all that is left of a run".to_owned(),
        ),
        ArchiveError::Io(_) => (
            FailureKind::Run,
            "name another file, or free some space".to_owned(),
        ),
        ArchiveError::Lost { .. } | ArchiveError::Read(_) => (
            FailureKind::Store,
            format!(
                "`femdem-flow store check` says what is damaged; `femdem-flow store set-back {run}@STEP` sets the run back to a sound step"
            ),
        ),
    };
    Failure::new(kind, format!("failed to write an archive of `{run}`"))
        .because(error)
        .hint(hint)
}

/// Takes the runs of the archive `from` into the store, its run under the name `name`.
///
/// # Errors
/// The file is no archive or damaged; a name is taken; the store refuses. The store is as it was then.
pub fn import(
    context: &Context<'_>,
    from: &Path,
    name: Option<&RunName>,
) -> Result<Report, Failure> {
    let naming = match name {
        Some(name) => Naming::Called(store_name(name)?),
        None => Naming::AsItIs,
    };
    if !context.store.exists() {
        // A store that is made for what turns out to be no archive would stay behind, empty.
        store::check_archive(from).map_err(|error| refused(from, error))?;
    }
    let store = open(context)?;
    let imported = store
        .import_archive(from, naming)
        .map_err(|error| refused(from, error))?;
    for run in imported
        .runs
        .iter()
        .filter(|run| run.taking != Taking::There)
    {
        let path = store.events_path(&run.name);
        let mut log = EventLog::open(&path).map_err(|error| {
            explain(
                "write the log of the run",
                super::error::RunError::File { path, error },
            )
        })?;
        let data = json!({ "from": from.display().to_string(), "called": run.called });
        log.append("imported", &data);
    }
    let names = store
        .names()
        .map_err(|error| explain("list the runs", error.into()))?;
    Ok(describe(from, &imported, &names))
}

fn describe(from: &Path, imported: &Imported, names: &store::Names) -> Report {
    let mut out = String::new();
    let mut data = Vec::new();
    for run in &imported.runs {
        let here = names.shown(&run.name);
        let renamed = match run.called == here {
            true => String::new(),
            false => format!(" as `{here}`"),
        };
        let (how, word) = match run.taking {
            Taking::Whole => ("", "whole"),
            Taking::Part => (" which are taken up", "part"),
            Taking::There => (" which are here already", "there"),
        };
        let _ = writeln!(
            out,
            "Run `{}`{renamed}: {}{how}",
            run.called,
            text::count(run.steps, "step")
        );
        data.push(json!({
            "called": run.called,
            "name": here,
            "taken": word,
            "steps": run.steps,
        }));
    }
    let root = names.shown(&imported.root);
    let _ = writeln!(
        out,
        "Next:  femdem-flow show {root}      what was computed, step by step\n       femdem-flow resume {root}    goes on, with the bits that it would have had"
    );
    let data = json!({ "name": root, "file": from.display().to_string(), "runs": data });
    Report::new(out, &data)
}

fn refused(from: &Path, error: ImportError) -> Failure {
    let place = from.display();
    let (kind, hint) = match &error {
        ImportError::Taken { .. } => (
            FailureKind::Usage,
            format!(
                "`femdem-flow import {place} --name NAME` gives it another name; what else is taken gets a number behind"
            ),
        ),
        ImportError::NotAnArchive { .. } => (
            FailureKind::Usage,
            "`femdem-flow export RUN --archive FILE` writes one".to_owned(),
        ),
        ImportError::LaterFormat { .. } => (
            FailureKind::Usage,
            "use the femdem-flow version that wrote it, or a later one".to_owned(),
        ),
        ImportError::Io(failure) if failure.path == from => {
            (FailureKind::Usage, "check the path".to_owned())
        }
        ImportError::Full { .. } | ImportError::Io(_) => (
            FailureKind::Store,
            "free some space on the disk of the store; nothing of the archive was taken in"
                .to_owned(),
        ),
        ImportError::Damaged(_) | ImportError::Read(_) | ImportError::Frame(_) => (
            FailureKind::Store,
            "nothing of it was taken in; what is damaged cannot be told from what is not"
                .to_owned(),
        ),
    };
    Failure::new(kind, format!("failed to import {place}"))
        .because(error)
        .hint(hint)
}
