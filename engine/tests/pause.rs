//! A run is paused to give a machine away for an hour. It must neither start anything meanwhile nor lose what ran, and
//! must come to the same outputs afterwards; and a pause must not make a run deaf to being stopped.

mod common;

use std::sync::atomic::Ordering;
use std::time::Instant;

use common::*;
use engine::{CancelToken, Graph, PauseState, PauseToken, RunEnd, RunOptions, run_blocking};

/// Waits until `condition` holds.
fn until(condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed().as_secs() < 60, "it never happens");
        std::thread::sleep(MS);
    }
}

#[test]
fn a_paused_run_starts_nothing_and_delivers_what_runs() {
    let pause = PauseToken::new();
    let mut graph = Graph::new();
    let slow = graph.add_task(task(Job::Gate).priority(3)).unwrap();
    let quick = graph.add_task(task(Job::Echo(1)).priority(2)).unwrap();
    let mut wave = vec![slow, quick];
    for seed in 0..50 {
        wave.push(graph.add_task(task(Job::Mix(seed))).unwrap());
    }
    let join = graph.add_join("join", wave.clone()).unwrap();
    let asked = pause.clone();
    let mut script = Script::passive().at_task(move |id, _| {
        if id == quick {
            asked.pause();
        }
        Ok(())
    });
    let (events, recorded) = recorder();
    let options = RunOptions {
        pause: pause.clone(),
        events,
        ..RunOptions::default()
    };
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| {
            until(|| pause.state() == PauseState::Pausing);
            // What runs keeps the run from standing still.
            std::thread::sleep(20 * MS);
            assert_eq!(pause.state(), PauseState::Pausing);
            GATE.store(true, Ordering::Release);
            until(|| pause.state() == PauseState::Paused);
            let seen = lines(&recorded).len();
            std::thread::sleep(50 * MS);
            assert_eq!(lines(&recorded).len(), seen, "nothing happens in a pause");
            pause.go_on();
        });
        run_blocking(graph, &mut script, pool(2), options).unwrap()
    });
    assert_eq!(pause.state(), PauseState::Running);
    let still = pause.stood_still();
    assert!(still >= 50 * MS && still < summary.wall, "{still:?}");
    assert_eq!((summary.end, summary.succeeded), (RunEnd::Complete, 52));
    assert_eq!(script.ended.joins, [join]);
    for (seed, &id) in wave[2..].iter().enumerate() {
        assert_eq!(*script.ended.of(id), Ok(mix(seed as u64)));
    }
    let lines = lines(&recorded);
    let at = |line: &str| lines.iter().position(|l| l == line).unwrap();
    let (pausing, paused, continued) = (at("pausing"), at("paused"), at("continued"));
    assert!(pausing < paused && paused + 1 == continued, "{lines:#?}");
    assert!(
        !lines[pausing..continued]
            .iter()
            .any(|line| line.starts_with("start")),
        "{lines:#?}"
    );
    // What was queued with the executor came back and was started anew as the same attempt.
    let back = lines.iter().filter(|line| line.starts_with("back")).count();
    let starts = lines.iter().filter(|l| l.starts_with("start")).count();
    assert_eq!(starts, 52 + back);
    assert!(
        lines
            .iter()
            .all(|l| !l.starts_with("start") || l.ends_with("#1"))
    );
}

#[test]
fn a_join_waits_for_the_end_of_a_pause() {
    let pause = PauseToken::new();
    pause.pause();
    let mut graph = Graph::new();
    graph.add_join("start", vec![]).unwrap();
    let mut script = Script::passive();
    let options = RunOptions {
        pause: pause.clone(),
        ..RunOptions::default()
    };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            until(|| pause.state() == PauseState::Paused);
            pause.go_on();
        });
        run_blocking(graph, &mut script, pool(1), options).unwrap()
    });
    assert_eq!(script.ended.joins.len(), 1);
}

#[test]
fn a_paused_run_can_be_cancelled() {
    for now in [CancelToken::cancel, CancelToken::cancel_now] {
        let (cancel, pause) = (CancelToken::new(), PauseToken::new());
        pause.pause();
        let mut graph = Graph::new();
        graph.add_task(task(Job::Echo(1))).unwrap();
        let mut script = Script::passive();
        let options = RunOptions {
            cancel: cancel.clone(),
            pause: pause.clone(),
            ..RunOptions::default()
        };
        let summary = std::thread::scope(|scope| {
            scope.spawn(|| {
                until(|| pause.state() == PauseState::Paused);
                now(&cancel);
            });
            run_blocking(graph, &mut script, pool(2), options).unwrap()
        });
        assert_eq!((summary.end, summary.not_run), (RunEnd::Cancelled, 1));
        assert!(script.ended.tasks.is_empty());
    }
}

#[test]
fn a_pause_does_not_keep_a_run_that_is_done() {
    let pause = PauseToken::new();
    pause.pause();
    let options = RunOptions {
        pause,
        ..RunOptions::default()
    };
    let summary = run_blocking(Graph::new(), &mut Script::passive(), pool(1), options).unwrap();
    assert_eq!(summary.end, RunEnd::Complete);
}

#[test]
fn a_retry_that_falls_due_in_a_pause_waits_for_its_end() {
    let pause = PauseToken::new();
    let mut graph = Graph::new();
    let again = task(Job::SucceedAt(2)).retry(attempts(2).with_delay(10 * MS));
    let again = graph.add_task(again).unwrap();
    let quick = graph.add_task(task(Job::Echo(1)).after([])).unwrap();
    let asked = pause.clone();
    let mut script = Script::passive().at_task(move |id, _| {
        if id == quick {
            asked.pause();
        }
        Ok(())
    });
    let options = RunOptions {
        pause: pause.clone(),
        ..RunOptions::default()
    };
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| {
            until(|| pause.state() == PauseState::Paused);
            std::thread::sleep(30 * MS);
            assert_eq!(pause.state(), PauseState::Paused);
            pause.go_on();
        });
        run_blocking(graph, &mut script, pool(1), options).unwrap()
    });
    assert_eq!(*script.ended.of(again), Ok(2));
    assert_eq!((summary.retries, summary.end), (1, RunEnd::Complete));
}
