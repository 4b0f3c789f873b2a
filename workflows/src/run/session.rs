//! Submitting and resuming: a session of a run from its first node to its last.

use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use engine::{
    CancelToken, Director, Executor, Graph, LocalPool, OnFailure, PauseToken, RunEnd, RunOptions,
};
use store::{NewRun, RunName, RunState, StepAddress, Store};

use super::{
    campaign::Campaign,
    control::{Attendant, Desk, Signals, Stop},
    core::{Core, Ending},
    error::RunError,
    manifest::Manifest,
    work::Job,
};
use crate::{
    failure::FailureKind,
    input::Problem,
    machine::{self, Machine},
    progress::Progress,
};

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SessionEnd {
    /// The programme is at its end.
    Completed,
    /// A step cannot be solved; in these words.
    Failed(String),
    /// It was stopped in order.
    Interrupted(Stop),
}

/// What sessions work with.
#[derive(Clone, Copy)]
pub struct Equipment<'a> {
    /// Where runs are kept.
    pub store: &'a Store,
    /// Worker threads.
    pub threads: NonZeroUsize,
    /// Who is shown the progress.
    pub progress: &'a dyn Progress,
    /// The signals of the process.
    pub signals: &'a Signals,
    /// When to stop in order, at the latest.
    pub deadline: Option<SystemTime>,
}

/// The description of a run of `problem`.
pub fn described(problem: Problem, threads: NonZeroUsize, ticket: Option<String>) -> Manifest {
    Manifest {
        ticket: ticket.unwrap_or_default(),
        ..Manifest::new(problem, threads.get())
    }
}

/// Creates a run, which takes up a step of another one where `parent` says so.
///
/// # Errors
/// The store refuses.
pub fn create(
    store: &Store,
    name: RunName,
    parent: Option<StepAddress>,
    manifest: &Manifest,
) -> Result<RunName, RunError> {
    let run = NewRun {
        name,
        created: since_1970().as_secs(),
        parent,
        manifest: manifest.to_bytes(),
    };
    Ok(store.create_run(run)?.name)
}

/// The description of a run.
///
/// # Errors
/// There is no such run, or another version of the program wrote it.
pub fn manifest(bytes: &[u8]) -> Result<Manifest, RunError> {
    Manifest::from_bytes(bytes).map_err(|error| RunError::Manifest(error.to_string()))
}

/// Takes a run from where it is as far as it goes, and records how that ended.
///
/// # Errors
/// Something other than the physics went wrong; what is committed stays.
pub fn advance(
    equipment: &Equipment<'_>,
    run: &RunName,
    problem: &Problem,
) -> Result<SessionEnd, RunError> {
    let Equipment {
        store,
        threads,
        progress,
        ..
    } = *equipment;
    let record = store.run(run)?;
    let total = problem.programme.len();
    let done = match record.last_step {
        // Where a branch begins in the middle of an increment, that one is behind it.
        Some(step) => super::load::place(store, run, step)?
            .done()
            .max(problem.programme.offset()),
        None => 0,
    };
    let mut core = Core::new(store, run, progress)?;
    let session = name();
    let desk = Desk::open(store, run, &session).map_err(|error| RunError::File {
        path: store.events_path(run),
        error,
    })?;
    store.set_run_state(run, RunState::Running, "")?;
    progress.run_started(record.shown().as_str(), done, total);
    core.log(
        "session",
        &serde_json::json!({
            "session": session,
            "threads": threads,
            "machine": Machine::this(),
            "host": machine::host(),
            "pid": std::process::id(),
            "from": record.last_step.map(|step| step.0),
            "done": done,
            "of": total,
        }),
    );
    let mut campaign = Campaign::new(core, problem);
    let result = drive(&mut campaign, equipment, desk);
    progress.finished();
    let (state, note, end) = match result {
        Ok(SessionEnd::Completed) => (
            RunState::Completed,
            "the programme is at its end".to_owned(),
            Ok(SessionEnd::Completed),
        ),
        Ok(SessionEnd::Failed(why)) => (RunState::Failed, why.clone(), Ok(SessionEnd::Failed(why))),
        Ok(SessionEnd::Interrupted(stop)) => (
            RunState::Interrupted,
            stop.in_words(),
            Ok(SessionEnd::Interrupted(stop)),
        ),
        Err(error) => (RunState::Interrupted, error.to_string(), Err(error)),
    };
    // The record first: whoever reads of the end in the log finds it in the store as well.
    let recorded = store.set_run_state(run, state, &note);
    campaign.core.log(
        "ended",
        &serde_json::json!({ "state": format!("{state:?}"), "note": note, "code": exit_code(&end) }),
    );
    // Why the session ended comes first: a full disk fails the record as well.
    let end = end?;
    recorded?;
    Ok(end)
}

