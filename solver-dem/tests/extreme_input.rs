//! A Newton iterate gone wild must come back as a typed error or as an equilibrium, in bounded time:
//! never as a panic, a NaN stress or an endless solve.

mod common;

use std::sync::Arc;

use common::{COHESIVE, SHEARED, SMALL, UNIT, distance, relative, stress_control};
use solver_dem::{
    Cell, Component, Control, EquilibriumError, Grains, LossOfConfinement, Method, Response, Rev,
    RevState, Settings, Start, Trust, drive, respond,
    tensor::{Tensor2, apply, product, rotated2, rotated4, rotation},
};

fn settings() -> Settings {
    Settings {
        path_cap: 20_000,
        ..Settings::default()
    }
}

fn allowing_voids() -> Settings {
    Settings {
        loss_of_confinement: LossOfConfinement::Allow,
        ..settings()
    }
}

/// Return mapping, then three ramps of the path solver, each as long as the cap, and as many cycles to settle.
const MOST_CYCLES: u32 = 4000 + 3 * 2 * 20_000 + 100;

fn assert_sound(outcome: Result<Response, EquilibriumError>) -> Option<Response> {
    match outcome {
        Ok(response) => {
            let report = response.report;
            assert!(report.residual <= 1e-4);
            assert!(report.cycles <= MOST_CYCLES);
            assert!(response.stress.iter().flatten().all(|x| x.is_finite()));
            let mut all = response.tangent.iter().flatten().flatten().flatten();
            assert!(all.all(|x| x.is_finite()));
            let mut positions = response.state.positions.iter().flatten();
            assert!(positions.all(|x| x.is_finite()));
            assert_eq!(
                report.contacts as usize,
                overlapping_pairs(&SMALL.grains.radii, &response.state)
            );
            Some(response)
        }
        Err(error) => {
            // A failure without a figure cannot be acted on.
            let cycles = match &error {
                EquilibriumError::NotReached { cycles, .. }
                | EquilibriumError::CellTooSmall { cycles, .. }
                | EquilibriumError::ConfinementLost { cycles, .. } => *cycles,
                other => panic!("{other} for a sound REV"),
            };
            assert!(cycles <= MOST_CYCLES);
            assert!(error.to_string().contains(|c: char| c.is_ascii_digit()));
            None
        }
    }
}

/// Counted without any list: a contact that the list misses pushes nobody, and no residual tells.
fn overlapping_pairs(radii: &[f64], state: &RevState<2, 1>) -> usize {
    let mut found = 0;
    for (j, b) in state.positions.iter().enumerate() {
        for (i, a) in state.positions[..j].iter().enumerate() {
            let d = [b[0] - a[0], b[1] - a[1]];
            let s = apply(&state.cell.inverse().unwrap(), &d);
            let touches = (0..9).any(|k| {
                let shift = [
                    f64::from(k % 3 - 1) - s[0].round(),
                    f64::from(k / 3 - 1) - s[1].round(),
                ];
                let image = state.cell.translation(&shift);
                (d[0] + image[0]).hypot(d[1] + image[1]) < radii[i] + radii[j]
            });
            found += usize::from(touches);
        }
    }
    found
}

#[test]
fn what_is_no_motion_is_refused_at_once() {
    for f in [
        [[f64::NAN, 0.0], [0.0, 1.0]],
        [[1.0, f64::INFINITY], [0.0, 1.0]],
        [[0.0, 0.0], [0.0, 1.0]],
        [[-1.0, 0.0], [0.0, 1.0]],
        [[1.0, 1.0], [1.0, 1.0]],
        [[f64::MAX, 0.0], [0.0, f64::MAX]],
    ] {
        let error = respond(&SMALL, None, &f, &settings()).unwrap_err();
        assert!(
            matches!(error, EquilibriumError::NotAMotion { .. }),
            "{f:?}: {error}"
        );
    }
}

#[test]
fn an_unusable_state_is_refused() {
    let spoil: [fn(&mut Rev<2, 1>); 8] = [
        |rev| rev.state.positions[3][1] = f64::NAN,
        |rev| rev.state.positions.truncate(50),
        |rev| rev.state.cell.h = [[1.0, 1.0], [1.0, 1.0]],
        |rev| rev.state.cell.h[0][0] = f64::NAN,
        |rev| rev.state.contacts[0].j = 4000,
        |rev| rev.state.contacts[0].tangential[0] = f64::NAN,
        |rev| rev.law.friction = f64::NAN,
        |rev| rev.law.normal_stiffness = 0.0,
    ];
    for (k, spoil) in spoil.iter().enumerate() {
        let mut rev = SMALL.clone();
        spoil(&mut rev);
        let error = respond(&rev, None, &UNIT, &settings()).unwrap_err();
        assert!(
            matches!(error, EquilibriumError::InvalidState(_)),
            "case {k}: {error}"
        );
    }
}

