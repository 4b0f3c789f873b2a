//! Deciding what comes next, and calling the one who decides.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use tokio::runtime::{Handle, RuntimeFlavor};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender};

use crate::executor::panic_message;
use crate::graph::Growth;
use crate::scheduler::Message;
use crate::{GraphHandle, NodeId, TaskOutcome, Work};

/// Decides what comes next. Called one call at a time, off the async threads: it may compute and
/// block. Tasks that are ready go on meanwhile.
pub trait Director<W: Work>: Send {
    /// Why the run cannot go on.
    type Error: std::error::Error + Send + 'static;

    /// A task ended, after all its attempts.
    ///
    /// Called in the order of completion, which depends on the machine: good for a journal and for
    /// progress, and to put the output in its place; not to accumulate numbers.
    ///
    /// # Errors
    /// Whatever makes going on pointless; it ends the run.
    fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<W>,
        graph: &mut GraphHandle<W>,
    ) -> Result<(), Self::Error>;

    /// All nodes that this join waits for have ended, and been reported. May add the next nodes.
    ///
    /// # Errors
    /// Whatever makes going on pointless; it ends the run.
    fn join(&mut self, id: NodeId, graph: &mut GraphHandle<W>) -> Result<(), Self::Error>;
}

/// What the director is to be told.
pub(crate) enum Call<W: Work> {
    Finished { id: NodeId, outcome: TaskOutcome<W> },
    Join { id: NodeId },
}

/// What came of a call.
pub(crate) struct Reply<W> {
    pub(crate) growth: Growth<W>,
    /// The join that this ends, and how long it took.
    pub(crate) joined: Option<(NodeId, Duration)>,
}

/// How the director failed.
pub(crate) enum DirectorFailure<E> {
    Error(E),
    Panicked { message: String },
}

/// Calls taken at once; enough to spread the cost of leaving the async threads.
const BATCH: usize = 64;

/// Makes the calls, in order, until the scheduler closes the channel or the director fails.
pub(crate) async fn serve<W: Work, D: Director<W>>(
    director: &mut D,
    mut graph: GraphHandle<W>,
    mut calls: UnboundedReceiver<Call<W>>,
    scheduler: UnboundedSender<Message<W>>,
) -> Result<(), DirectorFailure<D::Error>> {
    let mut batch = Vec::with_capacity(BATCH);
    while calls.recv_many(&mut batch, BATCH).await > 0 {
        let served = off_async_threads(|| {
            batch.drain(..).try_for_each(|call| {
                let reply = make(director, call, &mut graph)?;
                // If the scheduler is gone, so is the channel of calls, and the loop ends.
                let _ = scheduler.send(Message::Reply(reply));
                Ok(())
            })
        });
        if served.is_err() {
            let _ = scheduler.send(Message::DirectorFailed);
            return served;
        }
    }
    Ok(())
}

fn make<W: Work, D: Director<W>>(
    director: &mut D,
    call: Call<W>,
    graph: &mut GraphHandle<W>,
) -> Result<Reply<W>, DirectorFailure<D::Error>> {
    let begun = Instant::now();
    // Unwind safety: a director that panicked is not called again in this run.
    let (result, join) = match call {
        Call::Finished { id, outcome } => (
            catch_unwind(AssertUnwindSafe(|| {
                director.task_finished(id, outcome, graph)
            })),
            None,
        ),
        Call::Join { id } => (
            catch_unwind(AssertUnwindSafe(|| director.join(id, graph))),
            Some(id),
        ),
    };
    match result {
        Ok(Ok(())) => Ok(Reply {
            growth: graph.take(),
            joined: join.map(|id| (id, begun.elapsed())),
        }),
        Ok(Err(error)) => Err(DirectorFailure::Error(error)),
        Err(payload) => Err(DirectorFailure::Panicked {
            message: panic_message(payload.as_ref()),
        }),
    }
}

/// Runs `f` so that it may block. A runtime with one thread has no other to go on with, so there it
/// holds up the scheduler, which costs idle slots and nothing else.
fn off_async_threads<R>(f: impl FnOnce() -> R) -> R {
    match Handle::current().runtime_flavor() {
        RuntimeFlavor::CurrentThread => f(),
        _ => tokio::task::block_in_place(f),
    }
}
