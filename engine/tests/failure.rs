//! One REV that does not converge, panics or hangs must not take the run of a week with it, nor be
//! lost silently. These tests hold retry, limits, containment and what others notice of a failure.

mod common;

use std::sync::{Arc, Mutex};

use common::*;
use engine::{
    Attempt, BoxFuture, Cause, Director, Executor, Graph, GraphHandle, NodeId, OnFailure, RunEnd,
    RunOptions, TaskContext, TaskFailure, TaskOutcome, perform, run_blocking,
};

#[test]
fn a_task_is_tried_again_until_it_succeeds() {
    let mut graph = Graph::new();
    let id = graph
        .add_task(task(Job::SucceedAt(3)).retry(attempts(5).with_delay(2 * MS)))
        .unwrap();
    let mut script = Script::passive();
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    assert_eq!(*script.ended.of(id), Ok(3));
    assert_eq!((summary.retries, summary.failed), (2, 0));
}

#[test]
fn a_task_that_fails_every_time_is_reported_once_with_its_last_error() {
    let mut graph = Graph::new();
    let id = graph.add_task(task(Job::Fail).retry(attempts(3))).unwrap();
    let mut script = Script::passive();
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    let expected = Cause::Failed(JobError::NotConverged(3));
    assert_eq!(*script.ended.of(id), Err(expected));
    assert_eq!((summary.retries, summary.failed), (2, 1));
}

/// A REV without equilibrium has none at the second try either, and looking for it is the longest solve there is.
#[test]
fn what_would_only_fail_again_is_not_tried_again() {
    let mut graph = Graph::new();
    let spec = task(Job::NoSolution).retry(attempts(3));
    let id = graph.add_task(spec).unwrap();
    let mut script = Script::passive();
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    let expected = Cause::Failed(JobError::NoSolution);
    assert_eq!(*script.ended.of(id), Err(expected));
    assert_eq!((summary.retries, summary.failed), (0, 1));
}

/// Keeps the failures as they come.
#[derive(Default)]
struct Failures(Vec<TaskFailure<Job>>);

impl Director<Job> for Failures {
    type Error = DirectorError;

    fn task_finished(
        &mut self,
        _: NodeId,
        outcome: TaskOutcome<Job>,
        _: &mut GraphHandle<Job>,
    ) -> Result<(), DirectorError> {
        self.0.extend(outcome.err());
        Ok(())
    }

    fn join(&mut self, _: NodeId, _: &mut GraphHandle<Job>) -> Result<(), DirectorError> {
        Ok(())
    }
}

#[test]
fn a_panic_is_contained_and_reported_with_label_and_work() {
    let mut graph = Graph::new();
    let job = Job::Panic("overlap is NaN".to_string());
    let mut spec = task(job.clone()).retry(attempts(2));
    spec.label = "e46.2".into();
    graph.add_task(spec).unwrap();
    for i in 0..20 {
        graph.add_task(task(Job::Echo(i))).unwrap();
    }
    let mut failures = Failures::default();
    let summary = run_blocking(graph, &mut failures, pool(2), RunOptions::default()).unwrap();
    assert_eq!((summary.succeeded, summary.failed), (20, 1));
    let [failure] = &failures.0[..] else {
        panic!("one failure is reported");
    };
    assert_eq!(failure.to_string(), "e46.2: panicked: overlap is NaN");
    assert_eq!((failure.attempts, &*failure.work), (2, &job));
}

#[test]
fn what_depends_on_a_failure_is_skipped_but_a_join_is_called() {
    let mut graph = Graph::new();
    let bad = graph.add_task(task(Job::Fail)).unwrap();
    let good = graph.add_task(task(Job::Echo(5))).unwrap();
    let child = graph
        .add_task(task(Job::Echo(6)).after([bad, good]))
        .unwrap();
    let grandchild = graph.add_task(task(Job::Echo(7)).after([child])).unwrap();
    let join = graph.add_join("join", vec![grandchild, good]).unwrap();
    let after = graph.add_task(task(Job::Echo(8)).after([join])).unwrap();
    let mut script = Script::passive();
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    let ended = &script.ended;
    assert_eq!(*ended.of(child), Err(Cause::Skipped { after: bad }));
    assert_eq!(*ended.of(grandchild), Err(Cause::Skipped { after: child }));
    assert_eq!((ended.of(good), ended.of(after)), (&Ok(5), &Ok(8)));
    assert_eq!(ended.joins, [join]);
    assert_eq!((summary.failed, summary.skipped), (1, 2));
}

