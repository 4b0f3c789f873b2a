//! A run of weeks is not restarted once but ten times, by queues that give it a day each, and experiments are
//! reruns of reruns. An error that each restart adds, however small, would show only at the end of the chain.

use std::path::Path;
use std::time::Duration;

use tests::history;
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::workplace::{Signal, Workplace};

const RUN: &str = "parent";

fn ordeal(threads: u32) -> Ordeal<'static> {
    Ordeal {
        input: Path::new("input.yaml"),
        run: RUN,
        threads,
    }
}

fn submitted(input: &str) -> Workplace {
    let place = Workplace::new();
    place.write("input.yaml", input);
    ordeal(2).arrive(&place);
    place
}

#[test]
fn stopped_after_every_few_events_the_run_comes_to_the_same_bits() {
    for input in [
        inputs::biaxial_with_cuts(RUN, 60, 3),
        inputs::biaxial(RUN, 60, 4),
    ] {
        let calm = submitted(&input);
        let place = Workplace::new();
        place.write("input.yaml", &input);
        let mut stops = 0;
        for session in 0..200 {
            let signals = [Signal::TERM, Signal::KILL, Signal::INT];
            let blow = Blow {
                events: 5,
                then: Duration::ZERO,
                signal: signals[session % 3],
            };
            let outcome = ordeal(1 + session as u32 % 2).hit(&place, blow);
            if outcome.code == Some(0) {
                break;
            }
            stops += 1;
        }
        assert!(stops >= 5, "{stops} stops: the test shows nothing");
        ordeal(2).arrive(&place);
        let (ours, calm) = [&place, &calm]
            .map(|place| history::of(&place.store(), RUN))
            .into();
        assert_eq!(ours, calm, "after {stops} stops");
    }
}

#[test]
fn a_rerun_of_a_rerun_of_a_rerun_is_the_run_also_without_the_runs_between() {
    let place = submitted(&inputs::biaxial(RUN, 40, 5));
    let calm = history::of(&place.store(), RUN);
    let mut parent = RUN.to_owned();
    for step in 1..5 {
        let name = format!("again-{step}");
        let verb = if step % 2 == 0 { "branch" } else { "rerun" };
        let at = format!("{parent}@{step}");
        place.run([verb, &at, "--name", &name]).success();
        assert_eq!(history::of(&place.store(), &name), calm, "{name}");
        parent = name;
    }
    // What each of them holds is little; what they need of each other is kept.
    for name in [RUN, "again-1", "again-2", "again-3"] {
        place.run(["prune", name, "--keep-last", "1"]).success();
    }
    place
        .run(["rerun", "again-4@4", "--name", "last"])
        .success();
    let digest = |run: &str| {
        let steps = history::everything(&place.store())
            .unwrap()
            .remove(run)
            .unwrap()
            .1;
        steps.last().map(|(step, digest, _)| (*step, *digest))
    };
    assert_eq!(digest("last"), calm.unwrap().steps.last().copied());
}
