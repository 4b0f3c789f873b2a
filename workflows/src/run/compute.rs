//! The verbs that compute: `submit`, `resume`, `queue run`.

use serde_json::json;
use store::{ReadOnlyStore, RunState, Store};

use super::{
    Context,
    branch::work_of,
    notes,
    open::{Holder, explain, find, refused, store_name},
    packings,
    queue::{self, Work},
    session,
    shift::{Claim, Own, Sharing, Shift, Terms},
    triggers::{in_lines, triggers},
    view::View,
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    input::Problem,
    report::Report,
};

/// Computes `problem` as a new run, named `name` or as the input wishes; queues it where the store is in use.
pub fn submit(
    context: &Context<'_>,
    problem: Problem,
    name: Option<RunName>,
    terms: &Terms,
) -> Result<Report, Failure> {
    let asked = name.is_some();
    let name = store_name(name.as_ref().unwrap_or(&problem.name))?;
    for note in notes::notes(&problem).map_err(|error| explain("set up the problem", error))? {
        context.progress.note(&note);
    }
    let triggers = triggers(&problem).map_err(|error| explain("set up the problem", error))?;
    for line in in_lines(triggers.as_deref()) {
        context
            .progress
            .note(&format!("trigger of localisation: {line}"));
    }
    // What a run begins with is tried before there is one: a run that cannot begin could never be resumed.
    packings::Plan::of_problem(&problem).map_err(|error| explain("set up the problem", error))?;
    let shift = Shift::begin(context, terms)?;
    let manifest = session::described(problem, context.threads(), terms.ticket.clone());
    if terms.sharing == Sharing::Later {
        queue::ready(context)?;
        let work = work_of("submit", None, &manifest);
        return queue::enqueue(context, None, vec![(name, work)]);
    }
    match shift.claim()? {
        Claim::Ours(place) => {
            let run = session::create(&place.store, name.clone(), None, &manifest)
                .map_err(|error| explain("create the run", error))?;
            if asked {
                note_other_name(context, &name, &run);
            }
            let own = shift.own(&place, &run, &manifest.problem);
            shift.end(place, own)
        }
        Claim::Held(holder) => {
            let work = work_of("submit", None, &manifest);
            queued(&shift, &holder, vec![(name, work)])
        }
    }
}

/// Says so where a run has not got the name that was asked for it.
pub fn note_other_name(context: &Context<'_>, asked: &store::RunName, given: &store::RunName) {
    if asked != given {
        let note = format!("the name `{asked}` is taken: this run is called `{given}`");
        context.progress.note(&note);
    }
}

/// Continues a run where it stopped. A run that is complete is left as it is; one that failed tries its step again.
pub fn resume(context: &Context<'_>, run: &RunName, terms: &Terms) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let id = find(&view.names()?, run)?;
    let shift = Shift::begin(context, terms)?;
    let queueing = |holder: Option<&Holder>| {
        let record = view
            .store
            .run(&id)
            .map_err(|error| explain("find the run", error.into()))?;
        if record.state == RunState::Completed {
            let data = json!({ "name": run.as_str(), "state": "completed" });
            return Ok(Report::new(format!("Run `{run}` is complete."), &data));
        }
        refuse_to_queue(&view, run, &id)?;
        let works = vec![(id.clone(), Work::Resume)];
        match holder {
            Some(holder) => queued(&shift, holder, works),
            None => queue::enqueue(context, None, works),
        }
    };
    if terms.sharing == Sharing::Later {
        return queueing(None);
    }
    let place = match shift.claim()? {
        Claim::Ours(place) => place,
        Claim::Held(holder) => return queueing(Some(&holder)),
    };
    let record = place
        .store
        .run(&id)
        .map_err(|error| explain("find the run", error.into()))?;
    let manifest =
        session::manifest(&record.manifest).map_err(|error| explain("resume the run", error))?;
    let own = shift.own(&place, &id, &manifest.problem);
    shift.end(place, own)
}

/// Computes what is queued.
pub fn queue_run(context: &Context<'_>, terms: &Terms) -> Result<Report, Failure> {
    Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    let shift = Shift::begin(context, terms)?;
    match shift.claim()? {
        Claim::Ours(place) => shift.work_alone(place),
        Claim::Held(holder) => {
            let store_queue = store::Queue::of(&context.store);
            let takes = queue::worker(&store_queue, holder.pid, holder.host.as_deref()).is_some();
            let hint = match takes {
                true => "it takes what is queued when its turn comes; `femdem-flow queue` lists it",
                false => "try again when it is done; `femdem-flow status` tells how far it is",
            };
            let what = format!("failed to work on the queue: {holder} has the store open");
            Err(Failure::new(FailureKind::Store, what).hint(hint))
        }
    }
}

/// What became of the work with the ticket of `terms`, which an earlier life of this command began: it is gone on with.
/// `None` where it has not begun.
pub fn again(context: &Context<'_>, terms: &Terms) -> Option<Result<Report, Failure>> {
    let ticket = terms.ticket.as_ref()?;
    let store = Store::open_read_only(&context.store).ok()?;
    let found = ticketed(&store, ticket)?;
    let go_on = || {
        let shift = Shift::begin(context, terms)?;
        let place = match shift.claim()? {
            Claim::Ours(place) => place,
            // Somebody was faster while this command was dead.
            Claim::Held(holder) => {
                let works = vec![(found.name.clone(), Work::Resume)];
                return queued(&shift, &holder, works);
            }
        };
        let problem = session::manifest(&found.manifest)
            .map_err(|error| explain("go on with the run", error))?
            .problem;
        let own = shift.own(&place, &found.name, &problem);
        shift.end(place, own)
    };
    Some(go_on())
}

fn ticketed(store: &ReadOnlyStore, ticket: &str) -> Option<store::RunRecord> {
    let names = store.run_names().ok()?;
    queue::find_ticket(names, store, ticket)
}

/// Queues work because `holder` holds the store; does it where the store has become free meanwhile, so that nothing is
/// queued that nobody takes.
pub fn queued(
    shift: &Shift<'_>,
    holder: &Holder,
    works: Vec<(store::RunName, Work)>,
) -> Result<Report, Failure> {
    let report = queue::enqueue(shift.context, Some(holder), works)?;
    if let Some(place) = shift.free()? {
        let own = Own {
            result: Ok(report),
            ends: false,
        };
        return shift.end(place, own);
    }
    Ok(report)
}

/// A resume that is being done, or that waits already.
fn refuse_to_queue(view: &View, run: &RunName, id: &store::RunName) -> Result<(), Failure> {
    let refuse = |kind, what: String, hint: String| Err(Failure::new(kind, what).hint(hint));
    let standing = view
        .standing_of(id)
        .map_err(|error| explain(&format!("read run `{run}`"), error))?;
    if standing.is_alive() {
        let by = view
            .holder()
            .map_or(String::new(), |by| format!(" by {by}"));
        return refuse(
            FailureKind::Store,
            format!("failed to resume `{run}`: it is being computed{by}"),
            format!("`femdem-flow watch {run}` follows it"),
        );
    }
    if queue::is_waiting(view.store.dir(), id.as_str()) {
        return refuse(
            FailureKind::Usage,
            format!("failed to queue `{run}`: it is queued already"),
            "`femdem-flow queue` lists what is queued".to_owned(),
        );
    }
    Ok(())
}
