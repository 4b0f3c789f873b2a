//! The same graph must one day run on other machines. This executor lets nothing through but bytes:
//! what cannot be serialised, or needs shared memory, fails here first.

mod common;

use std::sync::Arc;

use common::*;
use engine::{
    Attempt, BoxFuture, Cause, Event, Executor, Graph, NodeId, RunOptions, TaskContext, TaskError,
    perform, run_blocking,
};

/// Carries tasks out on a thread that receives bytes and returns bytes.
struct ByBytes;

impl Executor<Job> for ByBytes {
    fn execute(
        &self,
        _task: NodeId,
        work: Arc<Job>,
        context: TaskContext,
    ) -> BoxFuture<'static, Attempt<u64, JobError>> {
        let request = rmp_serde::to_vec(&(&*work, context.attempt(), context.time_limit()));
        Box::pin(async move {
            let answer = tokio::task::spawn_blocking(move || far_end(&request.unwrap())).await;
            rmp_serde::from_slice(&answer.unwrap()).unwrap()
        })
    }

    fn slots(&self) -> usize {
        3
    }
}

fn far_end(request: &[u8]) -> Vec<u8> {
    let (work, attempt, limit): (Job, _, _) = rmp_serde::from_slice(request).unwrap();
    let attempt = perform(&work, &TaskContext::new(attempt, limit));
    rmp_serde::to_vec(&attempt).unwrap()
}

#[test]
fn a_graph_runs_the_same_when_only_bytes_pass() {
    let mut graph = Graph::new();
    let mixed: Vec<_> = (0..50)
        .map(|i| graph.add_task(task(Job::Mix(i))).unwrap())
        .collect();
    let failed = graph.add_task(task(Job::Fail).retry(attempts(2))).unwrap();
    let panicked = graph.add_task(task(Job::Panic("far".into()))).unwrap();
    let late = graph
        .add_task(task(Job::Polite(AGES)).time_limit(5 * MS))
        .unwrap();
    let mut script = Script::passive();
    run_blocking(graph, &mut script, Arc::new(ByBytes), RunOptions::default()).unwrap();
    for (i, id) in mixed.into_iter().enumerate() {
        assert_eq!(*script.ended.of(id), Ok(mix(i as u64)));
    }
    let not_converged = Cause::Failed(JobError::NotConverged(2));
    assert_eq!(*script.ended.of(failed), Err(not_converged));
    let message = "far".to_string();
    assert_eq!(*script.ended.of(panicked), Err(Cause::Panicked { message }));
    assert_eq!(*script.ended.of(late), Err(Cause::TimeLimit));
}

/// Panics instead of carrying anything out, or loses it.
struct Broken;

impl Executor<Job> for Broken {
    fn execute(
        &self,
        task: NodeId,
        _work: Arc<Job>,
        _context: TaskContext,
    ) -> BoxFuture<'static, Attempt<u64, JobError>> {
        assert!(task.index() > 0, "no route to host");
        let message = "connection closed".to_string();
        Box::pin(async { Attempt::failed(TaskError::Lost { message }) })
    }

    fn slots(&self) -> usize {
        1
    }
}

#[test]
fn a_broken_executor_is_a_failure_of_its_tasks_and_not_a_hang() {
    let mut graph = Graph::new();
    let panicked = graph.add_task(task(Job::Echo(0))).unwrap();
    let lost = graph.add_task(task(Job::Echo(1))).unwrap();
    let mut script = Script::passive();
    let executor: Arc<dyn Executor<Job>> = Arc::new(Broken);
    run_blocking(graph, &mut script, executor, RunOptions::default()).unwrap();
    let because = |message: &str| {
        let message = message.to_string();
        Err(Cause::Lost { message })
    };
    assert_eq!(*script.ended.of(panicked), because("the executor panicked"));
    assert_eq!(*script.ended.of(lost), because("connection closed"));
}

#[test]
fn events_roundtrip() {
    let mut graph = Graph::new();
    let failed = graph.add_task(task(Job::Fail)).unwrap();
    graph.add_task(task(Job::Echo(1))).unwrap();
    graph.add_join("join", vec![failed]).unwrap();
    let (events, recorded) = recorder();
    let options = RunOptions {
        events,
        ..RunOptions::default()
    };
    run_blocking(graph, &mut Script::passive(), pool(1), options).unwrap();
    for event in recorded.lock().unwrap().iter() {
        let bytes = rmp_serde::to_vec(event).unwrap();
        let back: Event = rmp_serde::from_slice(&bytes).unwrap();
        assert_eq!(back, *event);
    }
}
