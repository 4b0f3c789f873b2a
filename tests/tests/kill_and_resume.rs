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

/// A problem, and how it goes when nobody disturbs it.
struct Case {
    run: &'static str,
    input: fn(&str) -> String,
    calm: OnceLock<Calm>,
}

struct Calm {
    history: History,
    /// Events of the whole run.
    events: u64,
}

/// Eight load steps of three or so iterations.
static SMOOTH: Case = Case {
    run: "smooth",
    input: |run| inputs::biaxial(run, 100, 8),
    calm: OnceLock::new(),
};

/// Load steps that are cut, so that kills fall between an attempt and the next, shorter one.
static CUT: Case = Case {
    run: "cut",
    input: |run| inputs::biaxial_with_cuts(run, 60, 4),
    calm: OnceLock::new(),
};

/// v, λ and the double stress are part of what a step hands to the next.
static SECOND_GRADIENT: Case = Case {
    run: "second",
    input: |run| inputs::biaxial_with_second_gradient(run, 100, 6),
    calm: OnceLock::new(),
};

/// The end of a stage follows from a peak that earlier sessions have passed.
static DROP: Case = Case {
    run: "drop",
    input: |run| inputs::biaxial_with_a_drop(run, 60),
    calm: OnceLock::new(),
};

impl Case {
    fn calm(&self) -> &Calm {
        self.calm.get_or_init(|| {
            let place = Workplace::new();
            self.on(&place, 2, |ordeal| {
                ordeal.arrive(&place);
                let history = history::of(&place.store(), self.run).unwrap();
                assert_eq!(history.state, store::RunState::Completed);
                Calm {
                    history,
                    events: ordeal.events(&place),
                }
            })
        })
    }

    fn on<T>(&self, place: &Workplace, threads: u32, act: impl FnOnce(Ordeal<'_>) -> T) -> T {
        let input = place.write("input.yaml", &(self.input)(self.run));
        act(Ordeal {
            input: &input,
            run: self.run,
            threads,
        })
    }

    /// In `place` the run has arrived where the calm one did.
    fn assert_same_as_calm(&self, place: &Workplace) {
        assert_eq!(
            history::of(&place.store(), self.run).as_ref(),
            Some(&self.calm().history)
        );
    }

    /// Kills sessions at random instants, also those that resume; then lets the run arrive.
    fn killed_at_random(&self, seed: u64, kills: u32, threads: u32) {
        let (mut random, place) = (Random::new(seed), Workplace::new());
        self.on(&place, threads, |ordeal| {
            let mut hit = 0;
            for _ in 0..kills {
                // What is left of the run shrinks: an instant is drawn over the first part of that.
                let left = self
                    .calm()
                    .events
                    .saturating_sub(ordeal.events(&place))
                    .max(4);
                let outcome = ordeal.hit(&place, Blow::random(&mut random, left * 3 / 4));
                hit += u32::from(outcome.signal == Some(9));
            }
            assert!(hit > 0, "no kill hit the run: the test shows nothing");
            ordeal.arrive(&place);
        });
        self.assert_same_as_calm(&place);
    }
}

#[test]
fn killed_once_the_run_arrives_at_the_same_bits() {
    for seed in 1..=4 {
        SMOOTH.killed_at_random(seed, 1, 1 + seed as u32 % 2);
    }
}

#[test]
fn killed_again_and_again_also_while_resuming_it_arrives_at_the_same_bits() {
    SMOOTH.killed_at_random(11, 3, 1);
    SMOOTH.killed_at_random(12, 6, 2);
}

#[test]
fn killed_where_steps_are_cut_it_arrives_at_the_same_bits() {
    let steps = CUT.calm().history.steps.len();
    assert!(
        steps > 6,
        "{steps} steps: nothing was cut, the test shows nothing"
    );
    for seed in 21..=23 {
        CUT.killed_at_random(seed, 3, 2);
    }
}

#[test]
fn killed_with_a_second_gradient_it_arrives_at_the_same_bits() {
    for (seed, kills, threads) in [(31, 1, 2), (32, 4, 1)] {
        SECOND_GRADIENT.killed_at_random(seed, kills, threads);
    }
}

#[test]
fn killed_behind_a_peak_it_ends_the_stage_at_the_same_step() {
    let steps = DROP.calm().history.steps.len();
    assert!(
        (8..13).contains(&steps),
        "{steps} steps: the stage does not end early, the test shows nothing"
    );
    for (seed, kills, threads) in [(41, 3, 1), (42, 5, 2)] {
        DROP.killed_at_random(seed, kills, threads);
    }
}

#[test]
fn killed_during_preparation_it_arrives_at_the_same_bits() {
    let place = Workplace::new();
    SMOOTH.on(&place, 2, |ordeal| {
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
    SMOOTH.assert_same_as_calm(&place);
}

#[test]
fn a_signal_stops_the_run_in_order_and_says_how_to_go_on() {
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let place = Workplace::new();
        SMOOTH.on(&place, 2, |ordeal| {
            let blow = Blow {
                events: SMOOTH.calm().events / 3,
                then: Duration::from_millis(3),
                signal,
            };
            let outcome = ordeal.hit(&place, blow).ended_with(code);
            // The command that it proposes works when it is pasted: it names the store.
            let store = place.store();
            let command = format!(
                "femdem-flow --store {} resume {}",
                store.display(),
                SMOOTH.run
            );
            assert!(outcome.err.contains(&command), "{}", outcome.err);
            let stopped = history::of(&place.store(), SMOOTH.run).unwrap();
            assert_eq!(stopped.state, store::RunState::Interrupted);
            assert!(stopped.steps.len() < SMOOTH.calm().history.steps.len());
            ordeal.arrive(&place);
        });
        SMOOTH.assert_same_as_calm(&place);
    }
}

/// A branch that was stopped and says nothing of it looks complete to whoever typed it and to every script.
#[test]
fn a_signal_during_a_branch_is_not_reported_as_success() {
    let place = Workplace::new();
    let file = place.write("input.yaml", &inputs::biaxial("parent", 40, 2));
    place.run(["submit", file.to_str().unwrap()]).success();
    let ordeal = Ordeal {
        input: &file,
        run: "stopped",
        threads: 1,
    };
    let mut branch = place.start([
        "branch", "parent@2", "--hold", "--steps", "20000", "--name", "stopped",
    ]);
    while branch.is_alive() && ordeal.events(&place) < 10 {
        std::thread::sleep(Duration::from_millis(1));
    }
    branch.signal(Signal::INT);
    let outcome = branch.wait().ended_with(130);
    assert!(outcome.err.contains("resume stopped"), "{}", outcome.err);
}

#[test]
fn a_complete_run_is_left_as_it_is() {
    let place = Workplace::new();
    SMOOTH.on(&place, 1, |ordeal| {
        ordeal.arrive(&place);
        ordeal.arrive(&place);
    });
    SMOOTH.assert_same_as_calm(&place);
}

#[test]
fn a_second_process_that_wants_the_store_alone_is_refused_and_told_who_holds_it() {
    let place = Workplace::new();
    SMOOTH.on(&place, 1, |ordeal| {
        let mut first = ordeal.session(&place);
        while first.is_alive() && ordeal.events(&place) < 4 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let input = ordeal.input.to_str().unwrap();
        for second in [
            &["resume", SMOOTH.run][..],
            &["submit", input, "--name", "other", "--alone"],
            &["prune", SMOOTH.run, "--keep-last", "1"],
        ] {
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
    SMOOTH.assert_same_as_calm(&place);
    assert_eq!(history::of(&place.store(), "other"), None);
}
