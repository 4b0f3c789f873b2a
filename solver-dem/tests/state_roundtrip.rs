//! A run that is killed and resumed goes on from serialised states: they must carry every bit that the next
//! increment reads, and stay small, since every step stores one per Gauss point.

mod common;

use common::{SHEARED, SMALL, biaxial_step, distance, imported, recipe, tight};
use solver_dem::{Recipe, Rev, RevState, Settings, Start, Trust, prepare, respond};

fn bits(state: &RevState<2, 1>) -> Vec<u64> {
    let mut bits: Vec<u64> = state.cell.h.iter().flatten().map(|x| x.to_bits()).collect();
    bits.extend(state.positions.iter().flatten().map(|x| x.to_bits()));
    for contact in &state.contacts {
        bits.push(u64::from(contact.i) << 32 | u64::from(contact.j));
        bits.push(contact.tangential[0].to_bits());
    }
    bits
}

#[test]
fn a_state_read_back_goes_on_with_the_same_bits() {
    let bytes = rmp_serde::to_vec(&*SHEARED).unwrap();
    let back: Rev<2, 1> = rmp_serde::from_slice(&bytes).unwrap();
    assert_eq!(bits(&back.state), bits(&SHEARED.state));
    let f = [[1.0 + 1e-4, 2e-4], [0.0, 1.0 - 5e-4]];
    let a = respond(&SHEARED, None, &f, &Settings::default()).unwrap();
    let b = respond(&back, None, &f, &Settings::default()).unwrap();
    assert_eq!(bits(&a.state), bits(&b.state));
    assert_eq!(a, b);
}

#[test]
fn a_torn_state_is_refused() {
    let bytes = rmp_serde::to_vec(&SMALL.state).unwrap();
    for length in [0, 1, bytes.len() / 2, bytes.len() - 1] {
        assert!(rmp_serde::from_slice::<RevState<2, 1>>(&bytes[..length]).is_err());
    }
}

/// Dense and bonded, in the densest state of a loading cycle: as many contacts as a REV of 400 grains gets.
#[test]
fn a_state_of_400_grains_stays_under_16_kilobytes() {
    let bonded = Recipe {
        cohesion_ratio: 1.0,
        ..recipe(400, 1)
    };
    for mut rev in [imported(), prepare(&bonded).unwrap().0] {
        let mut largest = 0;
        for _ in 0..10 {
            rev.state = biaxial_step(&rev, 1e-3, &Settings::default()).state;
            largest = largest.max(rmp_serde::to_vec(&rev.state).unwrap().len());
        }
        assert!(largest <= 16_000, "{largest} bytes");
    }
}

/// Killed after any increment, a run takes up the state it wrote and nothing else.
#[test]
fn a_path_interrupted_at_every_increment_keeps_its_bits() {
    let mut through = SMALL.clone();
    let mut interrupted = SMALL.clone();
    for k in 0..12 {
        // Loading, unloading, and a turn, so that every kind of history is carried along.
        let axial = if k % 4 == 3 { 2e-4 } else { -5e-4 };
        let f = [[1.0 + 1e-4, -2e-4], [3e-4, 1.0 + axial]];
        through.state = respond(&through, None, &f, &Settings::default())
            .unwrap()
            .state;
        let bytes = rmp_serde::to_vec(&interrupted).unwrap();
        let back: Rev<2, 1> = rmp_serde::from_slice(&bytes).unwrap();
        interrupted.state = respond(&back, None, &f, &Settings::default())
            .unwrap()
            .state;
        assert_eq!(
            bits(&interrupted.state),
            bits(&through.state),
            "increment {k}"
        );
    }
}

#[test]
fn a_warm_start_changes_the_cost_but_not_the_answer() {
    let f = [[1.0 + 1e-4, 0.0], [0.0, 1.0 - 3e-4]];
    let near = [[1.0 + 1.05e-4, 2e-6], [0.0, 1.0 - 3.02e-4]];
    let first = respond(&SMALL, None, &f, &tight()).unwrap();
    let start = Start {
        state: &first.state,
        rotations: &first.rotations,
        trust: Trust::Guess,
    };
    let cold = respond(&SMALL, None, &near, &tight()).unwrap();
    let warm = respond(&SMALL, Some(start), &near, &tight()).unwrap();
    let apart = distance(&cold.stress, &warm.stress);
    assert!(apart < 1e-4, "{apart:e}");
    assert!(warm.report.cycles < cold.report.cycles);
    // The same F again needs no motion.
    let again = respond(&SMALL, Some(start), &f, &tight()).unwrap();
    assert!(again.report.cycles <= 100, "{}", again.report.cycles);
    assert!(distance(&again.stress, &first.stress) < 1e-7);
}

#[test]
fn a_start_of_another_packing_is_not_used() {
    let f = [[1.0, 0.0], [0.0, 1.0 - 1e-4]];
    let other = imported();
    let start = Start {
        state: &other.state,
        rotations: &[0.0; 400],
        trust: Trust::Guess,
    };
    let with = respond(&SMALL, Some(start), &f, &Settings::default()).unwrap();
    let without = respond(&SMALL, None, &f, &Settings::default()).unwrap();
    assert_eq!(with, without);
}

/// Grains that changed places are in perfect equilibrium there, at seven times the stress.
#[test]
fn a_start_gone_astray_does_not_change_the_answer() {
    let f = [[1.0, 0.0], [0.0, 1.0 - 1e-4]];
    let settings = Settings::default();
    let mut state = SMALL.state.clone();
    state.positions.swap(0, 99);
    let start = Start {
        state: &state,
        rotations: &[0.0; 100],
        trust: Trust::Guess,
    };
    let astray = respond(&SMALL, Some(start), &f, &settings).unwrap();
    let cold = respond(&SMALL, None, &f, &settings).unwrap();
    let apart = distance(&astray.stress, &cold.stress);
    assert!(apart < 1e-2, "{apart:e} with {:?}", astray.report.method);
}