/// Two grains at one place have no contact normal. The NaN that follows closes no contact and so loads no
/// grain: no unbalanced force tells of it.
#[test]
fn a_grain_that_is_nowhere_is_no_equilibrium() {
    let touched = |grain: u32| {
        let mut contacts = SMALL.state.contacts.iter();
        contacts.any(|c| c.i == grain || c.j == grain)
    };
    let loose: Vec<usize> = (0..100).filter(|k| !touched(*k as u32)).collect();
    for [one, other] in [[0, 1], [loose[0], loose[1]]] {
        let mut rev = SMALL.clone();
        rev.state.positions[other] = rev.state.positions[one];
        let outcome = respond(&rev, None, &UNIT, &settings());
        assert!(outcome.is_err(), "{one} on {other}");
    }
}

#[test]
fn large_increments_end_in_equilibrium_or_in_an_error() {
    let half = 0.5f64.sqrt();
    let increments: [Tensor2<2>; 11] = [
        [[1.0, 0.0], [0.0, 0.95]],
        [[1.05, 0.0], [0.0, 0.95]],
        // 50 % of the volume in, and out.
        [[half, 0.0], [0.0, half]],
        [[1.5 * half, 0.0], [0.0, 2.0 * half]],
        [[1.0, 0.3], [0.0, 1.0]],
        [[1.0, 3.0], [0.0, 1.0]],
        [[1.05, 0.0], [0.0, 0.95]],
        [[0.5, 0.0], [0.0, 1.0]],
        [[1e100, 0.0], [0.0, 1e100]],
        [[1.0, 0.0], [0.0, 1e-3]],
        [[1e-8, 0.0], [0.0, 1e-8]],
    ];
    for rev in [&*SMALL, &*COHESIVE] {
        let answered: Vec<bool> = increments
            .iter()
            .map(|f| assert_sound(respond(rev, None, f, &allowing_voids())).is_some())
            .collect();
        // 5 % in one go is within reach, with and without change of volume, and so is half the volume; a flat
        // cell never is. Torn clusters of bonded grains may creep for ever.
        assert!(answered[..3].iter().all(|answer| *answer), "{answered:?}");
        assert!(answered[9..].iter().all(|answer| !answer), "{answered:?}");
    }
}

/// Ramped component by component, a half turn would squash the cell to nothing on the way; and a contact that turns past
/// the cut of the arc tangent would count a whole turn of slip.
#[test]
fn a_rotation_of_any_angle_is_no_deformation() {
    let path_only = Settings {
        return_mapping_cap: 0,
        ..settings()
    };
    let stretch = [[1.0 + 1e-4, 1e-4], [1e-4, 1.0 - 2e-4]];
    for settings in [settings(), path_only] {
        let plain = respond(&SHEARED, None, &stretch, &settings).unwrap();
        for degrees in [5.0f64, 90.0, 179.999, 180.0, -180.0, -135.0] {
            let r = rotation(degrees.to_radians());
            let turned = respond(&SHEARED, None, &product(&r, &stretch), &settings).unwrap();
            let apart = distance(&turned.stress, &rotated2(&r, &plain.stress));
            // The residual allows as much.
            assert!(apart < 1e-4, "{degrees}°: {apart:e}");
            assert!(relative(&turned.tangent, &rotated4(&r, &plain.tangent)) < 1e-2);
        }
    }
    // 5 % on top of a half turn: as large an increment as is answered without it.
    let f = [[-1.05, 0.0], [0.0, -0.95]];
    assert!(assert_sound(respond(&SMALL, None, &f, &settings())).is_some());
}

