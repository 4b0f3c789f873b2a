//! A step that needs one more Newton iteration grows its graph while it runs. These tests hold that
//! growth is taken in where it is asked for, and that a director that fails ends the run cleanly.

mod common;

use common::*;
use engine::{
    CancelToken, Graph, NodeError, NodeId, RunEnd, RunError, RunOptions, TaskContext, perform,
    run_blocking,
};

/// A loop like Newton's: waves, each followed by a join that sums the outputs in node order.
fn newton_like(threads: usize, waves: usize) -> (u64, u64) {
    let mut graph = Graph::new();
    graph.add_join("start", vec![]).unwrap();
    let mut sum = 0_u64;
    let mut wave: Vec<NodeId> = Vec::new();
    let mut left = waves;
    let mut script = Script::at_join(|_, ended, graph| {
        for &id in &wave {
            sum = sum.rotate_left(7) ^ ended.of(id).as_ref().copied().unwrap();
        }
        ended.tasks.clear();
        if left > 0 {
            left -= 1;
            wave = (0..40)
                .map(|i| graph.add_task(task(Job::Mix(sum % 1000 + i))).unwrap())
                .collect();
            graph.forget_before(wave[0]);
            graph.add_join("iteration", wave.clone()).unwrap();
        }
        Ok(())
    });
    let summary = run_blocking(graph, &mut script, pool(threads), RunOptions::default()).unwrap();
    drop(script);
    assert_eq!(summary.not_run, 0);
    assert_eq!(summary.joins, waves as u64 + 1);
    (sum, summary.succeeded)
}

#[test]
fn a_loop_of_waves_gives_the_same_sum_on_any_number_of_threads() {
    let one = newton_like(1, 25);
    assert_eq!(one.1, 25 * 40);
    assert_eq!(one, newton_like(2, 25));
    assert_eq!(one, newton_like(4, 25));
}

#[test]
fn a_finished_task_can_add_the_next_one() {
    let mut graph = Graph::new();
    graph.add_task(task(Job::Echo(0))).unwrap();
    let mut script = Script::passive().at_task(|id, graph| {
        if id.index() < 50 {
            graph.add_task(task(Job::Echo(0)).after([id])).unwrap();
        }
        Ok(())
    });
    let summary = run_blocking(graph, &mut script, pool(2), RunOptions::default()).unwrap();
    assert_eq!(summary.succeeded, 51);
    assert!(script.ended.order().into_iter().eq(0..=50));
}

#[test]
fn a_task_added_after_a_failed_one_is_skipped() {
    let mut graph = Graph::new();
    let failed = graph.add_task(task(Job::Fail)).unwrap();
    graph.add_join("join", vec![failed]).unwrap();
    let mut script = Script::at_join(move |_, _, graph| {
        graph.add_task(task(Job::Echo(1)).after([failed])).unwrap();
        Ok(())
    });
    let summary = run_blocking(graph, &mut script, pool(1), RunOptions::default()).unwrap();
    assert_eq!((summary.failed, summary.skipped), (1, 1));
}

#[test]
fn a_forgotten_node_cannot_be_waited_for() {
    let mut graph = Graph::new();
    let old = graph.add_task(task(Job::Echo(0))).unwrap();
    let join = graph.add_join("join", vec![old]).unwrap();
    let mut error = None;
    let mut script = Script::at_join(|_, _, graph| {
        graph.forget_before(join);
        error = graph.add_task(task(Job::Echo(1)).after([old])).err();
        graph.add_task(task(Job::Echo(2)).after([join])).unwrap();
        Ok(())
    });
    let summary = run_blocking(graph, &mut script, pool(1), RunOptions::default()).unwrap();
    drop(script);
    let expected = NodeError::Forgotten {
        node: old,
        kept_from: join,
    };
    assert_eq!(error, Some(expected));
    assert_eq!(summary.succeeded, 2);
}

