//! Another name for a run. Its packs and its branches know it by the name it was born with; what people see is a label.

use serde_json::json;
use store::{RenameError, rename_run};

use super::{
    Context,
    event_log::EventLog,
    open::{explain, open_existing, store_name},
    queue,
    view::View,
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    report::Report,
};

/// Calls `run` by the name `to` from now on. Works while another process computes it.
///
/// # Errors
/// Another run answers to that name; there is no such run; the store refuses.
pub fn rename(context: &Context<'_>, run: &RunName, to: &RunName) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let found = view.run(run)?;
    let (id, was) = (found.id(), found.name());
    let label = store_name(to)?;
    match rename_run(&context.store, id, &label) {
        Ok(()) => {}
        Err(RenameError::EarlierFormat { .. }) => {
            // Opening it for writing takes the store along.
            drop(open_existing(context)?);
            rename_run(&context.store, id, &label).map_err(|error| refused(run, error))?;
        }
        Err(error) => return Err(refused(run, error)),
    }
    let path = view.store.events_path(id);
    let mut log = EventLog::open(&path).map_err(|error| {
        explain(
            "write the log of the run",
            super::error::RunError::File { path, error },
        )
    })?;
    log.append("renamed", &json!({ "from": was, "to": label }));
    let still = match *id == label {
        true => String::new(),
        false => format!("; `{id}`, the name it was born with, still finds it"),
    };
    let queued = match queue::waiting(view.store.dir(), id.as_str()) {
        Some(number) => format!("; it is queued as number {number}, and is computed all the same"),
        None => String::new(),
    };
    let text = format!("Run `{was}` is called `{label}` now{still}{queued}");
    let data = json!({ "name": label, "was": was, "born_as": id });
    Ok(Report::new(text, &data))
}

fn refused(run: &RunName, error: RenameError) -> Failure {
    let (kind, hint) = match &error {
        RenameError::Taken { by, .. } => (
            FailureKind::Usage,
            format!(
                "choose another name, or rename `{by}` first where the name is not the one it was born with"
            ),
        ),
        _ => (
            FailureKind::Store,
            "`femdem-flow store check` says what is wrong".to_owned(),
        ),
    };
    Failure::new(kind, format!("failed to rename `{run}`"))
        .because(error)
        .hint(hint)
}
