//! Runs that take up another one at one of its load steps: branches and reruns. The steps before are shared, not
//! copied; nothing that is committed is changed.

use std::{num::NonZeroUsize, time::SystemTime};

use serde_json::json;
use store::{NewRun, RunName, StepAddress, Store};

use super::{
    Context, ended,
    error::RunError,
    manifest::{Descent, Kind, Manifest},
    open::{explain, open_existing, store_name},
    origin::{Origin, origin},
    session::{self, SessionEnd},
    shift::{Shift, Terms},
};
use crate::{
    address::RunAddress,
    failure::{Failure, FailureKind},
    input::{
        Problem,
        derive::{self, Junction, Request, Scope, Variant},
    },
    report::Report,
};

/// Whether the new runs are computed at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Computing {
    /// One after the other, as `submit` does.
    Now,
    /// By a later `resume` of each.
    Later,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Wish {
    /// The step that is taken up.
    pub at: RunAddress,
    /// The changes.
    pub request: Request,
    /// The name of the run, or what the names of several begin with.
    pub name: Option<crate::address::RunName>,
    /// Whether the new runs are computed at once.
    pub computing: Computing,
}

/// A run to come.
pub struct Planned {
    /// The name that is wanted for it.
    pub name: RunName,
    /// What it is.
    pub manifest: Manifest,
}

/// Makes the runs that are asked for, and computes them.
pub fn derive(
    context: &Context<'_>,
    wish: &Wish,
    scope: Scope,
    terms: &Terms,
) -> Result<Report, Failure> {
    let shift = Shift::begin(context, terms)?;
    let store = open_existing(context)?;
    let names = store
        .names()
        .map_err(|error| explain("list the runs", error.into()))?;
    let origin = origin(&store, &names, &wish.at)?;
    let planned = planned(&origin, wish, scope, context.threads())?;
    let mut created = Vec::new();
    for Planned { name, manifest } in planned {
        let run = create(&store, name, &origin.parent, &manifest)
            .map_err(|error| explain("create the run", error))?;
        context
            .progress
            .note(&announcement(&run, &origin.called, &manifest));
        created.push((run, manifest.problem));
    }
    match wish.computing {
        Computing::Later => Ok(prepared(&created, &origin.called)),
        Computing::Now => compute(&shift, &store, &created),
    }
}

/// The runs that are asked for, each with its name and its record.
pub fn planned(
    origin: &Origin,
    wish: &Wish,
    scope: Scope,
    threads: NonZeroUsize,
) -> Result<Vec<Planned>, Failure> {
    let problem = &origin.manifest.problem;
    let past = problem.programme.until(origin.place.begun());
    let address = origin.called.to_string();
    let junction = Junction {
        address: &address,
        problem,
        loads: &origin.loads,
        past: &past,
        earlier: &origin.earlier,
    };
    let variants = derive::variants(&junction, &wish.request, scope)?;
    variants
        .into_iter()
        .map(|variant| {
            refuse_without_future(origin, &variant.problem, scope)?;
            let name = name(&origin.called.run, wish, &variant)?;
            Ok(Planned {
                name: store_name(&name)?,
                manifest: manifest(origin, variant, &name, scope, threads),
            })
        })
        .collect()
}

fn refuse_without_future(origin: &Origin, problem: &Problem, scope: Scope) -> Result<(), Failure> {
    if origin.place.done() < problem.programme.len() {
        return Ok(());
    }
    let at = &origin.called;
    let what = format!("failed to go on from {at}: the programme ends there");
    let hint = match scope {
        Scope::Branch => format!(
            "say what follows, as in `femdem-flow branch {at} --ramp LOAD=VALUE --steps 10`"
        ),
        Scope::Rerun => format!(
            "a rerun begins before the end: `femdem-flow rerun {}@STEP`; `femdem-flow branch {at}` goes on beyond it",
            at.run
        ),
    };
    Err(Failure::new(FailureKind::Usage, what).hint(hint))
}

fn manifest(
    origin: &Origin,
    variant: Variant,
    name: &crate::address::RunName,
    scope: Scope,
    threads: NonZeroUsize,
) -> Manifest {
    let kind = match scope {
        Scope::Branch => Kind::Branch,
        Scope::Rerun if variant.relawed.is_empty() => Kind::Rerun,
        Scope::Rerun => Kind::Seeded,
    };
    let problem = Problem {
        name: name.clone(),
        ..variant.problem
    };
    let mut relawed = origin.manifest.relawed.clone();
    relawed.extend(variant.relawed);
    Manifest {
        descent: Some(Descent {
            kind,
            changes: variant.changes,
        }),
        relawed,
        ..Manifest::new(problem, threads.get())
    }
}

