//! A Newton iterate gone wild must come back as a typed error or as an equilibrium, in bounded time:
//! never as a panic, a NaN stress or an endless solve.

mod common;

use common::{SHEARED, SMALL, UNIT};
use solver_dem::{
    Component, Control, EquilibriumError, Method, Response, Rev, RevState, Settings, drive,
    respond,
    tensor::{Tensor2, apply},
};

fn settings() -> Settings {
    Settings {
        path_cap: 20_000,
        ..Settings::default()
    }
}

fn assert_sound(outcome: Result<Response, EquilibriumError>) -> Option<Response> {
    match outcome {
        Ok(response) => {
            let report = response.report;
            assert!(report.residual <= 1e-4);
            assert!(report.cycles <= 60_000);
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
            assert!(!error.to_string().is_empty());
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
    let increments: [Tensor2<2>; 6] = [
        [[1.0, 0.0], [0.0, 0.95]],
        [[1.05, 0.0], [0.0, 0.95]],
        [[1.0, 0.3], [0.0, 1.0]],
        [[0.7, 0.0], [0.0, 0.7]],
        [[0.5, 0.0], [0.0, 1.0]],
        [[1.0, 0.0], [0.0, 1e-3]],
    ];
    let answered: Vec<bool> = increments
        .iter()
        .map(|f| assert_sound(respond(&SMALL, None, f, &settings())).is_some())
        .collect();
    // 5 % in one go is within reach, with and without change of volume; a flat cell never is.
    assert_eq!((answered[0], answered[1], answered[5]), (true, true, false));
}

/// A REV pulled apart carries nothing: that is an equilibrium, with zero stress and zero tangents.
#[test]
fn a_rev_that_loses_all_contacts_answers_with_zero() {
    let response = respond(&SHEARED, None, &[[1.2, 0.0], [0.0, 1.2]], &settings()).unwrap();
    assert_eq!(response.report.contacts, 0);
    // Grains thrown apart by one violent cycle look the same: only the slow path may say so.
    assert_eq!(response.report.method, Method::Path);
    assert_eq!(response.stress, [[0.0; 2]; 2]);
    assert!(response.report.affine_tangent);
    assert_eq!(response.tangent, [[[[0.0; 2]; 2]; 2]; 2]);
    // And comes back when it is pushed together again.
    let mut apart = SHEARED.clone();
    apart.state = response.state;
    let back = [[1.0 / 1.2, 0.0], [0.0, 1.0 / 1.2]];
    let response = assert_sound(respond(&apart, None, &back, &settings())).unwrap();
    assert!(response.stress[0][0] < -1e-3);
}

/// No strain can carry a tension that grains without cohesion do not have.
#[test]
fn a_stress_out_of_reach_is_an_error() {
    let control = Control {
        components: [
            [Component::Stress(1.0), Component::Gradient(0.0)],
            [Component::Gradient(0.0), Component::Gradient(1.0)],
        ],
    };
    let error = drive(&SMALL, &UNIT, &control, Method::ReturnMapping, &settings()).unwrap_err();
    assert!(!error.to_string().is_empty());
    let nan = Control {
        components: [
            [Component::Stress(f64::NAN), Component::Gradient(0.0)],
            [Component::Gradient(0.0), Component::Gradient(1.0)],
        ],
    };
    let error = drive(&SMALL, &UNIT, &nan, Method::ReturnMapping, &settings()).unwrap_err();
    assert!(
        matches!(error, EquilibriumError::InvalidState(_)),
        "{error}"
    );
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
