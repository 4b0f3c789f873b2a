//! Runs that take up another one at one of its load steps: branches and reruns. The steps before are shared, not
//! copied; nothing that is committed is changed.

use std::num::NonZeroUsize;

use serde_json::json;
use store::{RunName, StepAddress, Store};

use super::{
    Context,
    compute::{note_other_name, queued},
    error::RunError,
    manifest::{Descent, Kind, Manifest},
    model,
    open::{Holder, explain, open, store_name},
    origin::{Origin, origin},
    queue::{self, Work},
    session,
    shift::{Claim, Own, Place, Sharing, Shift, Terms},
    view::View,
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
    let view = View::open(context)?;
    let shift = Shift::begin(context, terms)?;
    let queueing = |holder: Option<&Holder>| {
        let origin = origin(&view.store, &view.names()?, &wish.at)?;
        let planned = planned(&origin, wish, scope, context.threads())?;
        let made = |number: usize| {
            let ticket = format!("{}/{number}", terms.ticket.as_ref()?);
            queue::find_ticket(view.ids().ok()?, &view.store, &ticket)
        };
        let works = planned.into_iter().enumerate();
        let works = works.map(|(number, Planned { name, manifest })| {
            // An earlier life of this command has made it.
            if let Some(record) = made(number) {
                return (record.name, Work::Resume);
            }
            let descent = manifest.descent.as_ref();
            let kind = descent.map_or("branch", |descent| descent.kind.word());
            (name, work_of(kind, Some(&origin.parent), &manifest))
        });
        match holder {
            Some(holder) => queued(&shift, holder, works.collect()),
            None => queue::enqueue(context, None, works.collect()),
        }
    };
    if terms.sharing == Sharing::Later {
        return queueing(None);
    }
    let place = match (shift.claim()?, wish.computing) {
        (Claim::Ours(place), _) => place,
        (Claim::Held(holder), Computing::Now) => return queueing(Some(&holder)),
        // Nothing would be left to do for the queue.
        (Claim::Held(_), Computing::Later) => {
            return Err(match open(context) {
                Ok(_) => Failure::new(FailureKind::Store, "the store was in use; try again"),
                Err(refused) => refused,
            });
        }
    };
    let store = &place.store;
    let names = store
        .names()
        .map_err(|error| explain("list the runs", error.into()))?;
    let origin = origin(store, &names, &wish.at)?;
    let planned = planned(&origin, wish, scope, context.threads())?;
    let mut created = Vec::new();
    for (number, Planned { name, manifest }) in planned.into_iter().enumerate() {
        let asked = name.clone();
        let (run, manifest) = create(&shift, store, number, name, &origin.parent, manifest)
            .map_err(|error| explain("create the run", error))?;
        if wish.name.is_some() {
            note_other_name(context, &asked, &run);
        }
        context
            .progress
            .note(&announcement(&run, &origin.called, &manifest));
        created.push((run, manifest.problem));
    }
    match wish.computing {
        Computing::Later => Ok(prepared(&created, &origin.called)),
        Computing::Now => {
            let own = compute(&shift, &place, &created);
            shift.end(place, own)
        }
    }
}

/// The entry of the queue that makes a run and computes it.
pub fn work_of(verb: &str, parent: Option<&StepAddress>, manifest: &Manifest) -> Work {
    Work::Create {
        verb: verb.to_owned(),
        parent: parent.map(|parent| (parent.run.to_string(), parent.step.0)),
        manifest: manifest.to_bytes().into(),
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
            model::check(&variant.problem).map_err(|error| explain("set up the problem", error))?;
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

/// Puts the run with this number into the store, which takes up `parent`; the one that an earlier life of this command
/// made where there is one.
fn create(
    shift: &Shift<'_>,
    store: &Store,
    number: usize,
    name: RunName,
    parent: &StepAddress,
    manifest: Manifest,
) -> Result<(RunName, Manifest), RunError> {
    let Some(ticket) = &shift.terms.ticket else {
        let run = session::create(store, name, Some(parent.clone()), &manifest)?;
        return Ok((run, manifest));
    };
    let ticket = format!("{ticket}/{number}");
    if let Some(record) = queue::find_ticket(store.run_names()?, store, &ticket) {
        let manifest = session::manifest(&record.manifest)?;
        return Ok((record.name, manifest));
    }
    let manifest = Manifest { ticket, ..manifest };
    let run = session::create(store, name, Some(parent.clone()), &manifest)?;
    Ok((run, manifest))
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
fn compute(shift: &Shift<'_>, place: &Place, runs: &[(RunName, Problem)]) -> Own {
    let mut text = String::new();
    let mut data = Vec::new();
    let mut failed: Option<Failure> = None;
    let mut ends = false;
    for (index, (run, problem)) in runs.iter().enumerate() {
        let own = shift.own(place, run, problem);
        ends = own.ends;
        match own.result {
            Ok(report) => {
                text.push_str(&report.text);
                text.push('\n');
                data.push(report.json);
            }
            Err(failure) => {
                data.extend(failure.report().map(|report| report.json.clone()));
                if ends {
                    // What stopped it says how the command ended, whatever failed before it.
                    failed = Some(naming_the_rest(failure, &runs[index + 1..]));
                    break;
                }
                failed = failed.or(Some(failure));
            }
        }
    }
    let report = Report::new(text, &json!({ "runs": data }));
    let result = match failed {
        None => Ok(report),
        Some(failure) => Err(failure.with(report)),
    };
    Own { result, ends }
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
