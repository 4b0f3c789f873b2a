//! What a task costs beyond its work: `cargo bench -p engine`.
//!
//! Runs empty tasks, all in one wave and in a chain of waves, and prints microseconds per task.

use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::Arc;

use engine::{
    Director, EventSink, Graph, GraphHandle, LocalPool, NodeError, NodeId, RunOptions, RunSummary,
    TaskContext, TaskOutcome, TaskSpec, Work, run_blocking,
};
use serde::{Deserialize, Serialize};

#[derive(Clone, Serialize, Deserialize)]
struct Nothing;

#[derive(Debug, thiserror::Error, Serialize, Deserialize)]
#[error("never")]
struct Never;

impl Work for Nothing {
    type Output = ();
    type Error = Never;

    fn run(&self, _context: &TaskContext) -> Result<(), Never> {
        Ok(())
    }
}

/// Adds a wave at each join until none is left to add.
struct Waves {
    left: usize,
    width: usize,
}

impl Director<Nothing> for Waves {
    type Error = NodeError;

    fn task_finished(
        &mut self,
        _id: NodeId,
        _outcome: TaskOutcome<Nothing>,
        _graph: &mut GraphHandle<Nothing>,
    ) -> Result<(), NodeError> {
        Ok(())
    }

    fn join(&mut self, id: NodeId, graph: &mut GraphHandle<Nothing>) -> Result<(), NodeError> {
        if self.left == 0 {
            return Ok(());
        }
        self.left -= 1;
        graph.forget_before(id);
        let wave = (0..self.width)
            .map(|_| graph.add_task(TaskSpec::new("task", Nothing)))
            .collect::<Result<_, _>>()?;
        graph.add_join("join", wave)?;
        Ok(())
    }
}

fn measure(threads: usize, waves: usize, width: usize, events: EventSink) -> RunSummary {
    let threads = NonZeroUsize::new(threads).expect("not zero");
    let pool = Arc::new(LocalPool::new(threads).expect("threads start"));
    let mut graph = Graph::new();
    graph.add_join("start", Vec::new()).expect("waits for none");
    let mut director = Waves { left: waves, width };
    let options = RunOptions {
        events,
        ..RunOptions::default()
    };
    run_blocking(graph, &mut director, pool, options).expect("the director does not fail")
}

fn main() -> Result<(), Infallible> {
    println!("threads  waves   width  events  us/task  us/task of pool CPU");
    for threads in [1, 2, 4] {
        for (waves, width) in [(1, 100_000), (100, 1_000), (1_000, 100)] {
            for listened in [false, true] {
                let events = if listened {
                    EventSink::new(|event| {
                        std::hint::black_box(event);
                    })
                } else {
                    EventSink::none()
                };
                let summary = measure(threads, waves, width, events);
                let tasks = summary.succeeded as f64;
                println!(
                    "{threads:7}  {waves:5}  {width:6}  {:>6}  {:7.2}  {:7.2}",
                    if listened { "yes" } else { "no" },
                    summary.wall.as_secs_f64() * 1e6 / tasks,
                    summary.cpu.as_secs_f64() * 1e6 / tasks,
                );
            }
        }
    }
    Ok(())
}
