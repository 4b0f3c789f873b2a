//! A task that starts before what it needs has ended computes from nothing. These tests hold the
//! order of starts, reports and joins, and that it is the same every time.

mod common;

use std::collections::BTreeMap;

use common::*;
use engine::{Graph, NodeError, RunEnd, RunOptions, run_blocking};

fn position(order: &[u64], id: engine::NodeId) -> usize {
    order.iter().position(|&other| other == id.index()).unwrap()
}

#[test]
fn a_diamond_runs_its_top_first_and_its_bottom_last() {
    for threads in [1, 2, 4] {
        let mut graph = Graph::new();
        let top = graph.add_task(task(Job::Echo(1))).unwrap();
        let left = graph.add_task(task(Job::Mix(1)).after([top])).unwrap();
        let right = graph.add_task(task(Job::Mix(2)).after([top, top])).unwrap();
        let bottom = graph
            .add_task(task(Job::Echo(2)).after([left, right]))
            .unwrap();
        let mut script = Script::passive();
        run_blocking(graph, &mut script, pool(threads), RunOptions::default()).unwrap();
        let order = script.ended.order();
        assert_eq!(order.len(), 4);
        assert_eq!(order[0], top.index());
        assert_eq!(order[3], bottom.index());
    }
}

#[test]
fn a_join_comes_after_the_reports_of_all_that_it_waits_for() {
    for threads in [1, 3] {
        let mut graph = Graph::new();
        let source = graph.add_task(task(Job::Echo(0))).unwrap();
        let wave: Vec<_> = (0..300)
            .map(|i| graph.add_task(task(Job::Mix(i)).after([source])).unwrap())
            .collect();
        let join = graph.add_join("fan in", wave.clone()).unwrap();
        let last = graph.add_task(task(Job::Echo(9)).after([join])).unwrap();
        let mut reported = 0;
        let mut script = Script::at_join(|_, ended, _| {
            reported = ended.tasks.len();
            Ok(())
        });
        run_blocking(graph, &mut script, pool(threads), RunOptions::default()).unwrap();
        let order = script.ended.order();
        drop(script);
        assert_eq!(reported, 301);
        assert_eq!(position(&order, source), 0);
        assert_eq!(position(&order, last), 301);
    }
}

#[test]
fn one_thread_starts_tasks_by_priority_then_age_and_emits_the_same_events_every_time() {
    let once = || {
        let mut graph = Graph::new();
        let low = graph.add_task(task(Job::Mix(1)).priority(-1)).unwrap();
        let a = graph.add_task(task(Job::Mix(2))).unwrap();
        let b = graph.add_task(task(Job::Mix(3)).priority(7)).unwrap();
        let retried = graph
            .add_task(task(Job::SucceedAt(2)).retry(attempts(2)))
            .unwrap();
        graph.add_join("join", vec![low, a, b, retried]).unwrap();
        let mut added = false;
        let mut script = Script::at_join(move |_, _, graph| {
            if !std::mem::replace(&mut added, true) {
                let next = graph.add_task(task(Job::Fail)).unwrap();
                graph.add_join("end", vec![next]).unwrap();
            }
            Ok(())
        });
        let (events, recorded) = recorder();
        let options = RunOptions {
            events,
            ..RunOptions::default()
        };
        run_blocking(graph, &mut script, pool(1), options).unwrap();
        lines(&recorded)
    };
    let expected = [
        "run started",
        "added 0 +5",
        "start 2 #1",
        "finish 2 #1",
        "start 1 #1",
        "finish 1 #1",
        "start 3 #1",
        "retry 3 #1",
        "start 3 #2",
        "finish 3 #2",
        "start 0 #1",
        "finish 0 #1",
        "join 4",
        "added 5 +2",
        "joined 4",
        "start 5 #1",
        "fail 5 Fail: did not converge in attempt 1",
        "join 6",
        "joined 6",
        "end Complete",
    ];
    for _ in 0..20 {
        assert_eq!(once(), expected);
    }
}

#[test]
fn events_are_numbered_without_gaps_on_many_threads() {
    let mut graph = Graph::new();
    for i in 0..500 {
        graph.add_task(task(Job::Mix(i))).unwrap();
    }
    let (events, recorded) = recorder();
    let options = RunOptions {
        events,
        ..RunOptions::default()
    };
    run_blocking(graph, &mut Script::passive(), pool(4), options).unwrap();
    let recorded = recorded.lock().unwrap();
    assert_eq!(recorded.len(), 2 + 1 + 2 * 500);
    assert!(recorded.iter().map(|e| e.seq).eq(0..recorded.len() as u64));
}

#[test]
fn outputs_do_not_depend_on_the_number_of_threads() {
    let outputs = |threads| {
        let mut graph = Graph::new();
        for i in 0..400 {
            graph.add_task(task(Job::Mix(i))).unwrap();
        }
        let mut script = Script::passive();
        let summary =
            run_blocking(graph, &mut script, pool(threads), RunOptions::default()).unwrap();
        assert_eq!((summary.succeeded, summary.not_run), (400, 0));
        let tasks = script.ended.tasks.into_iter();
        tasks.collect::<BTreeMap<_, _>>()
    };
    let one = outputs(1);
    assert_eq!(one, outputs(2));
    assert_eq!(one, outputs(4));
    let values = one.values().map(|value| *value.as_ref().unwrap());
    assert!(values.eq((0..400).map(mix)));
}

#[test]
fn a_hundred_thousand_tasks_all_come_back() {
    let mut graph = Graph::new();
    let wave: Vec<_> = (0..100_000)
        .map(|i| graph.add_task(task(Job::Echo(i))).unwrap())
        .collect();
    graph.add_join("join", wave).unwrap();
    let mut script = Script::passive();
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    assert_eq!(summary.succeeded, 100_000);
    assert_eq!(summary.end, RunEnd::Complete);
    let mut order = script.ended.order();
    order.sort_unstable();
    assert!(order.into_iter().eq(0..100_000));
    assert_eq!(script.ended.joins.len(), 1);
}

#[test]
fn a_dependency_on_nothing_is_an_error_and_adds_nothing() {
    let mut graph = Graph::new();
    let mut other = Graph::new();
    let foreign = other.add_task(task(Job::Fail)).unwrap();
    let error = graph
        .add_task(task(Job::Fail).after([foreign]))
        .unwrap_err();
    assert_eq!(
        error,
        NodeError::Unknown {
            node: foreign,
            len: 0
        }
    );
    assert!(graph.add_join("join", vec![foreign]).is_err());
    assert!(graph.is_empty());
}

#[test]
fn an_empty_graph_ends_at_once() {
    let summary = run_blocking(
        Graph::new(),
        &mut Script::passive(),
        pool(1),
        RunOptions::default(),
    )
    .unwrap();
    assert_eq!((summary.end, summary.not_run), (RunEnd::Complete, 0));
}
