//! Committing a load step beside the beginning of the next one.

use engine::thread_cpu_time;
use solver_fem::newton::{MacroState, StepSettings, StepSolver};

use super::{body::cpu_since, error::RunError, model::Model, schedule::Interval};

/// A load step that is begun and has asked for nothing yet.
pub struct Ahead {
    /// Which one.
    pub interval: Interval,
    /// At its first request.
    pub solver: StepSolver<2>,
    /// CPU seconds it took.
    pub cpu_s: f64,
}

/// Begins the step over `interval` from the committed state: what of it needs neither the store nor a REV.
///
/// # Errors
/// The state does not fit the problem.
pub fn begin_step(
    model: &Model,
    settings: &StepSettings,
    state: &MacroState<2>,
    interval: Interval,
) -> Result<Ahead, RunError> {
    let begun = thread_cpu_time();
    let control = interval.control.as_ref();
    let loads = (&interval.from[..], &interval.to[..], control);
    let solver = StepSolver::begin_controlled(&model.problem, state, loads, settings)
        .map_err(|error| RunError::State(error.to_string()))?;
    Ok(Ahead {
        interval,
        solver,
        cpu_s: cpu_since(begun),
    })
}

/// Seals a step on a thread of its own while this one computes what comes next, and waits for both.
///
/// What comes next must not touch the store: the journal of the next step is opened when the step is committed, so that
/// nothing of it can come to disk before.
///
/// # Errors
/// The system gives no thread; the step is not committed then, and its journal is as it was.
pub fn beside<T: Send, N>(
    seal: impl FnOnce() -> T + Send,
    next: impl FnOnce() -> N,
) -> Result<(T, N), RunError> {
    std::thread::scope(|scope| {
        let sealing = std::thread::Builder::new()
            .name("seal".to_owned())
            .spawn_scoped(scope, seal)
            .map_err(|error| RunError::Engine(format!("no thread to commit on: {error}")))?;
        let next = next();
        match sealing.join() {
            Ok(sealed) => Ok((sealed, next)),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_commit_that_fails_is_told_after_what_was_computed_beside_it() {
        let (sealed, next) = beside(|| Err::<(), _>("the disk is full"), || 7).unwrap();
        assert_eq!((sealed, next), (Err("the disk is full"), 7));
    }
}
