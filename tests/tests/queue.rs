//! Who submits a run at night while another one computes wants it computed next, not refused; and a queue that loses an
//! entry, computes one twice or stops at the first that fails is worse than none. Whatever is killed and whoever comes
//! next, each entry is computed once, in order, to the bits that it has when it is computed alone.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::Ordeal;
use tests::patience::until;
use tests::workplace::{Outcome, Session, Signal, Workplace};

const LONG: &str = "long";

fn json(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:#?}"))
}

fn write(place: &Workplace, name: &str, grains: u32, steps: u32) -> String {
    let file = format!("{name}.yaml");
    let path = place.write(&file, &inputs::biaxial(name, grains, steps));
    path.to_str().unwrap().to_owned()
}

/// A run that computes until it is told to stop, and has begun to step.
fn busy(place: &Workplace) -> Session {
    let input = write(place, LONG, 100, 400);
    let mut session = place.start(["submit", &input, "--threads", "1"]);
    let ordeal = Ordeal {
        input: &PathBuf::from(&input),
        run: LONG,
        threads: 1,
    };
    until("the first run begins", || {
        assert!(session.is_alive());
        ordeal.events(place) > 8
    });
    session
}

fn queue(place: &Workplace) -> Vec<Value> {
    let outcome = place.run(["queue", "--json"]).success();
    json(&outcome)["queue"].as_array().unwrap().clone()
}

fn states(place: &Workplace) -> Vec<(u64, String)> {
    let state = |entry: &Value| entry["state"].as_str().unwrap().to_owned();
    let entries = queue(place);
    let entries = entries.iter();
    entries
        .map(|entry| (entry["id"].as_u64().unwrap(), state(entry)))
        .collect()
}

fn runs(place: &Workplace) -> Vec<String> {
    let runs = json(&place.run(["runs", "--json"]).success());
    let runs = runs["runs"].as_array().unwrap().iter();
    runs.map(|run| run["name"].as_str().unwrap().to_owned())
        .collect()
}

fn alone(name: &str, grains: u32, steps: u32) -> History {
    let place = Workplace::new();
    let input = write(&place, name, grains, steps);
    place.run(["submit", &input]).success();
    history::of(&place.store(), name).unwrap()
}

/// Cancels the long run; its process goes on with the queue and ends.
fn give_way(place: &Workplace, session: Session) -> Outcome {
    place.run(["cancel", LONG, "--timeout", "120"]).success();
    session.wait()
}

#[test]
fn what_is_submitted_meanwhile_is_computed_next_to_the_same_bits() {
    let place = Workplace::new();
    let session = busy(&place);
    let input = write(&place, "next", 40, 2);
    let queued = json(&place.run(["submit", &input, "--json"]).success());
    assert_eq!(queued["queued"][0]["name"], "next");
    assert_eq!(queued["queued"][0]["position"], 1);
    assert_eq!(queued["worker"]["pid"], session.pid());
    // Two of one name do not get in each other's way.
    let again = place.run(["submit", &input]).success();
    assert!(
        again.out.contains("`next-2`") && again.out.contains("position 2"),
        "{}",
        again.out
    );
    // The entry is all that is needed: the file may go.
    fs::remove_file(&input).unwrap();
    assert_eq!(
        states(&place),
        [(1, "waiting".to_owned()), (2, "waiting".to_owned())]
    );
    let outcome = give_way(&place, session).ended_with(143);
    assert!(
        outcome.err.contains("queue: number 1, run `next`"),
        "{}",
        outcome.err
    );
    assert_eq!(queue(&place), [Value::Null; 0]);
    let expected = alone("next", 40, 2);
    for run in ["next", "next-2"] {
        assert_eq!(history::of(&place.store(), run).as_ref(), Some(&expected));
    }
}

#[test]
fn what_is_wrong_or_pointless_is_refused_and_queues_nothing() {
    let place = Workplace::new();
    let session = busy(&place);
    let bad = place.write("bad.yaml", "name: bad\nmesh: {}\n");
    place.run(["submit", bad.to_str().unwrap()]).ended_with(2);
    place.run(["resume", "nobody"]).ended_with(2);
    place
        .run(["branch", "long@0", "--set", "mesh=1"])
        .ended_with(2);
    place
        .run(["branch", "nobody@1", "--hold", "--steps", "1"])
        .ended_with(2);
    let refused = place.run(["resume", LONG]).ended_with(3);
    assert!(
        refused.err.contains(&session.pid().to_string()),
        "{}",
        refused.err
    );
    let input = write(&place, "next", 40, 1);
    let refused = place.run(["submit", &input, "--alone"]).ended_with(3);
    assert!(
        refused.err.contains(&session.pid().to_string()),
        "{}",
        refused.err
    );
    place.run(["queue", "run"]).ended_with(3);
    assert_eq!(queue(&place), [Value::Null; 0]);
    place
        .run(["cancel", LONG, "--process", "--timeout", "120"])
        .success();
    session.wait().ended_with(143);
}