#[test]
fn a_polite_task_past_its_limit_stops_by_itself() {
    let mut graph = Graph::new();
    let id = graph
        .add_task(task(Job::Polite(AGES)).time_limit(10 * MS))
        .unwrap();
    let mut script = Script::passive();
    let options = RunOptions {
        grace: AGES,
        ..RunOptions::default()
    };
    run_blocking(graph, &mut script, pool(1), options).unwrap();
    assert_eq!(*script.ended.of(id), Err(Cause::TimeLimit));
}

#[test]
fn deaf_tasks_on_every_thread_do_not_hang_the_run() {
    for threads in [1, 2] {
        let mut graph = Graph::new();
        let deaf: Vec<_> = (0..3)
            .map(|_| {
                let spec = task(Job::Deaf(AGES)).time_limit(10 * MS).priority(1);
                graph.add_task(spec).unwrap()
            })
            .collect();
        for i in 0..50 {
            graph.add_task(task(Job::Echo(i))).unwrap();
        }
        let mut script = Script::passive();
        let options = RunOptions {
            grace: 10 * MS,
            ..RunOptions::default()
        };
        let summary = run_blocking(graph, &mut script, pool(threads), options).unwrap();
        assert_eq!((summary.succeeded, summary.failed), (50, 3));
        for id in deaf {
            assert_eq!(*script.ended.of(id), Err(Cause::TimeLimit));
        }
    }
}

/// Keeps each task waiting before it begins, as a busy pool does.
struct Queue;

impl Executor<Job> for Queue {
    fn execute(
        &self,
        _task: NodeId,
        work: Arc<Job>,
        context: TaskContext,
    ) -> BoxFuture<'static, Attempt<u64, JobError>> {
        Box::pin(async move {
            tokio::time::sleep(500 * MS).await;
            perform(work.as_ref(), &context)
        })
    }

    fn slots(&self) -> usize {
        2
    }
}

#[test]
fn the_limit_does_not_count_the_time_in_the_queue() {
    let mut graph = Graph::new();
    let id = graph
        .add_task(task(Job::Echo(1)).time_limit(100 * MS))
        .unwrap();
    let options = RunOptions {
        grace: 100 * MS,
        ..RunOptions::default()
    };
    let mut script = Script::passive();
    run_blocking(graph, &mut script, Arc::new(Queue), options).unwrap();
    assert_eq!(*script.ended.of(id), Ok(1));
}

#[test]
fn a_failure_stops_its_wave_and_no_other_where_the_policy_says_so() {
    for threads in [1, 2] {
        let mut graph = Graph::new();
        let bad = graph.add_task(task(Job::Fail).priority(1)).unwrap();
        let wave: Vec<_> = (0..50)
            .map(|_| graph.add_task(task(Job::Polite(AGES))).unwrap())
            .collect();
        let chained = graph.add_task(task(Job::Echo(0)).after([wave[3]])).unwrap();
        let join = graph
            .add_join("join", [&wave[..], &[bad, chained]].concat())
            .unwrap();
        let other = graph.add_task(task(Job::Echo(1))).unwrap();
        let (events, recorded) = recorder();
        let options = RunOptions {
            on_failure: OnFailure::StopWave,
            events,
            ..RunOptions::default()
        };
        let mut script = Script::passive();
        let summary = run_blocking(graph, &mut script, pool(threads), options).unwrap();
        assert_eq!(summary.end, RunEnd::Complete);
        assert_eq!((summary.failed, summary.cancelled), (1, 51));
        assert_eq!(script.ended.joins, [join]);
        assert_eq!(*script.ended.of(other), Ok(1));
        for id in wave.into_iter().chain([chained]) {
            assert_eq!(*script.ended.of(id), Err(Cause::Cancelled));
        }
        assert!(
            lines(&recorded)
                .iter()
                .any(|line| line.starts_with("start 53"))
        );
    }
}

#[test]
fn the_director_can_stop_a_wave() {
    let mut graph = Graph::new();
    let quick = graph.add_task(task(Job::Echo(0)).priority(1)).unwrap();
    let mut wave: Vec<_> = (0..10)
        .map(|_| graph.add_task(task(Job::Polite(AGES))).unwrap())
        .collect();
    wave.push(quick);
    let join = graph.add_join("join", wave).unwrap();
    let errors = Mutex::new(Vec::new());
    let mut script = Script::passive().at_task(|id, graph| {
        if id == quick {
            errors.lock().unwrap().extend(graph.stop_wave(join).err());
        }
        Ok(())
    });
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    assert_eq!((summary.succeeded, summary.cancelled), (1, 10));
    assert_eq!(script.ended.joins, [join]);
    assert!(errors.lock().unwrap().is_empty());
}