/// The name asked for, or else the parent's with what sets the run apart behind; where it is taken, the store counts.
fn name(
    parent: &RunName,
    wish: &Wish,
    variant: &Variant,
) -> Result<crate::address::RunName, Failure> {
    let wished = variant.name.as_ref().or(wish.name.as_ref());
    if let Some(name) = wished {
        return Ok(name.clone());
    }
    let label = match variant.label.as_str() {
        "" => String::new(),
        label => format!("-{label}"),
    };
    let room = crate::address::LONGEST_RUN_NAME.saturating_sub(label.len());
    let stem: String = parent.as_str().chars().take(room).collect();
    format!("{stem}{label}").parse().map_err(|error| {
        let what = format!("failed to name a run after `{parent}`");
        Failure::new(FailureKind::Usage, what)
            .because(error)
            .hint("give it a name with `--name`")
    })
}

/// Puts a run into the store that takes up `parent`.
fn create(
    store: &Store,
    name: RunName,
    parent: &StepAddress,
    manifest: &Manifest,
) -> Result<RunName, RunError> {
    let created = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0, |d| d.as_secs());
    let run = NewRun {
        name,
        created,
        parent: Some(parent.clone()),
        manifest: manifest.to_bytes(),
    };
    Ok(store.create_run(run)?.name)
}

fn announcement(run: &RunName, parent: &StepAddress, manifest: &Manifest) -> String {
    let changes = manifest.descent.iter().flat_map(|descent| &descent.changes);
    let changes: Vec<String> = changes
        .map(|change| format!("{} {} → {}", change.key, change.from, change.to))
        .collect();
    let what = match changes.is_empty() {
        true => "nothing changed".to_owned(),
        false => changes.join("; "),
    };
    let kind = manifest.descent.as_ref().map_or("run", |d| d.kind.word());
    format!("{kind} `{run}` from {parent}: {what}")
}

/// What there is when nothing is computed yet.
fn prepared(created: &[(RunName, Problem)], parent: &StepAddress) -> Report {
    let mut text = String::new();
    for (run, _) in created {
        text.push_str(&format!(
            "Run `{run}` takes up {parent}; nothing is computed yet.\n"
        ));
    }
    text.push_str("Next:");
    for (run, _) in created {
        text.push_str(&format!("  femdem-flow resume {run}\n     "));
    }
    let runs: Vec<_> = created
        .iter()
        .map(|(run, _)| {
            json!({ "name": run.as_str(), "parent": parent.to_string(), "state": "prepared", "steps": parent.step.0 })
        })
        .collect();
    Report::new(text.trim_end(), &json!({ "runs": runs }))
}

/// Computes the runs one after the other. One whose step cannot be solved does not keep the next from being computed; what
/// stops the process does.
fn compute(
    shift: &Shift<'_>,
    store: &Store,
    runs: &[(RunName, Problem)],
) -> Result<Report, Failure> {
    let mut text = String::new();
    let mut data = Vec::new();
    let mut failed: Option<Failure> = None;
    for (index, (run, problem)) in runs.iter().enumerate() {
        let end = session::advance(&shift.equipment(store), run, problem).map_err(|error| {
            let called = super::called(store, run);
            explain(&format!("compute run `{called}`"), error)
        })?;
        match ended::ended(shift.context, store, run, &end) {
            Ok(report) => {
                text.push_str(&report.text);
                text.push('\n');
                data.push(report.json);
            }
            Err(failure) => {
                data.extend(failure.report().map(|report| report.json.clone()));
                if let SessionEnd::Interrupted(stop) = &end
                    && stop.ends_the_process()
                {
                    // What stopped it says how the command ended, whatever failed before it.
                    failed = Some(naming_the_rest(failure, &runs[index + 1..]));
                    break;
                }
                failed = failed.or(Some(failure));
            }
        }
    }
    let report = Report::new(text, &json!({ "runs": data }));
    match failed {
        None => Ok(report),
        Some(failure) => Err(failure.with(report)),
    }
}

/// The stop of one run, its hint extended to those that were to come after it.
fn naming_the_rest(failure: Failure, rest: &[(RunName, Problem)]) -> Failure {
    if rest.is_empty() {
        return failure;
    }
    let left: Vec<RunName> = rest.iter().map(|(run, _)| run.clone()).collect();
    let hint = format!(
        "{}; likewise for {}, which are not begun yet",
        failure.advice().unwrap_or_default(),
        super::list::names(&left)
    );
    failure.hint(hint)
}