/// A REV pulled apart carries nothing. Taken for a solution where nobody asked for it, a hole in the material goes
/// unnoticed.
#[test]
fn a_rev_that_loses_all_contacts_fails_unless_that_is_allowed() {
    let apart = [[1.2, 0.0], [0.0, 1.2]];
    match respond(&SHEARED, None, &apart, &settings()) {
        Err(EquilibriumError::ConfinementLost {
            volume_change,
            contacts,
            cycles,
        }) => {
            assert!((volume_change - 1.44).abs() < 1e-9);
            assert_eq!(contacts, SHEARED.state.contacts.len());
            assert!(cycles > 0);
        }
        other => panic!("{other:?}"),
    }
    let response = respond(&SHEARED, None, &apart, &allowing_voids()).unwrap();
    assert_eq!(response.report.contacts, 0);
    // Grains thrown apart by one violent cycle look the same: only the slow path may say so.
    assert_eq!(response.report.method, Method::Path);
    assert_eq!(response.stress, [[0.0; 2]; 2]);
    assert_eq!(response.tangent, [[[[0.0; 2]; 2]; 2]; 2]);
    // It stays a void under further motion, and comes back when it is pushed together again.
    let mut void = SHEARED.clone();
    void.state = response.state;
    let further = respond(&void, None, &[[1.0, 0.01], [0.0, 1.01]], &allowing_voids()).unwrap();
    assert_eq!(further.stress, [[0.0; 2]; 2]);
    assert!(matches!(
        respond(&void, None, &UNIT, &settings()),
        Err(EquilibriumError::ConfinementLost { contacts: 0, .. })
    ));
    let back = [[1.0 / 1.2, 0.0], [0.0, 1.0 / 1.2]];
    let response = assert_sound(respond(&void, None, &back, &settings())).unwrap();
    assert!(response.stress[0][0] < -1e-3);
}

/// Bonded pairs and clusters stay behind, whose forces and stress cancel: measured against themselves they would never
/// be in equilibrium.
#[test]
fn a_cohesive_rev_pulled_apart_comes_to_rest_without_stress() {
    for stretch in [1.2, 3.0] {
        let f = [[stretch, 0.0], [0.0, stretch]];
        let response = assert_sound(respond(&COHESIVE, None, &f, &settings())).unwrap();
        assert!(response.report.contacts > 0);
        // The bonds stand for a stress of 1.
        assert!(distance(&response.stress, &[[0.0; 2]; 2]) < 0.2 / stretch);
    }
}

#[test]
fn no_stress_at_all_is_a_stress_that_can_be_asked_for() {
    let zero = stress_control(0.0, 0.0);
    let response = drive(&COHESIVE, &UNIT, &zero, Method::ReturnMapping, &settings());
    let response = assert_sound(response).unwrap();
    assert!(response.stress[0][0].abs() < 1e-4 && response.stress[1][1].abs() < 1e-4);
    let lost = drive(&SMALL, &UNIT, &zero, Method::ReturnMapping, &settings()).unwrap_err();
    assert!(
        matches!(lost, EquilibriumError::ConfinementLost { .. }),
        "{lost}"
    );
    let void = drive(
        &SMALL,
        &UNIT,
        &zero,
        Method::ReturnMapping,
        &allowing_voids(),
    );
    assert_eq!(void.unwrap().report.contacts, 0);
}

/// No strain can carry a tension that grains without cohesion do not have.
#[test]
fn a_stress_out_of_reach_is_an_error() {
    for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1e7, -1e7), (-1.0, -1e4)] {
        for settings in [settings(), allowing_voids()] {
            let control = stress_control(x, y);
            let outcome = drive(&SMALL, &UNIT, &control, Method::ReturnMapping, &settings);
            assert!(assert_sound(outcome).is_none(), "{x}, {y}");
        }
    }
    let nan = stress_control(f64::NAN, 0.0);
    let error = drive(&SMALL, &UNIT, &nan, Method::ReturnMapping, &settings()).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::InvalidState(_)),
        "{error}"
    );
}

/// A grain meets its own image where the cell is not two cut-offs high.
#[test]
fn a_cell_too_small_for_its_grains_is_refused_with_both_lengths() {
    let tiny = Rev {
        grains: Arc::new(Grains {
            radii: vec![0.5; 2],
        }),
        law: SMALL.law,
        state: RevState {
            cell: Cell::rectangular([1.9, 1.0]),
            positions: vec![[0.0, 0.0], [0.95, 0.0]],
            contacts: Vec::new(),
        },
    };
    match respond(&tiny, None, &UNIT, &settings()) {
        Err(EquilibriumError::CellTooSmall { height, needed, .. }) => {
            assert!((height - 1.0).abs() < 1e-12 && needed > 2.0);
        }
        other => panic!("{other:?}"),
    }
}

