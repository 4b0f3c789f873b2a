//! A run of a week is not watched at the terminal it was started from: it is stopped, held up and let go from another one,
//! perhaps on another host, where no signal reaches. A request must do what it says and nothing else, never reach a later
//! session, and change no bit.

use std::fs;
use std::sync::OnceLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;
use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::workplace::{Outcome, Session, Signal, Workplace};

const RUN: &str = "small";

fn on<T>(place: &Workplace, act: impl FnOnce(Ordeal<'_>) -> T) -> T {
    let input = place.write("input.yaml", &inputs::biaxial(RUN, 100, 8));
    act(Ordeal {
        input: &input,
        run: RUN,
        threads: 2,
    })
}

/// What the run comes to when nobody disturbs it.
fn calm() -> &'static History {
    static CALM: OnceLock<History> = OnceLock::new();
    CALM.get_or_init(|| {
        let place = Workplace::new();
        on(&place, |ordeal| ordeal.arrive(&place));
        history::of(&place.store(), RUN).unwrap()
    })
}

/// A session that has begun to step.
fn at_work(place: &Workplace, ordeal: Ordeal<'_>) -> Session {
    let before = ordeal.events(place);
    let mut session = ordeal.session(place);
    while session.is_alive() && ordeal.events(place) < before + 12 {
        sleep(Duration::from_millis(1));
    }
    assert!(
        session.is_alive(),
        "it ended too soon: the test shows nothing"
    );
    session
}

fn json(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:#?}"))
}

fn log(place: &Workplace) -> Vec<Value> {
    let outcome = place.run(["log", RUN, "--json"]).success();
    json(&outcome)["events"].as_array().unwrap().clone()
}

fn state(place: &Workplace) -> String {
    let status = json(&place.run(["status", RUN, "--json"]).success());
    status["state"].as_str().unwrap().to_owned()
}

#[test]
fn a_cancelled_run_stops_in_order_and_can_be_resumed() {
    for args in [&["cancel", RUN][..], &["cancel", RUN, "--now"]] {
        let place = Workplace::new();
        on(&place, |ordeal| {
            let session = at_work(&place, ordeal);
            let answer = place.run(args).success();
            assert!(answer.out.contains("is stopped"), "{}", answer.out);
            let outcome = session.wait().ended_with(143);
            assert!(
                outcome.err.contains("cancelled by process"),
                "{}",
                outcome.err
            );
            let stopped = history::of(&place.store(), RUN).unwrap();
            assert_eq!(stopped.state, store::RunState::Interrupted);
            assert!(stopped.steps.len() < calm().steps.len());
            ordeal.arrive(&place);
        });
        assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
    }
}

#[test]
fn a_paused_run_stands_still_and_goes_on_to_the_same_bits() {
    let place = Workplace::new();
    on(&place, |ordeal| {
        let session = at_work(&place, ordeal);
        place.run(["pause", RUN]).success();
        assert_eq!(state(&place), "paused");
        let runs = json(&place.run(["runs", "--json"]).success());
        assert_eq!(runs["runs"][0]["state"], "paused");
        let events = ordeal.events(&place);
        sleep(Duration::from_millis(900));
        assert_eq!(ordeal.events(&place), events, "something went on");
        // Once more is no second pause, and a paused store is still held.
        place.run(["pause", RUN]).success();
        place.run(["prune", RUN, "--keep-last", "1"]).ended_with(3);
        place.run(["continue", RUN]).success();
        session.wait().success();
        place.run(["continue", RUN]).ended_with(2);
    });
    assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
    let continued = log(&place).into_iter().find(|e| e["event"] == "continued");
    let paused = continued.unwrap()["data"]["paused_s"].as_f64().unwrap();
    assert!(paused > 0.9, "{paused}");
}

#[test]
fn a_paused_run_can_be_killed_cancelled_and_stopped_like_any_other() {
    for (signal, code) in [
        (Some(Signal::KILL), None),
        (Some(Signal::TERM), Some(143)),
        (None, Some(143)),
    ] {
        let place = Workplace::new();
        on(&place, |ordeal| {
            let session = at_work(&place, ordeal);
            place.run(["pause", RUN]).success();
            match signal {
                Some(signal) => session.signal(signal),
                None => drop(place.run(["cancel", RUN]).success()),
            }
            assert_eq!(session.wait().code, code);
            assert_eq!(state(&place), "interrupted");
            place.run(["continue", RUN]).ended_with(2);
            ordeal.arrive(&place);
        });
        assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
    }
}

