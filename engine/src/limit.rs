//! Waiting for one attempt, but not for ever.

use std::time::{Duration, Instant};

use tokio::time::timeout;

use crate::{Attempt, BoxFuture, TaskContext, TaskError};

/// Waits for an attempt. Once it has run for its time limit plus `grace`, it is given up: the future
/// of the executor is dropped, and the result is [`TaskError::TimeLimit`].
///
/// The limit counts from the moment the work begins; an attempt in the executor's queue has not
/// begun, however long it waits.
pub(crate) async fn within_limit<O, E>(
    mut execution: BoxFuture<'static, Attempt<O, E>>,
    context: TaskContext,
    grace: Duration,
) -> Attempt<O, E> {
    let Some(limit) = context.time_limit() else {
        return execution.await;
    };
    let patience = limit.saturating_add(grace);
    let mut wait = patience;
    loop {
        if let Ok(attempt) = timeout(wait, &mut execution).await {
            return attempt;
        }
        if let Some(begun) = context.begun_at() {
            let run_for = Instant::now().saturating_duration_since(begun);
            if run_for >= patience {
                return Attempt {
                    wall: run_for,
                    ..Attempt::failed(TaskError::TimeLimit)
                };
            }
            wait = patience - run_for;
        }
    }
}
