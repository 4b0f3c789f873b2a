//! Who follows a run from another terminal wants to see what its own terminal shows, and to be told when and how it ends;
//! a script takes the exit code for the run's. The run must not notice.

use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;
use tests::history;
use tests::inputs;
use tests::ordeal::Ordeal;
use tests::patience::until;
use tests::workplace::{Session, Signal, Workplace};

const RUN: &str = "small";

fn begun(place: &Workplace, steps: u32) -> Session {
    let input = place.write("input.yaml", &inputs::biaxial(RUN, 60, steps));
    let ordeal = Ordeal {
        input: &input,
        run: RUN,
        threads: 1,
    };
    let mut session = ordeal.session(place);
    until("the run begins to step", || {
        assert!(session.is_alive());
        ordeal.events(place) > 8
    });
    session
}

#[test]
fn a_run_is_followed_to_its_end() {
    let place = Workplace::new();
    let session = begun(&place, 12);
    // The one that is computed need not be named.
    let shown = place.start(["watch"]);
    let streamed = place.start(["watch", RUN, "--json"]);
    let outcome = session.wait().success();
    let shown = shown.wait().success();
    assert!(shown.out.contains("is completed"), "{}", shown.out);
    assert!(shown.err.contains("run small: "), "{}", shown.err);
    // The same lines as where it is computed, but for the times in them.
    let line = |text: &str| {
        let found = text
            .lines()
            .find(|line| line.contains("increment 12/12 committed"));
        found.map(|line| line.split("residual").next().unwrap().to_owned())
    };
    assert!(
        line(&outcome.err).is_some() && line(&outcome.err) == line(&shown.err),
        "{}",
        shown.err
    );

    let again = place.start(["watch", RUN]).wait().success();
    assert!(
        again.err.contains("12 of 12 increments done") && !again.err.contains("going on"),
        "{}",
        again.err
    );

    let streamed = streamed.wait().success();
    let events: Vec<Value> = streamed
        .out
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(events[0]["event"], "session");
    assert_eq!(events.last().unwrap()["event"], "ended");
    let committed = events
        .iter()
        .filter(|event| event["event"] == "step_committed");
    assert!(committed.count() >= 12);

    // What has ended is told at once, and nothing else is there to watch.
    assert!(
        place
            .run(["watch", RUN])
            .success()
            .out
            .contains("is completed")
    );
    place.run(["watch"]).ended_with(2);
    place.run(["watch", "other"]).ended_with(2);
}

#[test]
fn the_exit_code_is_that_of_the_run() {
    let place = Workplace::new();
    let session = begun(&place, 300);
    let watch = place.start(["watch", RUN, "--json"]);
    sleep(Duration::from_millis(300));
    place.run(["cancel", RUN, "--timeout", "120"]).success();
    session.wait().ended_with(143);
    let watch = watch.wait().ended_with(143);
    assert!(watch.err.contains("cancelled by process"), "{}", watch.err);
    assert!(
        watch.out.lines().all(|line| line.starts_with('{')),
        "{}",
        watch.out
    );

    let session = place.start(["resume", RUN]);
    let watch = place.start(["watch", RUN]);
    until("it is watched", || {
        let status = place.run(["status", RUN, "--json"]).success();
        serde_json::from_str::<Value>(&status.out).unwrap()["alive"] == true
    });
    sleep(Duration::from_millis(500));
    session.signal(Signal::KILL);
    session.wait();
    let watch = watch.wait();
    // A watch that began before the session did has seen the end of the one before.
    assert!(matches!(watch.code, Some(1 | 143)), "{watch:#?}");
}

#[test]
fn a_run_that_waits_in_the_queue_is_waited_for() {
    let place = Workplace::new();
    let session = begun(&place, 300);
    let next = place.write("next.yaml", &inputs::biaxial("next", 40, 1));
    place.run(["submit", next.to_str().unwrap()]).success();
    let watch = place.start(["watch", "next"]);
    sleep(Duration::from_millis(500));
    place.run(["cancel", RUN, "--timeout", "120"]).success();
    session.wait().ended_with(143);
    let watch = watch.wait().success();
    assert!(watch.err.contains("run next is queued"), "{}", watch.err);
    assert!(watch.out.contains("`next` is completed"), "{}", watch.out);
    assert!(history::of(&place.store(), "next").is_some());
}