#[test]
fn a_request_to_a_session_that_died_does_not_reach_the_next_one() {
    let place = Workplace::new();
    on(&place, |ordeal| {
        let session = at_work(&place, ordeal);
        session.signal(Signal::STOP);
        // Nobody can act, so the request stays, and says so.
        let unanswered = place.run(["cancel", RUN, "--timeout", "0.3"]).ended_with(1);
        assert!(
            unanswered.err.contains("nobody has taken"),
            "{}",
            unanswered.err
        );
        let folder = place.store().join("packs").join(RUN).join("control");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        session.signal(Signal::KILL);
        session.wait();
        ordeal.arrive(&place);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    });
    assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
}

#[test]
fn a_request_to_a_process_that_stands_still_is_acted_upon_when_it_goes_on() {
    let place = Workplace::new();
    on(&place, |ordeal| {
        let session = at_work(&place, ordeal);
        session.signal(Signal::STOP);
        place.run(["cancel", RUN, "--timeout", "0.3"]).ended_with(1);
        session.signal(Signal::CONT);
        session.wait().ended_with(143);
    });
}

#[test]
fn what_nobody_computes_cannot_be_asked_for_anything() {
    let place = Workplace::new();
    for verb in ["cancel", "pause", "continue"] {
        place.run([verb, RUN]).ended_with(3);
    }
    on(&place, |ordeal| ordeal.arrive(&place));
    for verb in ["cancel", "pause", "continue"] {
        let refused = place.run([verb, RUN]).ended_with(2);
        assert!(refused.err.contains("completed"), "{}", refused.err);
        place.run([verb, "other"]).ended_with(2);
    }
}

#[test]
fn a_deadline_stops_the_run_in_order_with_a_code_of_its_own() {
    let place = Workplace::new();
    let input = place.write("input.yaml", &inputs::biaxial(RUN, 200, 30));
    let input = input.to_str().unwrap();
    place
        .run(["submit", input, "--until", "2001-01-01T00:00"])
        .ended_with(2);
    assert!(!place.store().exists());
    let outcome = place
        .run(["submit", input, "--until", "700ms", "--threads", "2"])
        .ended_with(75);
    assert!(
        outcome.err.contains("stopped at its deadline"),
        "{}",
        outcome.err
    );
    assert_eq!(state(&place), "interrupted");
    let report = json(
        &place
            .run(["resume", RUN, "--json", "--until", "10h"])
            .success(),
    );
    assert_eq!(report["state"], "completed");
}

/// Cluster schedulers send SIGUSR1 some time before they kill; by default it ends a process at once.
#[test]
fn a_checkpoint_is_said_logged_and_changes_nothing() {
    let place = Workplace::new();
    on(&place, |ordeal| {
        let session = at_work(&place, ordeal);
        session.signal(Signal::USR1);
        let begun = Instant::now();
        while !log(&place)
            .iter()
            .any(|event| event["event"] == "checkpoint")
        {
            assert!(begun.elapsed().as_secs() < 60, "no checkpoint is logged");
        }
        let outcome = session.wait().success();
        assert!(outcome.err.contains("checkpoint: "), "{}", outcome.err);
    });
    assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
}

/// A kill right behind a request must not leave a run that is neither stopped nor resumable.
#[test]
fn killed_while_it_is_being_cancelled_the_run_arrives() {
    let place = Workplace::new();
    on(&place, |ordeal| {
        for wait in [0, 200, 320] {
            let session = at_work(&place, ordeal);
            let cancel = place.start(["cancel", RUN, "--timeout", "20"]);
            sleep(Duration::from_millis(wait));
            session.signal(Signal::KILL);
            session.wait();
            let answer = cancel.wait();
            assert!(matches!(answer.code, Some(0..=2)), "{answer:#?}");
        }
        ordeal.hit(
            &place,
            Blow {
                events: 3,
                then: Duration::ZERO,
                signal: Signal::KILL,
            },
        );
        ordeal.arrive(&place);
    });
    assert_eq!(history::of(&place.store(), RUN).as_ref(), Some(calm()));
}