/// The exit code of a command that has computed this run alone.
fn exit_code(end: &Result<SessionEnd, RunError>) -> u8 {
    match end {
        Ok(SessionEnd::Completed) => 0,
        Ok(SessionEnd::Failed(_)) => FailureKind::Run.exit_code(),
        Ok(SessionEnd::Interrupted(stop)) => stop.kind().exit_code(),
        Err(error) => super::open::kind(error).exit_code(),
    }
}

/// A name for a session that no other one has, on whatever host.
fn name() -> String {
    let begun = since_1970().as_millis();
    format!("{}-{begun}@{}", std::process::id(), machine::host())
}

fn since_1970() -> Duration {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
}

/// Runs the graph of a session and says how that ended.
fn drive(
    campaign: &mut Campaign<'_>,
    equipment: &Equipment<'_>,
    desk: Desk,
) -> Result<SessionEnd, RunError> {
    let pause = campaign.core.pause.clone();
    match conduct(campaign, equipment, pause, Some(desk))? {
        Conducted::Stopped(stop) => Ok(SessionEnd::Interrupted(stop)),
        Conducted::Whole => match campaign.ending() {
            Some(Ending::Completed) => Ok(SessionEnd::Completed),
            Some(Ending::Failed(why)) => Ok(SessionEnd::Failed(why.clone())),
            None => Err(RunError::Engine(
                "the graph ended before the programme".into(),
            )),
        },
    }
}

/// How a graph ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Conducted {
    /// Nothing was left to do.
    Whole,
    /// It was stopped in order.
    Stopped(Stop),
}

/// Runs a graph from its first join on, listening to signals, to the deadline, and at the desk of a run where there is
/// one: the first stop is in order, the second at once. `pause` is the switch by which it is held up.
///
/// # Errors
/// The director's, or the engine's.
pub fn conduct<D: Director<Job, Error = RunError>>(
    director: &mut D,
    equipment: &Equipment<'_>,
    pause: PauseToken,
    desk: Option<Desk>,
) -> Result<Conducted, RunError> {
    let pool = LocalPool::new(equipment.threads);
    let pool = pool.map_err(|error| RunError::Engine(error.to_string()))?;
    conduct_on(Arc::new(pool), director, equipment, pause, desk)
}

/// The same on an executor of the caller's.
pub fn conduct_on<D: Director<Job, Error = RunError>>(
    executor: Arc<impl Executor<Job> + 'static>,
    director: &mut D,
    equipment: &Equipment<'_>,
    pause: PauseToken,
    desk: Option<Desk>,
) -> Result<Conducted, RunError> {
    let engine_failed = |error: &dyn std::fmt::Display| RunError::Engine(error.to_string());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| engine_failed(&error))?;
    let cancel = CancelToken::new();
    let mut graph = Graph::new();
    graph.add_join("start", Vec::new())?;
    let options = RunOptions {
        cancel: cancel.clone(),
        pause: pause.clone(),
        on_failure: OnFailure::StopWave,
        ..RunOptions::default()
    };
    let mut attendant = Attendant::new(
        equipment.progress,
        equipment.signals.received(),
        equipment.deadline,
        desk,
    );
    let summary = runtime.block_on(async {
        let run = engine::run(graph, director, executor, options);
        tokio::select! {
            summary = run => summary,
            never = attendant.attend(&cancel, &pause) => match never {},
        }
    });
    // A task that does not stop must not keep the process from ending.
    runtime.shutdown_background();
    match summary {
        Ok(summary) if summary.end == RunEnd::Cancelled => match attendant.stop() {
            Some(stop) => Ok(Conducted::Stopped(stop.clone())),
            None => Err(RunError::Engine("it was cancelled by nobody".into())),
        },
        Ok(_) => Ok(Conducted::Whole),
        Err(engine::RunError::Director(error)) => Err(error),
        Err(error) => Err(engine_failed(&error)),
    }
}