#[test]
fn branches_and_resumes_wait_as_well() {
    let place = Workplace::new();
    let input = write(&place, "parent", 40, 2);
    place.run(["submit", &input]).success();
    let stopped = write(&place, "stopped", 60, 40);
    place
        .run(["submit", &stopped, "--until", "300ms", "--threads", "1"])
        .ended_with(75);
    let branch = ["branch", "parent@1", "--hold", "--steps", "2", "--name"];
    place.run(branch.into_iter().chain(["calm"])).success();
    let session = busy(&place);
    let queued = place.run(branch.into_iter().chain(["waited"])).success();
    assert!(queued.out.contains("position 1"), "{}", queued.out);
    place
        .run(["rerun", "parent@1", "--name", "once-more"])
        .success();
    place.run(["resume", "stopped"]).success();
    let again = place.run(["resume", "stopped"]).ended_with(2);
    assert!(again.err.contains("is queued already"), "{}", again.err);
    give_way(&place, session).ended_with(143);
    let of = |run: &str| history::of(&place.store(), run).unwrap();
    assert_eq!(of("waited"), of("calm"));
    assert_eq!(of("once-more"), of("parent"));
    assert_eq!(of("stopped"), alone("stopped", 60, 40));
    // What is complete has nothing to wait for.
    place.run(["resume", "stopped"]).success();
    assert_eq!(queue(&place), [Value::Null; 0]);
}

#[test]
fn a_killed_owner_leaves_the_queue_to_whoever_comes_next() {
    let place = Workplace::new();
    let session = busy(&place);
    for name in ["a", "b"] {
        place.run(["submit", &write(&place, name, 40, 1)]).success();
    }
    session.signal(Signal::KILL);
    session.wait();
    assert_eq!(
        states(&place),
        [(1, "waiting".to_owned()), (2, "waiting".to_owned())]
    );
    // Somebody's own run comes first.
    let outcome = place
        .run(["submit", &write(&place, "c", 40, 1), "--json"])
        .success();
    let report = json(&outcome);
    assert_eq!(report["name"], "c");
    assert_eq!(report["queue"][0]["name"], "a");
    assert_eq!(report["queue"][1]["name"], "b");
    assert_eq!(runs(&place), ["a", "b", "c", "long"]);
    // Unless it wants to be left alone.
    place
        .run(["submit", &write(&place, "d", 40, 1), "--queue"])
        .success();
    place
        .run(["submit", &write(&place, "e", 40, 1), "--alone"])
        .success();
    assert_eq!(states(&place), [(3, "waiting".to_owned())]);
    place.run(["queue", "run"]).success();
    assert_eq!(runs(&place), ["a", "b", "c", "d", "e", "long"]);
}

#[test]
fn an_entry_is_neither_lost_nor_done_twice_wherever_the_owner_is_killed() {
    let expected = alone("next", 60, 6);
    // Before its run is made: the file is marked as taken, nothing else has happened.
    let place = Workplace::new();
    let input = write(&place, "next", 60, 6);
    place.run(["submit", &input, "--queue"]).success();
    let folder = place.store().join("queue");
    fs::rename(folder.join("00000001.job"), folder.join("00000001.taken")).unwrap();
    assert_eq!(states(&place), [(1, "interrupted".to_owned())]);
    // While it is computed, more than once, and when it is made but not removed.
    for events in [2, 9, 14] {
        let mut owner = place.start(["queue", "run", "--threads", "1"]);
        let ordeal = Ordeal {
            input: &PathBuf::from(&input),
            run: "next",
            threads: 1,
        };
        let before = ordeal.events(&place);
        until("the run goes on", || {
            !owner.is_alive() || ordeal.events(&place) >= before + events
        });
        owner.signal(Signal::KILL);
        owner.wait();
        assert_eq!(runs(&place), ["next"]);
    }
    let kept = fs::read(folder.join("00000001.taken")).unwrap();
    place.run(["queue", "run"]).success();
    assert_eq!(
        history::of(&place.store(), "next").as_ref(),
        Some(&expected)
    );
    fs::write(folder.join("00000001.taken"), kept).unwrap();
    place.run(["queue", "run"]).success();
    assert_eq!(runs(&place), ["next"]);
    assert_eq!(queue(&place), [Value::Null; 0]);
}

