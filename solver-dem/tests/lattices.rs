//! Lattices of equal discs have closed-form stiffnesses: an error in the stress, the branch
//! vectors, the cell algebra or the tangent cannot hide behind a disordered packing.

mod common;

use std::sync::Arc;

use common::UNIT;
use solver_dem::{Cell, ContactLaw, Grains, Rev, RevState, Settings, respond, tensor::Tensor2};

const KN: f64 = 1000.0;
const KT: f64 = 400.0;
const SIDE: usize = 6;

/// An overlap of 1e-6 diameters knows its forces to about 1e-9 only.
fn tight() -> Settings {
    Settings {
        tolerance: 1e-7,
        ..common::tight()
    }
}

/// SIDE² discs of diameter 1 on the lattice of the columns of `step`.
fn lattice(step: Tensor2<2>) -> Rev<2, 1> {
    let mut positions = Vec::new();
    for a in 0..SIDE {
        for b in 0..SIDE {
            let (a, b) = (a as f64, b as f64);
            positions.push([
                step[0][0] * a + step[0][1] * b,
                step[1][0] * a + step[1][1] * b,
            ]);
        }
    }
    Rev {
        grains: Arc::new(Grains {
            radii: vec![0.5; SIDE * SIDE],
        }),
        law: ContactLaw {
            normal_stiffness: KN,
            tangential_stiffness: KT,
            friction: 0.5,
            cohesion: 0.0,
        },
        state: RevState {
            cell: Cell {
                h: step.map(|row| row.map(|c| c * SIDE as f64)),
            },
            positions,
            contacts: Vec::new(),
        },
    }
}

fn triangular(distance: f64) -> Rev<2, 1> {
    lattice([[distance, 0.5 * distance], [0.0, 0.75f64.sqrt() * distance]])
}

#[test]
fn triangular_lattice_has_the_textbook_stiffness_and_pressure() {
    let overlap = 5e-7;
    let response = respond(&triangular(1.0 - overlap), None, &UNIT, &tight()).unwrap();
    let quarter = 3f64.sqrt() / 4.0;
    for c in [&response.tangent, &response.elastic_tangent] {
        for (value, exact) in [
            (c[0][0][0][0], quarter * (3.0 * KN + KT)),
            (c[1][1][1][1], quarter * (3.0 * KN + KT)),
            (c[0][0][1][1], quarter * (KN - KT)),
            (c[1][1][0][0], quarter * (KN - KT)),
            (c[0][1][0][1], quarter * (KN + KT)),
            (c[0][1][1][0], quarter * (KN + KT)),
            (c[0][0][0][1], 0.0),
            (c[0][1][1][1], 0.0),
        ] {
            assert!((value - exact).abs() < 2e-6 * KN, "{value} for {exact}");
        }
    }
    let pressure = 3f64.sqrt() * KN * overlap / (1.0 - overlap);
    for k in 0..2 {
        assert!((response.stress[k][k] / -pressure - 1.0).abs() < 1e-6);
    }
    assert_eq!(response.report.contacts as usize, 3 * SIDE * SIDE);
}

#[test]
fn square_lattice_has_no_lateral_stiffness_and_half_kt_in_shear() {
    let step = 1.0 - 1e-6;
    let response = respond(&lattice([[step, 0.0], [0.0, step]]), None, &UNIT, &tight()).unwrap();
    let c = &response.tangent;
    for (value, exact) in [
        (c[0][0][0][0], KN),
        (c[1][1][1][1], KN),
        (c[0][0][1][1], 0.0),
        (c[0][1][0][1], KT / 2.0),
        (c[0][1][1][0], KT / 2.0),
    ] {
        assert!((value - exact).abs() < 2e-6 * KN, "{value} for {exact}");
    }
}

/// H ← F·H and H ← H·F agree on a square cell. The cell of a triangular lattice is sheared: with the wrong
/// order images land beside their grains and the stress is that of another material.
#[test]
fn deformation_multiplies_the_cell_from_the_left() {
    let base = triangular(1.0 - 1e-4);
    let f = [[1.0 + 4e-6, -2e-5], [1e-6, 1.0 - 5e-6]];
    let response = respond(&base, None, &f, &tight()).unwrap();
    let reference = respond(&base, None, &UNIT, &tight()).unwrap();
    let mut expected = reference.stress;
    for i in 0..2 {
        for j in 0..2 {
            for k in 0..2 {
                for l in 0..2 {
                    let unit = f64::from(u8::from(k == l));
                    expected[i][j] += reference.tangent[i][j][k][l] * (f[k][l] - unit);
                }
            }
        }
    }
    // The increment of the stress is 1e-2; what is left is of second order in F − 1.
    assert!(common::distance(&response.stress, &reference.stress) > 5e-3);
    assert!(common::distance(&response.stress, &expected) < 2e-6);
    for i in 0..2 {
        for j in 0..2 {
            let h = (0..2)
                .map(|k| f[i][k] * base.state.cell.h[k][j])
                .sum::<f64>();
            assert!((response.state.cell.h[i][j] - h).abs() < 1e-12);
        }
    }
}

/// Every contact of a sheared square lattice slips at once: there is no other path for the force to take.
#[test]
fn friction_saturates_at_mu_kn_overlap() {
    let overlap = 1e-4;
    let base = lattice([[1.0 - overlap, 0.0], [0.0, 1.0 - overlap]]);
    let bound = 0.5 * KN * overlap;
    // Pure shear by γ slides each contact by γ/2 of a diameter.
    let sheared = |gamma: f64| {
        let f = [[1.0, 0.5 * gamma], [0.5 * gamma, 1.0]];
        respond(&base, None, &f, &tight()).unwrap()
    };
    let at_bound = 2.0 * bound / KT;
    let [before, after] = [0.5, 1.5].map(|part| sheared(part * at_bound));
    for contact in &before.state.contacts {
        assert!((contact.tangential[0].abs() / bound - 0.5).abs() < 1e-3);
    }
    assert_eq!(before.report.sliding, 0);
    for contact in &after.state.contacts {
        assert!((contact.tangential[0].abs() / bound - 1.0).abs() < 1e-3);
    }
    assert_eq!(after.report.sliding, after.report.contacts);
    assert!((after.stress[0][1] / bound - 1.0).abs() < 2e-3);
}

/// f_n = kn δ − f_c vanishes at δ = f_c/kn, wherever the pair starts, and friction is bounded by the elastic part alone.
#[test]
fn two_cohesive_grains_rest_at_the_overlap_that_balances_the_bond() {
    for start in [1e-3, 4e-3] {
        let pair = Rev {
            grains: Arc::new(Grains {
                radii: vec![0.5, 0.4],
            }),
            law: ContactLaw {
                normal_stiffness: KN,
                tangential_stiffness: KT,
                friction: 0.5,
                cohesion: 3.0,
            },
            state: RevState {
                cell: Cell::rectangular([6.0, 6.0]),
                positions: vec![[5.9, 1.0], [0.8 - start, 1.0]],
                contacts: Vec::new(),
            },
        };
        let response = respond(&pair, None, &UNIT, &Settings::default()).unwrap();
        let [a, b] = [response.state.positions[0], response.state.positions[1]];
        let overlap = 0.9 - (b[0] + 6.0 - a[0]).hypot(b[1] - a[1]);
        assert!((overlap / (3.0 / KN) - 1.0).abs() < 1e-3, "{overlap}");
        assert_eq!(response.report.contacts, 1);
        assert!(common::distance(&response.stress, &[[0.0; 2]; 2]) < 1e-4);
    }
}
