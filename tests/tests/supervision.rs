//! A run over a weekend that dies on Friday night, of memory that ran out or of a bug, should have gone on by Saturday
//! morning. But what was stopped on purpose stays stopped, and what cannot be computed is not tried for ever.

use std::fs;

use rustix::process::{Pid, kill_process};
use serde_json::Value;
use tests::history::{self, History};
use tests::inputs;
use tests::patience::until;
use tests::workplace::{Session, Signal, Workplace};

const RUN: &str = "small";

fn input(place: &Workplace, steps: u32) -> String {
    let path = place.write("input.yaml", &inputs::biaxial(RUN, 100, steps));
    path.to_str().unwrap().to_owned()
}

fn calm(steps: u32) -> History {
    let place = Workplace::new();
    let input = input(&place, steps);
    place.run(["submit", &input]).success();
    history::of(&place.store(), RUN).unwrap()
}

fn log(place: &Workplace) -> Vec<Value> {
    let path = place.store().join("packs").join(RUN).join("events.jsonl");
    let text = fs::read_to_string(path).unwrap_or_default();
    let lines = text.lines();
    lines
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect()
}

fn count(place: &Workplace, event: &str) -> usize {
    log(place)
        .iter()
        .filter(|line| line["event"] == event)
        .count()
}

/// Waits for session number `number` to have begun a wave; the process that computes it.
fn computing(place: &Workplace, session: &mut Session, number: usize) -> Pid {
    until("the next session begins", || {
        assert!(session.is_alive(), "it has ended: {:#?}", log(place));
        let log = log(place);
        let begun = log.iter().rposition(|line| line["event"] == "session");
        let sessions = log.iter().filter(|line| line["event"] == "session");
        sessions.count() >= number
            && begun.is_some_and(|begun| {
                let since = &log[begun..];
                since.iter().any(|line| line["event"] == "wave_started")
            })
    });
    let log = log(place);
    let session = log.iter().rfind(|line| line["event"] == "session").unwrap();
    let pid = session["data"]["pid"].as_i64().unwrap();
    Pid::from_raw(i32::try_from(pid).unwrap()).unwrap()
}

#[test]
fn what_dies_is_started_again_and_arrives_at_the_same_bits() {
    let place = Workplace::new();
    let path = input(&place, 12);
    let mut session = place.start([
        "submit",
        &path,
        "--max-restarts",
        "3",
        "--threads",
        "1",
        "--json",
    ]);
    for (number, signal) in [(1, Signal::KILL), (2, Signal::ABORT)] {
        let pid = computing(&place, &mut session, number);
        assert_ne!(pid.as_raw_nonzero().get(), session.pid() as i32);
        // The run is what was submitted, whatever becomes of the file.
        let _ = fs::remove_file(&path);
        kill_process(pid, signal).unwrap();
    }
    let outcome = session.wait().success();
    let report: Value = serde_json::from_str(&outcome.out).unwrap();
    assert_eq!(report["state"], "completed");
    assert!(outcome.err.contains("restart 2 of 3"), "{}", outcome.err);
    assert_eq!(count(&place, "restart"), 2);
    let log = place.run(["log", RUN]).success().out;
    assert!(
        log.contains("died of signal 9") && log.contains("died of signal 6"),
        "{log}"
    );
    // One run, not one of each life.
    assert_eq!(
        fs::read_dir(place.store().join("packs")).unwrap().count(),
        1
    );
    assert_eq!(history::of(&place.store(), RUN).unwrap(), calm(12));
}

#[test]
fn what_dies_again_and_again_is_given_up() {
    let place = Workplace::new();
    let path = input(&place, 300);
    let mut session = place.start(["submit", &path, "--max-restarts", "1"]);
    for number in 1..=2 {
        let pid = computing(&place, &mut session, number);
        kill_process(pid, Signal::KILL).unwrap();
    }
    let outcome = session.wait().ended_with(1);
    assert!(
        outcome.err.contains("after 1 restarts") && outcome.err.contains("resume"),
        "{}",
        outcome.err
    );
}

#[test]
fn what_is_stopped_in_order_or_cannot_be_computed_is_not_started_again() {
    let place = Workplace::new();
    let path = input(&place, 300);
    let mut session = place.start(["submit", &path, "--max-restarts", "5", "--threads", "1"]);
    computing(&place, &mut session, 1);
    // A checkpoint is handed on as well.
    session.signal(Signal::USR1);
    until("the checkpoint is made", || {
        count(&place, "checkpoint") == 1
    });
    session.signal(Signal::TERM);
    session.wait().ended_with(143);
    assert_eq!(
        history::of(&place.store(), RUN).unwrap().state,
        store::RunState::Interrupted
    );

    let mut session = place.start(["resume", RUN, "--max-restarts", "5", "--threads", "1"]);
    computing(&place, &mut session, 2);
    place.run(["cancel", RUN, "--timeout", "120"]).success();
    session.wait().ended_with(143);
    place
        .run(["resume", RUN, "--max-restarts", "5", "--until", "1s"])
        .ended_with(75);

    let hopeless = format!(
        "{}solver: {{ iterations: 1, relaxation_iterations: 0, smallest_step: 1.0, force_tolerance: 1e-12, loosest_force_tolerance: 1e-12 }}\n",
        inputs::biaxial("hopeless", 40, 1)
    );
    let hopeless = place.write("hopeless.yaml", &hopeless);
    let outcome = place
        .run(["submit", hopeless.to_str().unwrap(), "--max-restarts", "5"])
        .ended_with(1);
    assert!(!outcome.err.contains("restart"), "{}", outcome.err);
    place
        .run(["submit", "no-such-file.yaml", "--max-restarts", "5"])
        .ended_with(2);
    assert_eq!(count(&place, "restart"), 0);
}

#[test]
fn a_supervisor_that_is_killed_leaves_nobody_computing_unwatched() {
    let place = Workplace::new();
    let path = input(&place, 300);
    let mut session = place.start(["submit", &path, "--max-restarts", "5", "--threads", "1"]);
    computing(&place, &mut session, 1);
    session.signal(Signal::KILL);
    session.wait();
    until("the computing process stops in order", || {
        history::told(&place.store(), RUN).unwrap().state == store::RunState::Interrupted
    });
}

#[test]
fn where_somebody_is_faster_than_the_restart_the_run_waits_its_turn() {
    let place = Workplace::new();
    let path = input(&place, 12);
    let mut session = place.start(["submit", &path, "--max-restarts", "3", "--threads", "1"]);
    let pid = computing(&place, &mut session, 1);
    let other = place.write("other.yaml", &inputs::biaxial("other", 60, 400));
    kill_process(pid, Signal::KILL).unwrap();
    // It takes the store in the second before the restart; the lock of a killed process is free as soon as it is gone.
    let mut other_session = None;
    until("the other one has the store", || {
        let mut session = place.start(["submit", other.to_str().unwrap(), "--alone"]);
        std::thread::sleep(std::time::Duration::from_millis(100));
        let has_it = session.is_alive();
        if has_it {
            other_session = Some(session);
        }
        has_it
    });
    let outcome = session.wait().success();
    assert!(outcome.out.contains("`small` is queued"), "{outcome:#?}");
    until("the other one can be cancelled", || {
        place.run(["cancel", "other", "--timeout", "120"]).code == Some(0)
    });
    other_session.unwrap().wait().ended_with(143);
    place.run(["queue", "run"]).success();
    // One run, gone on with, not a second one of the same.
    assert!(!place.store().join("packs/small-2").exists());
    assert_eq!(history::of(&place.store(), RUN).unwrap(), calm(12));
}
