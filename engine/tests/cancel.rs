//! Ctrl-C must keep what has finished and start nothing more; a second one must not wait.

mod common;

use std::sync::atomic::Ordering;

use common::*;
use engine::{CancelToken, Cause, Graph, RunEnd, RunOptions, run_blocking};

#[test]
fn a_graceful_cancel_lets_running_tasks_finish_and_delivers_them() {
    let cancel = CancelToken::new();
    let mut graph = Graph::new();
    // The gate opens only with the report of the quick one, so that the slow one runs until then. It
    // hangs if the pool does not start tasks by priority.
    let slow = graph.add_task(task(Job::Gate).priority(3)).unwrap();
    let quick = graph.add_task(task(Job::Echo(1)).priority(2)).unwrap();
    for _ in 0..50 {
        graph.add_task(task(Job::Gate)).unwrap();
    }
    graph.add_join("join", vec![quick, slow]).unwrap();
    let asked = cancel.clone();
    let mut script = Script::passive().at_task(move |id, _| {
        if id == quick {
            asked.cancel();
            GATE.store(true, Ordering::Release);
        }
        Ok(())
    });
    let (events, recorded) = recorder();
    let options = RunOptions {
        cancel,
        events,
        ..RunOptions::default()
    };
    let summary = run_blocking(graph, &mut script, pool(2), options).unwrap();
    assert_eq!(summary.end, RunEnd::Cancelled);
    assert_eq!(*script.ended.of(slow), Ok(0), "what ran is delivered");
    assert!(script.ended.joins.is_empty(), "nothing new starts");
    let finished = script.ended.tasks.iter().filter(|(_, r)| r.is_ok()).count();
    // The quick one, and at most the four that two slots may have in hand.
    assert!(
        finished <= 5,
        "{finished} finished, as if nothing was asked"
    );
    let reported = script.ended.tasks.len() as u64;
    assert_eq!(summary.not_run, 53 - reported);
    let lines = lines(&recorded);
    assert_eq!(lines.last().unwrap(), "end Cancelled");
    let starts = lines.iter().filter(|l| l.starts_with("start")).count() as u64;
    assert_eq!(starts, reported, "each started task is reported");
}

#[test]
fn a_cancel_at_once_does_not_wait_for_deaf_tasks() {
    let cancel = CancelToken::new();
    let mut graph = Graph::new();
    for _ in 0..10 {
        graph.add_task(task(Job::Deaf(AGES))).unwrap();
    }
    graph.add_join("ask", vec![]).unwrap();
    let asked = cancel.clone();
    let mut script = Script::at_join(move |_, _, _| {
        asked.cancel();
        std::thread::sleep(20 * MS);
        asked.cancel_now();
        asked.cancel();
        Ok(())
    });
    let options = RunOptions {
        cancel: cancel.clone(),
        ..RunOptions::default()
    };
    let summary = run_blocking(graph, &mut script, pool(2), options).unwrap();
    assert_eq!(summary.end, RunEnd::Cancelled);
    assert_eq!(
        cancel.level(),
        engine::CancelLevel::Now,
        "never less urgent"
    );
    for (_, result) in &script.ended.tasks {
        assert_eq!(*result, Err(Cause::Cancelled));
    }
    assert_eq!(script.ended.tasks.len() as u64 + summary.not_run, 10);
}

#[test]
fn a_run_cancelled_before_it_begins_starts_nothing() {
    for now in [CancelToken::cancel, CancelToken::cancel_now] {
        let cancel = CancelToken::new();
        now(&cancel);
        let mut graph = Graph::new();
        graph.add_task(task(Job::Echo(1))).unwrap();
        let mut script = Script::passive();
        let options = RunOptions {
            cancel,
            ..RunOptions::default()
        };
        let summary = run_blocking(graph, &mut script, pool(2), options).unwrap();
        assert_eq!((summary.end, summary.not_run), (RunEnd::Cancelled, 1));
        assert!(script.ended.tasks.is_empty());
    }
}

#[test]
fn a_cancel_does_not_wait_for_the_next_attempt() {
    let cancel = CancelToken::new();
    let mut graph = Graph::new();
    let hopeless = task(Job::Fail).retry(attempts(9).with_delay(AGES));
    graph.add_task(hopeless).unwrap();
    graph.add_join("ask", vec![]).unwrap();
    let asked = cancel.clone();
    let mut script = Script::at_join(move |_, _, _| {
        std::thread::sleep(20 * MS);
        asked.cancel();
        Ok(())
    });
    let options = RunOptions {
        cancel,
        ..RunOptions::default()
    };
    let summary = run_blocking(graph, &mut script, pool(2), options).unwrap();
    assert_eq!(summary.end, RunEnd::Cancelled);
}
