//! Submitting and resuming: a session of a run from its first node to its last.

use std::{
    num::NonZeroUsize,
    sync::{
        Arc,
        atomic::{AtomicI32, Ordering},
    },
    time::{SystemTime, UNIX_EPOCH},
};

use engine::{CancelToken, Director, Graph, LocalPool, OnFailure, RunEnd, RunOptions};
use store::{NewRun, RunName, RunState, Store};

use super::{
    campaign::Campaign,
    core::{Core, Ending},
    error::RunError,
    manifest::Manifest,
    work::Job,
};
use crate::{input::Problem, machine::Machine, progress::Progress};

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SessionEnd {
    /// The programme is at its end.
    Completed,
    /// A step cannot be solved; in these words.
    Failed(String),
    /// A signal stopped it in order; its number.
    Interrupted(i32),
}

/// Creates the run of `problem`.
///
/// # Errors
/// The store refuses.
pub fn create(
    store: &Store,
    name: RunName,
    problem: Problem,
    threads: NonZeroUsize,
) -> Result<RunName, RunError> {
    let manifest = Manifest::new(problem, threads.get());
    let created = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_secs());
    let run = NewRun {
        name,
        created,
        parent: None,
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
    store: &Store,
    run: &RunName,
    problem: &Problem,
    threads: NonZeroUsize,
    progress: &dyn Progress,
) -> Result<SessionEnd, RunError> {
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
    store.set_run_state(run, RunState::Running, "")?;
    progress.run_started(record.shown().as_str(), done, total);
    core.log(
        "session",
        &serde_json::json!({
            "threads": threads,
            "machine": Machine::this(),
            "pid": std::process::id(),
            "from": record.last_step.map(|step| step.0),
            "done": done,
            "of": total,
        }),
    );
    let mut campaign = Campaign::new(core, problem);
    let result = drive(&mut campaign, threads);
    progress.finished();
    let (state, note, end) = match result {
        Ok(SessionEnd::Completed) => (
            RunState::Completed,
            "the programme is at its end".to_owned(),
            Ok(SessionEnd::Completed),
        ),
        Ok(SessionEnd::Failed(why)) => (RunState::Failed, why.clone(), Ok(SessionEnd::Failed(why))),
        Ok(SessionEnd::Interrupted(signal)) => (
            RunState::Interrupted,
            format!("stopped by signal {signal}"),
            Ok(SessionEnd::Interrupted(signal)),
        ),
        Err(error) => (RunState::Interrupted, error.to_string(), Err(error)),
    };
    campaign.core.log(
        "ended",
        &serde_json::json!({ "state": format!("{state:?}"), "note": note }),
    );
    let recorded = store.set_run_state(run, state, &note);
    // Why the session ended comes first: a full disk fails the record as well.
    let end = end?;
    recorded?;
    Ok(end)
}

/// Runs the graph of a session and says how that ended.
fn drive(campaign: &mut Campaign<'_>, threads: NonZeroUsize) -> Result<SessionEnd, RunError> {
    let progress = campaign.core.progress;
    match conduct(campaign, threads, progress)? {
        Conducted::Stopped(signal) => Ok(SessionEnd::Interrupted(signal)),
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conducted {
    /// Nothing was left to do.
    Whole,
    /// This signal stopped it in order.
    Stopped(i32),
}

/// Runs a graph from its first join on, listening to signals: the first stops it in order, the second at once.
///
/// # Errors
/// The director's, or the engine's.
pub fn conduct<D: Director<Job, Error = RunError>>(
    director: &mut D,
    threads: NonZeroUsize,
    progress: &dyn Progress,
) -> Result<Conducted, RunError> {
    let engine_failed = |error: &dyn std::fmt::Display| RunError::Engine(error.to_string());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| engine_failed(&error))?;
    let pool = Arc::new(LocalPool::new(threads).map_err(|error| engine_failed(&error))?);
    let cancel = CancelToken::new();
    let signal = AtomicI32::new(0);
    let mut graph = Graph::new();
    graph.add_join("start", Vec::new())?;
    let options = RunOptions {
        cancel: cancel.clone(),
        on_failure: OnFailure::StopWave,
        ..RunOptions::default()
    };
    let summary = runtime.block_on(async {
        let run = engine::run(graph, director, pool, options);
        tokio::pin!(run);
        tokio::select! {
            summary = &mut run => summary,
            () = listen(cancel, &signal, progress) => run.await,
        }
    });
    // A task that does not stop must not keep the process from ending.
    runtime.shutdown_background();
    match summary {
        Ok(summary) if summary.end == RunEnd::Cancelled => {
            Ok(Conducted::Stopped(signal.load(Ordering::SeqCst)))
        }
        Ok(_) => Ok(Conducted::Whole),
        Err(engine::RunError::Director(error)) => Err(error),
        Err(error) => Err(engine_failed(&error)),
    }
}

/// Waits for SIGINT and SIGTERM; ends only where they cannot be listened to.
async fn listen(cancel: CancelToken, received: &AtomicI32, progress: &dyn Progress) {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut interrupt), Ok(mut terminate)) = (
        signal(SignalKind::interrupt()),
        signal(SignalKind::terminate()),
    ) else {
        progress.note("signals cannot be listened to: Ctrl-C ends the process like a kill");
        return;
    };
    for level in 0.. {
        let number = tokio::select! {
            _ = interrupt.recv() => SignalKind::interrupt().as_raw_value(),
            _ = terminate.recv() => SignalKind::terminate().as_raw_value(),
        };
        received.store(number, Ordering::SeqCst);
        match level {
            0 => {
                progress
                    .note("stopping when the running tasks have ended; once more stops at once");
                cancel.cancel();
            }
            _ => cancel.cancel_now(),
        }
    }
}