#[test]
fn an_error_of_the_director_ends_the_run_without_waiting_for_tasks() {
    let mut graph = Graph::new();
    graph.add_task(task(Job::Echo(0)).priority(1)).unwrap();
    for _ in 0..10 {
        graph.add_task(task(Job::Polite(AGES))).unwrap();
    }
    let mut script =
        Script::passive().at_task(|_, _| Err(DirectorError("the disk is full".to_string())));
    let (events, recorded) = recorder();
    let options = RunOptions {
        events,
        ..RunOptions::default()
    };
    let error = run_blocking(graph, &mut script, pool(2), options).unwrap_err();
    assert!(matches!(error, RunError::Director(DirectorError(text)) if text == "the disk is full"));
    assert_eq!(script.ended.tasks.len(), 1, "it is not called again");
    assert_eq!(lines(&recorded).last().unwrap(), "end DirectorFailed");
}

#[test]
fn a_panicking_director_is_an_error_of_the_run() {
    let mut graph = Graph::new();
    graph.add_join("join", vec![]).unwrap();
    let mut script = Script::at_join(|_, _, _| panic!("singular matrix"));
    let error = run_blocking(graph, &mut script, pool(1), RunOptions::default()).unwrap_err();
    assert!(
        matches!(error, RunError::DirectorPanicked { message } if message == "singular matrix")
    );
}

#[test]
fn a_pool_is_whole_after_a_run_that_was_given_up() {
    let pool = pool(2);
    let mut graph = Graph::new();
    graph.add_join("join", vec![]).unwrap();
    for _ in 0..4 {
        graph.add_task(task(Job::Deaf(50 * MS))).unwrap();
    }
    let mut script = Script::at_join(|_, _, _| {
        std::thread::sleep(10 * MS);
        Err(DirectorError("no".to_string()))
    });
    run_blocking(graph, &mut script, pool.clone(), RunOptions::default()).unwrap_err();
    let mut graph = Graph::new();
    for i in 0..100 {
        graph.add_task(task(Job::Echo(i))).unwrap();
    }
    let summary = run_blocking(graph, &mut Script::passive(), pool, RunOptions::default()).unwrap();
    assert_eq!(summary.succeeded, 100);
}

#[test]
fn run_works_inside_a_runtime_of_either_kind_and_run_blocking_refuses() {
    let graph = || {
        let mut graph = Graph::new();
        let wave = (0..20)
            .map(|i| graph.add_task(task(Job::Echo(i))).unwrap())
            .collect();
        graph.add_join("join", wave).unwrap();
        graph
    };
    for mut builder in [
        tokio::runtime::Builder::new_current_thread(),
        tokio::runtime::Builder::new_multi_thread(),
    ] {
        let runtime = builder.enable_time().build().unwrap();
        let summary = runtime
            .block_on(engine::run(
                graph(),
                &mut Script::passive(),
                pool(2),
                RunOptions::default(),
            ))
            .unwrap();
        assert_eq!(summary.end, RunEnd::Complete);
        let nested = runtime.block_on(async {
            run_blocking(
                graph(),
                &mut Script::passive(),
                pool(1),
                RunOptions::default(),
            )
        });
        assert!(matches!(nested, Err(RunError::NestedRuntime)));
    }
}

#[test]
fn a_long_join_can_see_that_the_run_was_cancelled() {
    let cancel = CancelToken::new();
    let mut graph = Graph::new();
    graph.add_join("join", vec![]).unwrap();
    let asked = cancel.clone();
    let mut seen = None;
    let mut script = Script::at_join(|_, _, graph| {
        asked.cancel();
        seen = Some(graph.cancel_level());
        graph.add_task(task(Job::Echo(0))).unwrap();
        Ok(())
    });
    let options = RunOptions {
        cancel,
        ..RunOptions::default()
    };
    let summary = run_blocking(graph, &mut script, pool(1), options).unwrap();
    drop(script);
    assert_eq!(seen, Some(engine::CancelLevel::Graceful));
    assert_eq!(
        (summary.end, summary.joins, summary.not_run),
        (RunEnd::Cancelled, 1, 1)
    );
}

#[test]
fn one_failed_task_can_be_reproduced_alone() {
    let attempt = perform(&Job::SucceedAt(3), &TaskContext::new(3, None));
    assert_eq!(attempt.result.unwrap(), 3);
}
