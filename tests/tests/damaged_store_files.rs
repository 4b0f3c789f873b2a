//! Disks flip bits and file systems lose tails. A result computed on from a damaged state looks like any other, so
//! damage must end in one of two ways: repaired, with the digest that the undamaged run has, or refused in words that
//! name the file. Never in a panic, and never in another digest.
//!
//! Every kind of file of a real store is damaged in turn, and the program is asked to check, show and resume.

use std::fs;
use std::path::{Path, PathBuf};

use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::random::Random;
use tests::workplace::{Outcome, Signal, Workplace};

const RUN: &str = "small";

fn input() -> String {
    inputs::biaxial(RUN, 30, 4)
}

/// A store whose run was stopped half way, and what it would have become.
fn half_way() -> (Workplace, History) {
    let whole = Workplace::new();
    let file = whole.write("small.yaml", &input());
    let ordeal = Ordeal {
        input: &file,
        run: RUN,
        threads: 2,
    };
    ordeal.arrive(&whole);
    let events = ordeal.events(&whole);
    let calm = history::of(&whole.store(), RUN).unwrap();

    let half = Workplace::new();
    let file = half.write("small.yaml", &input());
    let ordeal = Ordeal {
        input: &file,
        run: RUN,
        threads: 2,
    };
    let blow = Blow {
        events: events / 2,
        then: Default::default(),
        signal: Signal::KILL,
    };
    assert_eq!(
        ordeal.hit(&half, blow).signal,
        Some(9),
        "the run ended too soon"
    );
    (half, calm)
}

fn files_below(folder: &Path, into: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files_below(&path, into);
        } else {
            into.push(path);
        }
    }
}

fn copy(from: &Path, to: &Path) {
    let mut files = Vec::new();
    files_below(from, &mut files);
    for file in files {
        let target = to.join(file.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(file, target).unwrap();
    }
}

/// Cuts the file, flips one bit of it, overwrites a part or removes it; says which.
fn damage(file: &Path, random: &mut Random) -> String {
    let mut bytes = fs::read(file).unwrap();
    let at = random.below(bytes.len() as u64) as usize;
    let what = match random.below(4) {
        0 => {
            bytes.truncate(at);
            format!("cut at {at} of")
        }
        1 => {
            let end = bytes.len().min(at + 64);
            bytes[at..end].iter_mut().for_each(|byte| *byte = !*byte);
            format!("64 bytes garbled at {at} of")
        }
        2 => {
            fs::remove_file(file).unwrap();
            return format!("removed {}", file.display());
        }
        _ => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
            format!("a bit flipped at {at} of")
        }
    };
    fs::write(file, bytes).unwrap();
    format!("{what} {}", file.display())
}

/// A refusal: in words, about the store or the run, naming a file.
fn is_clear(outcome: &Outcome, place: &Workplace) -> bool {
    let store = place.store();
    matches!(outcome.code, Some(1 | 3))
        && outcome.err.contains("Error: ")
        && outcome.err.contains(store.to_str().unwrap())
}

#[test]
fn damage_ends_in_the_same_digests_or_in_a_clear_refusal() {
    let (original, calm) = half_way();
    let mut files = Vec::new();
    files_below(&original.store(), &mut files);
    // Locked, never read.
    files.retain(|file| !file.ends_with("LOCK") && !file.ends_with("NAMES"));
    assert!(files.len() >= 8, "{files:?}");
    let (mut random, mut arrived, mut refused) = (Random::new(5), 0, 0);
    for file in files.iter().chain(&files) {
        let place = Workplace::new();
        copy(&original.store(), &place.store());
        let victim = place
            .store()
            .join(file.strip_prefix(original.store()).unwrap());
        let case = damage(&victim, &mut random);
        let named = place.run(["store", "check", "--deep"]).code != Some(0);
        // Looking at a damaged store must not make it worse.
        for look in [
            &["store", "check", "--deep"][..],
            &["show", RUN],
            &["runs"],
            &["status"],
        ] {
            let outcome = place.run(look.iter().copied());
            assert!(
                matches!(outcome.code, Some(0 | 1 | 3)),
                "{case}: {look:?}: {outcome:#?}"
            );
        }
        let outcome = place.run(["resume", RUN]);
        if outcome.code == Some(0) {
            let end = history::left(&place.store(), RUN).expect("the run is there");
            let mut expected = calm.clone();
            if end.steps.len() < calm.steps.len() {
                // One that lay behind the place where the run went on: no resume had to read it.
                assert!(named, "{case}: a step is gone and nobody said so");
                let kept = |step: &(u32, _)| end.steps.iter().any(|left| left.0 == step.0);
                expected.steps.retain(kept);
                assert_eq!(expected.steps.len() + 1, calm.steps.len(), "{case}");
            }
            assert_eq!(end, expected, "{case}: another result");
            arrived += 1;
        } else {
            assert!(is_clear(&outcome, &place), "{case}: {outcome:#?}");
            refused += 1;
        }
    }
    println!(
        "{} damages: {arrived} runs arrived, {refused} were refused",
        2 * files.len()
    );
    assert!(
        arrived > 0 && refused > 0,
        "arrived {arrived}, refused {refused}"
    );
}

#[test]
fn without_its_database_the_store_is_rebuilt_and_the_run_goes_on() {
    let (place, calm) = half_way();
    fs::remove_dir_all(place.store().join("meta")).unwrap();
    place.run(["resume", RUN]).success();
    assert_eq!(history::of(&place.store(), RUN), Some(calm));
}
