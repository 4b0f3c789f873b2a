//! A workflow engine: a graph of tasks that grows while it runs.
//!
//! The engine knows no physics, no files and no terminal. It is given three things:
//!
//! - a [`Graph`] of **tasks** (values that implement [`Work`]) and **joins** (points where the next
//!   thing is decided once everything before has ended),
//! - an [`Executor`] that carries tasks out, such as the [`LocalPool`] of this machine's cores,
//! - a [`Director`] that is told what ended and adds the next nodes.
//!
//! [`run`] (async) and [`run_blocking`] drive them to the end, with retry, time limits, cancellation,
//! contained panics, pauses and an ordered stream of [`Event`]s.
//!
//! # What is guaranteed
//!
//! - Dependencies point only to nodes that exist already, so a graph has no cycles by construction.
//! - A task starts once everything it waits for has succeeded. Where something failed, the task is
//!   skipped; a join runs all the same, so that the director can see the failure and react.
//! - Every task handed to the executor is reported to the director exactly once, and so is every
//!   skipped one. A join is called after all the tasks it waits for have been reported.
//! - The director is never called concurrently with itself.
//! - Ready tasks start by priority, then by [`NodeId`]. With one slot the run is strictly
//!   sequential: start, end, director, next start; its events come in the same order every time.
//! - No output depends on the number of slots, as long as [`Work::run`] is pure and the director
//!   does not let arrival order into its numbers.
//! - A panicking task is a failed task. A hanging task with a time limit is a failed task, and the
//!   thread that it keeps is replaced.
//! - A paused run ([`PauseToken`]) starts nothing, loses nothing and gives the same outputs once it goes on.
//! - Ended nodes keep 16 bytes each, until [`GraphHandle::forget_before`] drops these too.
//!
//! # Example
//!
//! ```
//! use std::convert::Infallible;
//! use std::sync::Arc;
//! use engine::{
//!     Director, Graph, GraphHandle, LocalPool, NodeError, NodeId, RunOptions, TaskContext,
//!     TaskOutcome, TaskSpec, Work, run_blocking,
//! };
//! use serde::{Deserialize, Serialize};
//!
//! #[derive(Clone, Serialize, Deserialize)]
//! struct Square(u64);
//!
//! #[derive(Debug, Serialize, Deserialize)]
//! enum Never {}
//! impl std::fmt::Display for Never {
//!     fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { match *self {} }
//! }
//! impl std::error::Error for Never {}
//!
//! impl Work for Square {
//!     type Output = u64;
//!     type Error = Never;
//!     fn run(&self, _context: &TaskContext) -> Result<u64, Never> { Ok(self.0 * self.0) }
//! }
//!
//! /// Squares 1, 2, 3; then, in a second wave, the sum of the squares.
//! #[derive(Default)]
//! struct SumThenSquare { sum: u64, waves: u32 }
//!
//! impl Director<Square> for SumThenSquare {
//!     type Error = NodeError;
//!     fn task_finished(&mut self, _: NodeId, outcome: TaskOutcome<Square>,
//!                      _: &mut GraphHandle<Square>) -> Result<(), NodeError> {
//!         self.sum += outcome.map_or(0, |finished| finished.output);
//!         Ok(())
//!     }
//!     fn join(&mut self, _: NodeId, graph: &mut GraphHandle<Square>) -> Result<(), NodeError> {
//!         self.waves += 1;
//!         if self.waves == 1 {
//!             let next = graph.add_task(TaskSpec::new("second wave", Square(self.sum)))?;
//!             self.sum = 0;
//!             graph.add_join("end", vec![next])?;
//!         }
//!         Ok(())
//!     }
//! }
//!
//! let mut graph = Graph::new();
//! let wave = (1..=3)
//!     .map(|i| graph.add_task(TaskSpec::new(format!("square {i}"), Square(i))))
//!     .collect::<Result<Vec<_>, _>>()?;
//! graph.add_join("sum", wave)?;
//!
//! let mut director = SumThenSquare::default();
//! let pool = Arc::new(LocalPool::new(2.try_into()?)?);
//! run_blocking(graph, &mut director, pool, RunOptions::default())?;
//! assert_eq!(director.sum, 14 * 14);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cancel;
mod context;
mod director;
mod event;
mod executor;
mod graph;
mod ledger;
mod limit;
mod local_pool;
mod outcome;
mod pause;
mod run;
mod scheduler;
mod task;
mod work;

pub use cancel::{CancelLevel, CancelToken};
pub use context::{Stop, TaskContext};
pub use director::Director;
pub use event::{Event, EventKind, EventSink};
pub use executor::{
    Attempt, BoxFuture, Executor, TaskError, perform, process_cpu_time, thread_cpu_time,
};
pub use graph::{Graph, GraphHandle, NodeError, NodeId};
pub use local_pool::{LocalPool, LocalPoolError};
pub use outcome::{Cause, Finished, TaskFailure, TaskOutcome};
pub use pause::{PauseState, PauseToken};
pub use run::{OnFailure, RunEnd, RunError, RunOptions, RunSummary, run, run_blocking};
pub use task::{RetryPolicy, TaskSpec};
pub use work::Work;
