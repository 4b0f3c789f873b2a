//! What a kill leaves behind is not always tidy, and a machine may stand still for a while. Neither may cost more work
//! than was in progress, nor change a digit.

use std::fs;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;
use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::workplace::{Signal, Workplace};

const RUN: &str = "small";

fn with<T>(place: &Workplace, input: &str, act: impl FnOnce(Ordeal<'_>) -> T) -> T {
    let input = place.write("input.yaml", input);
    act(Ordeal {
        input: &input,
        run: RUN,
        threads: 2,
    })
}

fn calm(input: &str) -> Option<History> {
    let place = Workplace::new();
    with(&place, input, |ordeal| ordeal.arrive(&place));
    history::of(&place.store(), RUN)
}

/// The journals of the running step's waves, ascending.
fn journals(place: &Workplace) -> Vec<PathBuf> {
    let folder = place.store().join("packs").join(RUN);
    let mut found: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "part")
        })
        .collect();
    found.sort();
    found
}

/// The lines of the event log.
fn events(place: &Workplace) -> Vec<Value> {
    let log = place.store().join("packs").join(RUN).join("events.jsonl");
    let text = fs::read_to_string(log).unwrap();
    text.lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect()
}

#[test]
fn a_wave_whose_beginning_was_torn_does_not_cost_the_waves_before_it() {
    let input = inputs::biaxial(RUN, 60, 2);
    let place = Workplace::new();
    with(&place, &input, |ordeal| {
        let mut torn = None;
        for _ in 0..30 {
            let blow = Blow {
                events: 6,
                then: Duration::ZERO,
                signal: Signal::KILL,
            };
            ordeal.hit(&place, blow);
            if let [.., before, newest] = &journals(&place)[..] {
                torn = Some((before.clone(), newest.clone()));
                break;
            }
        }
        let (before, newest) = torn.expect("a kill fell into a later wave");
        let bytes = fs::read(&newest).unwrap();
        fs::write(&newest, &bytes[..100]).unwrap();
        let known = events(&place).len();
        ordeal.arrive(&place);
        let after = &events(&place)[known..];
        let wave = after.iter().find(|event| event["event"] == "wave_started");
        let wave = &wave.unwrap()["data"];
        let name = before.file_stem().unwrap().to_str().unwrap();
        assert!(
            name.ends_with(&format!("wave{:06}", wave["wave"].as_u64().unwrap())),
            "it went on with {wave}, {name} was whole"
        );
        assert_eq!(wave["done"], wave["tasks"]);
    });
    assert_eq!(history::of(&place.store(), RUN), calm(&input));
}

/// How often the event log says `event`.
fn count(place: &Workplace, event: &str) -> usize {
    let log = place.store().join("packs").join(RUN).join("events.jsonl");
    let text = fs::read_to_string(log).unwrap_or_default();
    text.matches(&format!("\"event\":\"{event}\"")).count()
}

/// A terminal's Ctrl-Z, a laptop's lid, a queue that suspends: the tasks then run past their limit.
#[test]
fn a_machine_that_stood_still_does_not_cut_a_step() {
    let solver = "solver: { task_time_limit: 1.0, task_retries: 0 }";
    let input = format!("{}{solver}\n", inputs::biaxial(RUN, 400, 2));
    for _ in 0..4 {
        let place = Workplace::new();
        let hit = with(&place, &input, |ordeal| {
            let (mut hit, mut pauses) = (0, 0);
            loop {
                let mut session = ordeal.session(&place);
                // A task that is almost done when the machine goes on may still beat the clock: then once more.
                while session.is_alive() && hit == 0 && pauses < 12 {
                    let before = count(&place, "wave_started");
                    while session.is_alive() && count(&place, "wave_started") == before {
                        sleep(Duration::from_micros(500));
                    }
                    session.signal(Signal::STOP);
                    // Longer than the limit and what the engine waits beyond it.
                    sleep(Duration::from_millis(1700));
                    session.signal(Signal::CONT);
                    pauses += 1;
                }
                let outcome = session.wait();
                if outcome.code == Some(0) {
                    return hit;
                }
                assert!(outcome.err.contains("time limit"), "{outcome:?}");
                hit += 1;
            }
        });
        assert_eq!(count(&place, "step_cut"), 0);
        if hit > 0 {
            assert_eq!(history::of(&place.store(), RUN), calm(&input));
            return;
        }
    }
    panic!("no task was hit: the test shows nothing");
}
