//! Opening the store, and its refusals in the user's words.

use std::fmt;

use store::{Names, OpenError, Store};

use super::{Context, error::RunError, list};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
};

/// The process that holds a store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Its number, where `LOCK` says it.
    pub pid: Option<u32>,
    /// Its host, where `LOCK` says it.
    pub host: Option<String>,
}

impl Holder {
    /// The one of a refusal; nobody in particular where that has another reason.
    pub fn of(error: &OpenError) -> Self {
        match error {
            OpenError::Held { pid, host, .. } => Self {
                pid: *pid,
                host: host.clone(),
            },
            _ => Self {
                pid: None,
                host: None,
            },
        }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.pid, &self.host) {
            (Some(pid), Some(host)) => write!(f, "process {pid} on {host}"),
            (Some(pid), None) => write!(f, "process {pid}"),
            (None, _) => f.write_str("another process"),
        }
    }
}

/// Opens the store for writing; makes it where there is none.
pub fn open(context: &Context<'_>) -> Result<Store, Failure> {
    try_open(context)?.map_err(|held| refused(context, held))
}

/// The same; the inner error is the refusal because another process holds the store.
pub fn try_open(context: &Context<'_>) -> Result<Result<Store, OpenError>, Failure> {
    let store = match Store::open(&context.store) {
        Ok(store) => store,
        Err(held @ OpenError::Held { .. }) => return Ok(Err(held)),
        Err(error) => return Err(refused(context, error)),
    };
    for finding in store.opening_report() {
        let remedy = match finding.remedy.as_str() {
            "" => String::new(),
            remedy => format!(" ({remedy})"),
        };
        context.progress.note(&format!(
            "store: {}: {}{remedy}",
            finding.path.display(),
            finding.what
        ));
    }
    Ok(Ok(store))
}

/// Opens the store for writing; a folder that is none yet is refused rather than made one.
pub fn open_existing(context: &Context<'_>) -> Result<Store, Failure> {
    Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    open(context)
}

/// The refusal of a store to open.
pub fn refused(context: &Context<'_>, error: OpenError) -> Failure {
    let hint = match &error {
        OpenError::Held { .. } => {
            "wait until it is done (`femdem-flow status` tells how far it is), or use another store with `--store DIR`"
        }
        _ => "check the path; `--store DIR` names the folder of the store",
    };
    Failure::new(
        FailureKind::Store,
        format!("failed to open the store {}", context.store.display()),
    )
    .because(error)
    .hint(hint)
}

/// The class that a failure of a run belongs to.
pub fn kind(error: &RunError) -> FailureKind {
    match error {
        // Nothing is wrong with the store: the user gave the step up.
        RunError::Model(_)
        | RunError::Body(_)
        | RunError::Packing { .. }
        | RunError::Read(store::ReadError::Pruned(_)) => FailureKind::Usage,
        RunError::Preparation { .. }
        | RunError::Task { .. }
        | RunError::Engine(_)
        | RunError::State(_) => FailureKind::Run,
        RunError::Manifest(_)
        | RunError::Decode(_)
        | RunError::Read(_)
        | RunError::Run(_)
        | RunError::Journal(_)
        | RunError::Commit(_)
        | RunError::Space(_)
        | RunError::File { .. } => FailureKind::Store,
    }
}

/// A failure of a run, with the exit code of its kind.
pub fn explain(what: &str, error: RunError) -> Failure {
    let kind = kind(&error);
    let hint = match &error {
        RunError::Space(_) | RunError::Commit(_) | RunError::Journal(_) => Some(
            "free space on the disk, then `femdem-flow resume RUN`: nothing that is committed is lost",
        ),
        RunError::Read(store::ReadError::NoSuchRun(_)) => Some("`femdem-flow runs` lists the runs"),
        RunError::Read(store::ReadError::Pruned(_)) => {
            Some("`femdem-flow show RUN` has its figures and tells which load steps are kept")
        }
        RunError::Read(_) | RunError::Decode(_) | RunError::Manifest(_) => {
            Some("`femdem-flow store check` says what is damaged and what to do")
        }
        RunError::Task { .. } => Some(
            "`femdem-flow resume RUN` tries it again: nothing is lost, and no result depends on the clock; `task_time_limit` under `solver` is the limit",
        ),
        RunError::Preparation { .. } => Some("see the material's `rev` section in the input"),
        _ => None,
    };
    let failure = Failure::new(kind, format!("failed to {what}")).because(error);
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}

/// The refusal of a run that is not there; the hint names those that are.
fn no_such_run(name: &str, existing: &[store::RunName]) -> Failure {
    let hint = match existing {
        [] => "the store has no runs; `femdem-flow submit FILE` computes one".to_owned(),
        runs => format!("the store has {}", list::names(runs)),
    };
    Failure::new(FailureKind::Usage, format!("failed to find run `{name}`")).hint(hint)
}

/// What the store calls the run that people call `name`.
pub fn find(names: &Names, name: &RunName) -> Result<store::RunName, Failure> {
    let called = store_name(name)?;
    names
        .resolve(&called)
        .ok_or_else(|| no_such_run(name.as_str(), &names.all_shown()))
}

/// The store's form of a run name.
pub fn store_name(name: &RunName) -> Result<store::RunName, Failure> {
    store::RunName::new(name.as_str()).map_err(|error| {
        Failure::new(
            FailureKind::Usage,
            format!("failed to use the run name `{name}`"),
        )
        .because(error)
    })
}