#[test]
fn an_entry_that_fails_does_not_stop_the_rest_and_says_why() {
    let place = Workplace::new();
    place
        .run(["submit", &write(&place, "parent", 40, 1)])
        .success();
    place
        .run(["submit", &write(&place, "damaged", 40, 1), "--queue"])
        .success();
    place
        .run([
            "branch", "parent@1", "--hold", "--steps", "1", "--name", "orphan", "--queue",
        ])
        .success();
    // Both steps that cannot be solved and those that come after them are reached.
    let hopeless = format!(
        "{}solver: {{ iterations: 1, relaxation_iterations: 0, smallest_step: 1.0, force_tolerance: 1e-12, loosest_force_tolerance: 1e-12 }}\n",
        inputs::biaxial("hopeless", 40, 1)
    );
    let hopeless = place.write("hopeless.yaml", &hopeless);
    place
        .run(["submit", hopeless.to_str().unwrap(), "--queue"])
        .success();
    place
        .run(["submit", &write(&place, "good", 40, 1), "--queue"])
        .success();
    let entry = place.store().join("queue/00000001.job");
    let mut bytes = fs::read(&entry).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&entry, bytes).unwrap();
    // What is queued is taken into account; here the folder is taken away behind the store's back.
    let refused = place.run(["delete", "parent"]).ended_with(2);
    assert!(refused.err.contains("queue remove 2"), "{}", refused.err);
    fs::remove_dir_all(place.store().join("packs/parent")).unwrap();
    let outcome = place.run(["queue", "run"]).ended_with(1);
    assert!(
        outcome.err.contains("3 of 4 queued runs failed"),
        "{}",
        outcome.err
    );
    let good = history::of(&place.store(), "good").unwrap();
    assert_eq!(good.state, store::RunState::Completed);
    // A run that failed tells of it by itself; work that never became one stays in the queue and says why.
    let left = queue(&place);
    assert_eq!(
        states(&place),
        [(1, "failed".to_owned()), (2, "failed".to_owned())]
    );
    assert!(
        left[0]["why"].as_str().unwrap().contains("00000001"),
        "{left:#?}"
    );
    assert!(
        left[1]["why"].as_str().unwrap().contains("parent@1"),
        "{left:#?}"
    );
    place.run(["queue", "remove", "1", "orphan"]).success();
    assert_eq!(queue(&place), [Value::Null; 0]);
}

#[test]
fn entries_can_be_taken_back_until_they_are_begun() {
    let place = Workplace::new();
    for name in ["a", "b"] {
        place
            .run(["submit", &write(&place, name, 40, 1), "--queue"])
            .success();
    }
    let refused = place.run(["queue", "remove", "1", "7"]).ended_with(2);
    assert!(refused.err.contains("`7`"), "{}", refused.err);
    assert_eq!(queue(&place).len(), 2);
    place.run(["queue", "remove", "b"]).success();
    let listed = place.run(["queue"]).success().out;
    assert!(
        listed.contains(" a ") && listed.contains("queue run"),
        "{listed}"
    );
    place.run(["queue", "run"]).success();
    assert_eq!(runs(&place), ["a"]);
    assert!(
        place
            .run(["queue", "run"])
            .success()
            .out
            .contains("Nothing is queued")
    );
}

#[test]
fn an_owner_that_is_stopped_leaves_the_rest_for_the_next_one() {
    let place = Workplace::new();
    for (name, steps) in [("a", 300), ("b", 1)] {
        place
            .run(["submit", &write(&place, name, 60, steps), "--queue"])
            .success();
    }
    place
        .run(["queue", "run", "--until", "1500ms", "--threads", "1"])
        .ended_with(75);
    assert_eq!(
        states(&place),
        [(1, "interrupted".to_owned()), (2, "waiting".to_owned())]
    );
    let owner = place.start(["queue", "run", "--threads", "1"]);
    until("it goes on with the first", || {
        states(&place)[0].1 == "running"
    });
    let refused = place.run(["queue", "remove", "a"]).ended_with(2);
    assert!(refused.err.contains("cancel a"), "{}", refused.err);
    until("the session begins", || {
        place
            .run(["cancel", "a", "--process", "--timeout", "120"])
            .code
            == Some(0)
    });
    owner.wait().ended_with(143);
    assert_eq!(states(&place).len(), 2);
    // An interrupted one can be taken back when nobody is at it; its run stays.
    place.run(["queue", "remove", "a"]).success();
    place.run(["queue", "run"]).success();
    assert_eq!(runs(&place), ["a", "b"]);
    assert_eq!(queue(&place), [Value::Null; 0]);
}

/// The lock may be given up between somebody's look at it and what he queues because of it.
#[test]
fn of_many_that_are_submitted_at_once_each_is_computed_once() {
    let place = Workplace::new();
    let names = ["a", "b", "c", "d", "e"];
    let inputs = names.map(|name| write(&place, name, 30, 1));
    let submitted: Vec<Session> = inputs
        .iter()
        .map(|input| place.start(["submit", input, "--threads", "1"]))
        .collect();
    for session in submitted {
        session.wait().success();
    }
    assert_eq!(queue(&place), [Value::Null; 0]);
    assert_eq!(runs(&place), names);
    for name in names {
        let history = history::of(&place.store(), name).unwrap();
        assert_eq!(history.state, store::RunState::Completed);
    }
}
