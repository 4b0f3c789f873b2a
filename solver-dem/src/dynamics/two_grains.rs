//! Two bonded grains swing about the overlap that balances the bond, with periods from the textbook: a force that is wrong
//! by a factor, or a moment with the wrong arm, would still come to rest.

use std::{f64::consts::TAU, sync::Arc};

use super::{Assembly, Friction, Record};
use crate::{Cell, ContactLaw, Grains, Rev, RevState};

const KN: f64 = 1000.0;
const KT: f64 = 700.0;
const BOND: f64 = 1e-3;
/// f_c/kn.
const REST: f64 = BOND / KN;

fn pair(overlap: f64) -> Rev<2, 1> {
    Rev {
        grains: Arc::new(Grains {
            radii: vec![0.5; 2],
        }),
        law: ContactLaw {
            normal_stiffness: KN,
            tangential_stiffness: KT,
            friction: 0.5,
            cohesion: BOND,
        },
        state: RevState {
            cell: Cell::rectangular([5.0; 2]),
            positions: vec![[1.0, 1.0], [2.0 - overlap, 1.0]],
            contacts: Vec::new(),
        },
    }
}

/// The mean time between every second passage of `signal` through 0, undamped and with masses of 1 (I = R²/2).
fn period(rev: &Rev<2, 1>, turn: f64, signal: impl Fn(&Assembly<'_>) -> f64) -> f64 {
    let state = &rev.state;
    let mut assembly = Assembly::new(rev, state.cell, state.positions.clone(), vec![turn; 2])
        .expect("the cell is wide enough");
    assembly.make_brisk(0.0);
    assembly.compute_forces(Friction::ReturnMapping, Record::Nothing);
    assembly.set_masses();
    let mut passages = Vec::new();
    let mut last = signal(&assembly);
    for cycle in 0..400 {
        assembly.integrate();
        assembly.compute_forces(Friction::ReturnMapping, Record::Nothing);
        let now = signal(&assembly);
        if last.signum() != now.signum() {
            passages.push(f64::from(cycle) + last / (last - now));
        }
        last = now;
    }
    let halves = passages.len() - 1;
    let cycles = 2.0 * (passages[halves] - passages[0]) / halves as f64;
    cycles * assembly.time_step()
}

/// The period of the leap-frog of step `dt` for the frequency ω: sin(ω' dt/2) = ω dt/2.
fn with_steps(omega: f64, dt: f64) -> f64 {
    TAU * dt / (2.0 * (0.5 * omega * dt).asin())
}

/// T = 2π √(m/(2 kn)).
#[test]
fn normal_swing_has_the_period_of_two_masses_on_a_spring() {
    let rev = pair(1.1 * REST);
    let found = period(&rev, 0.0, |assembly| {
        let x = assembly.positions();
        1.0 - (x[1][0] - x[0][0]) - REST
    });
    let dt = 0.3 / KN.sqrt();
    let exact = with_steps((2.0 * KN).sqrt(), dt);
    assert!((found / exact - 1.0).abs() < 1e-3, "{found} for {exact}");
}

/// T = 2π √(m/(6 kt)): both grains give way and roll.
#[test]
fn tangential_swing_has_the_period_of_two_rolling_discs() {
    let rev = pair(REST);
    // A tenth of what friction bears.
    let turn = 0.1 * 0.5 * BOND / KT;
    // What slips at the contact: the turns alone keep a mean.
    let found = period(&rev, turn, |assembly| {
        let (x, turns) = (assembly.positions(), assembly.rotations());
        x[1][1] - x[0][1] - 0.5 * (turns[0] + turns[1])
    });
    let dt = 0.3 / KN.sqrt();
    let exact = with_steps((6.0 * KT).sqrt(), dt);
    assert!((found / exact - 1.0).abs() < 1e-3, "{found} for {exact}");
}