/// Metres and pascals, or microns and kilobars: lengths and forces of any size mean the same.
#[test]
fn units_do_not_matter() {
    let f = [[1.0 + 1e-4, 2e-4], [0.0, 1.0 - 5e-4]];
    let plain = respond(&SHEARED, None, &f, &settings()).unwrap();
    for (length, force) in [(1e-6, 1e9), (1e7, 1e-8)] {
        let mut rev = SHEARED.clone();
        let radii = rev.grains.radii.iter().map(|r| r * length).collect();
        rev.grains = Arc::new(Grains { radii });
        rev.law.normal_stiffness *= force / length;
        rev.law.tangential_stiffness *= force / length;
        for value in rev.state.cell.h.iter_mut().flatten() {
            *value *= length;
        }
        for value in rev.state.positions.iter_mut().flatten() {
            *value *= length;
        }
        for contact in &mut rev.state.contacts {
            contact.tangential[0] *= force;
        }
        let answer = respond(&rev, None, &f, &settings()).unwrap();
        let back = answer.stress.map(|row| row.map(|s| s * length / force));
        let apart = distance(&back, &plain.stress);
        assert!(apart < 1e-4, "{length:e}, {force:e}: {apart:e}");
    }
}

/// A start only saves cycles: nonsense in it may not reach the answer.
#[test]
fn a_start_that_is_no_configuration_is_survived() {
    let f = [[1.0, 0.0], [0.0, 1.0 - 1e-4]];
    let cold = respond(&SMALL, None, &f, &settings()).unwrap();
    let spoil: [fn(&mut RevState<2, 1>, &mut Vec<f64>); 4] = [
        |state, _| state.positions[7][0] = f64::NAN,
        |state, _| state.positions[7][0] = 1e300,
        |state, _| state.cell.h = [[f64::NAN; 2]; 2],
        |_, rotations| rotations[7] = f64::NAN,
    ];
    for (k, spoil) in spoil.iter().enumerate() {
        let (mut state, mut rotations) = (SMALL.state.clone(), vec![0.0; 100]);
        spoil(&mut state, &mut rotations);
        let start = Start {
            state: &state,
            rotations: &rotations,
            trust: Trust::Guess,
        };
        let answer = assert_sound(respond(&SMALL, Some(start), &f, &settings())).unwrap();
        let apart = distance(&answer.stress, &cold.stress);
        assert!(apart < 1e-2, "case {k}: {apart:e}");
    }
}

#[test]
fn settings_without_sense_do_not_hang_or_lie() {
    for odd in [
        Settings {
            ramp_rate: 0.0,
            ..settings()
        },
        Settings {
            ramp_rate: f64::NAN,
            ..settings()
        },
        Settings {
            tolerance: f64::NAN,
            ..settings()
        },
        Settings {
            return_mapping_cap: 0,
            path_cap: 0,
            ..settings()
        },
        Settings {
            ramp_min_cycles: 0,
            ramp_rate: f64::INFINITY,
            ..settings()
        },
    ] {
        let f = [[1.0, 0.0], [0.0, 1.0 - 1e-4]];
        for method in [Method::ReturnMapping, Method::Path] {
            let components = f.map(|row| row.map(Component::Gradient));
            if let Some(response) =
                assert_sound(drive(&SMALL, &UNIT, &Control { components }, method, &odd))
            {
                assert_eq!(response.gradient, f);
                let height = response.state.cell.h[1][1] / SMALL.state.cell.h[1][1];
                assert!((height - (1.0 - 1e-4)).abs() < 1e-9, "{odd:?}");
            }
        }
    }
}

/// A grain that touches nothing is not accelerated by anything: one that keeps the speed of its last
/// collision crosses the cell, wears out the pair list and returns as noise.
#[test]
fn rattlers_do_not_fly() {
    let mut rev = SMALL.clone();
    for _ in 0..5 {
        let f = [[1.0 + 3e-4, 0.0], [0.0, 1.0 - 1e-3]];
        let response = respond(&rev, None, &f, &Settings::default()).unwrap();
        for (x, old) in response.state.positions.iter().zip(&rev.state.positions) {
            let affine = [f[0][0] * old[0], f[1][1] * old[1]];
            let apart = (x[0] - affine[0]).hypot(x[1] - affine[1]);
            assert!(apart < 0.1, "a grain moved by {apart} in a step of 1e-3");
        }
        rev.state = response.state;
    }
}
