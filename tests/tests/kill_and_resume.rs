//! A run of weeks is killed on the way: by the queue, by a power cut, by its owner. Whatever the instant, `resume` has
//! to reach the same bits as a run that nobody disturbed; a run that differs in its last digit after a kill has lost
//! its history without anyone noticing.

use std::sync::OnceLock;
use std::time::Duration;

use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::random::Random;
use tests::workplace::{Signal, Workplace};

const RUN: &str = "small";

struct Calm {
    history: History,
    /// Events of the whole run.
    events: u64,
}

/// The run that nobody disturbs.
fn calm() -> &'static Calm {
    static CALM: OnceLock<Calm> = OnceLock::new();
    CALM.get_or_init(|| {
        let place = Workplace::new();
        on(&place, 2, |ordeal| {
            ordeal.arrive(&place);
            let history = history::of(&place.store(), RUN).unwrap();
            assert_eq!(history.state, store::RunState::Completed);
            assert_eq!(history.steps.len(), 7, "step 0 and six load steps");
            Calm {
                history,
                events: ordeal.events(&place),
            }
        })
    })
}

fn on<T>(place: &Workplace, threads: u32, act: impl FnOnce(Ordeal<'_>) -> T) -> T {
    let input = place.write("small.yaml", &inputs::biaxial(RUN, 40, 6));
    act(Ordeal {
        input: &input,
        run: RUN,
        threads,
    })
}

fn assert_same_as_calm(place: &Workplace) {
    assert_eq!(
        history::of(&place.store(), RUN).as_ref(),
        Some(&calm().history)
    );
}

/// Kills sessions at random instants, also the sessions that resume, until `kills` have hit; then lets it arrive.
fn killed_at_random(seed: u64, kills: u32, threads: u32) {
    let (mut random, place) = (Random::new(seed), Workplace::new());
    on(&place, threads, |ordeal| {
        let mut hit = 0;
        for _ in 0..kills {
            // What is left of the run shrinks: a blow is drawn over the first part of what a session does.
            let left = calm().events.saturating_sub(ordeal.events(&place)).max(4);
            let outcome = ordeal.hit(&place, Blow::random(&mut random, left * 3 / 4));
            hit += u32::from(outcome.signal == Some(9));
        }
        assert!(hit > 0, "no kill hit the run: the test shows nothing");
        ordeal.arrive(&place);
    });
    assert_same_as_calm(&place);
}

#[test]
fn killed_once_the_run_arrives_at_the_same_bits() {
    for seed in 1..=3 {
        killed_at_random(seed, 1, 2);
    }
}

#[test]
fn killed_again_and_again_also_while_resuming_it_arrives_at_the_same_bits() {
    killed_at_random(11, 3, 1);
    killed_at_random(12, 5, 2);
}

#[test]
fn killed_during_preparation_it_arrives_at_the_same_bits() {
    let place = Workplace::new();
    on(&place, 2, |ordeal| {
        // Events: session, preparing; then the packings, one by one.
        for (events, wait) in [(1, 0), (2, 30), (3, 0)] {
            let blow = Blow {
                events,
                then: Duration::from_millis(wait),
                signal: Signal::KILL,
            };
            ordeal.hit(&place, blow);
        }
        ordeal.arrive(&place);
    });
    assert_same_as_calm(&place);
}

#[test]
fn a_signal_stops_the_run_in_order_and_says_how_to_go_on() {
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let place = Workplace::new();
        on(&place, 2, |ordeal| {
            let blow = Blow {
                events: calm().events / 3,
                then: Duration::from_millis(3),
                signal,
            };
            let outcome = ordeal.hit(&place, blow).ended_with(code);
            assert!(
                outcome.err.contains(&format!("femdem-flow resume {RUN}")),
                "{}",
                outcome.err
            );
            let stopped = history::of(&place.store(), RUN).unwrap();
            assert_eq!(stopped.state, store::RunState::Interrupted);
            assert!(stopped.steps.len() < calm().history.steps.len());
            ordeal.arrive(&place);
        });
        assert_same_as_calm(&place);
    }
}

#[test]
fn a_complete_run_is_left_as_it_is() {
    let place = Workplace::new();
    on(&place, 1, |ordeal| {
        ordeal.arrive(&place);
        ordeal.arrive(&place);
    });
    assert_same_as_calm(&place);
}

#[test]
fn a_second_process_on_the_store_is_refused_and_told_who_holds_it() {
    let place = Workplace::new();
    on(&place, 1, |ordeal| {
        let mut first = ordeal.session(&place);
        while first.is_alive() && ordeal.events(&place) < 4 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let input = ordeal.input.to_str().unwrap();
        for second in [&["resume", RUN][..], &["submit", input, "--name", "other"]] {
            let refused = place.run(second.iter().copied()).ended_with(3);
            let pid = first.pid().to_string();
            assert!(
                refused.err.contains(&pid),
                "it does not name {pid}: {}",
                refused.err
            );
        }
        assert!(
            first.is_alive(),
            "the first ended too soon: the test shows nothing"
        );
        first.wait().success();
    });
    assert_same_as_calm(&place);
    assert_eq!(history::of(&place.store(), "other"), None);
}
