//! Two grains, whose motion is known in closed form: masses, inertia, lever arms and signs.

use std::{f64::consts::PI, sync::Arc};

use super::*;
use crate::{Grains, contact::Status};

const KN: f64 = 800.0;
const KT: f64 = 300.0;
const COHESION: f64 = 0.08;
const RADIUS: f64 = 0.7;
/// Overlap at which kn δ = f_c.
const REST: f64 = COHESION / KN;

fn two_grains(overlap: f64) -> Rev<2, 1> {
    Rev {
        grains: Arc::new(Grains {
            radii: vec![RADIUS; 2],
        }),
        law: ContactLaw {
            normal_stiffness: KN,
            tangential_stiffness: KT,
            friction: 0.5,
            cohesion: COHESION,
        },
        state: RevState {
            cell: Cell::rectangular([20.0, 20.0]),
            // Across the border of the cell, so that the image counts too.
            positions: vec![[19.8, 3.0], [-0.2 + 2.0 * RADIUS - overlap, 3.0]],
            contacts: vec![Contact {
                i: 0,
                j: 1,
                tangential: [0.0],
            }],
        },
    }
}

/// Undamped grains of mass 1, in steps fine enough to measure a period.
fn undamped(rev: &Rev<2, 1>) -> Assembly<'_> {
    let positions = rev.state.positions.clone();
    let mut assembly = Assembly::new(rev, rev.state.cell, positions, vec![0.0; 2]).unwrap();
    assembly.make_brisk(0.0);
    assembly.dt *= 0.02;
    assembly.compute_forces(Friction::ReturnMapping, Record::All);
    assembly.set_masses();
    assembly
}

fn only(assembly: &Assembly<'_>) -> Link {
    let closed: Vec<Link> = assembly.closed().collect();
    assert_eq!(closed.len(), 1, "the grains have lost each other");
    closed[0]
}

/// Mean period of a signal that swings about zero, from its upward crossings.
fn period(assembly: &mut Assembly<'_>, signal: impl Fn(&Link) -> f64) -> f64 {
    let mut crossings = Vec::new();
    let mut last = signal(&only(assembly));
    for cycle in 0..20_000 {
        assembly.integrate();
        assembly.compute_forces(Friction::ReturnMapping, Record::All);
        let now = signal(&only(assembly));
        if last < 0.0 && now >= 0.0 {
            crossings.push((f64::from(cycle) - last / (now - last)) * assembly.dt);
        }
        last = now;
    }
    assert!(crossings.len() > 5);
    (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64
}

#[test]
fn normal_vibration_has_the_period_of_the_pair() {
    let rev = two_grains(1.2 * REST);
    let measured = period(&mut undamped(&rev), |link| link.overlap - REST);
    let exact = 2.0 * PI * (1.0 / (2.0 * KN)).sqrt();
    assert!(
        (measured / exact - 1.0).abs() < 1e-4,
        "{measured} for {exact}"
    );
}

#[test]
fn tangential_vibration_with_rolling_has_the_period_of_the_pair() {
    let rev = two_grains(REST);
    let mut assembly = undamped(&rev);
    for pose in &mut assembly.poses[..2] {
        (pose[2], pose[3]) = (1e-6, 1e-6 * RADIUS);
    }
    assembly.compute_forces(Friction::ReturnMapping, Record::All);
    let measured = period(&mut assembly, |link| link.tangential);
    let exact = 2.0 * PI * (1.0 / (6.0 * KT)).sqrt();
    assert!(
        (measured / exact - 1.0).abs() < 2e-4,
        "{measured} for {exact}"
    );
}

#[test]
fn cohesive_pair_rests_where_attraction_and_stiffness_balance() {
    let rev = two_grains(1.5 * REST);
    let mut assembly = undamped(&rev);
    assembly.damping = 0.7;
    for _ in 0..20_000 {
        assembly.integrate();
        assembly.compute_forces(Friction::ReturnMapping, Record::All);
    }
    let link = only(&assembly);
    assert!((link.overlap / REST - 1.0).abs() < 1e-9);
    assert!(link.normal.abs() < 1e-9 * COHESION);
}

#[test]
fn friction_is_bounded_by_the_elastic_part_of_the_normal_force() {
    let rev = two_grains(REST);
    for friction in [Friction::ReturnMapping, Friction::Path] {
        for sign in [1.0, -1.0] {
            let mut assembly = undamped(&rev);
            for pose in &mut assembly.poses[..2] {
                (pose[2], pose[3]) = (-0.3 * sign, -0.3 * sign * RADIUS);
            }
            assembly.compute_forces(friction, Record::All);
            let link = only(&assembly);
            let bound = 0.5 * KN * link.overlap;
            assert!((link.tangential / (sign * bound) - 1.0).abs() < 1e-12);
            // Both grains are turned the same way by the one force.
            let moment = (RADIUS - 0.5 * link.overlap) * link.tangential;
            for load in &assembly.loads[..2] {
                assert!((kernel::moment(load, RADIUS) / moment - 1.0).abs() < 1e-12);
            }
            // The law of action and reaction.
            for k in 0..2 {
                assert_eq!(assembly.loads[0][k] + assembly.loads[1][k], 0.0);
            }
        }
    }
}

/// A contact made within the increment has only slipped since it closed.
#[test]
fn slip_before_touching_makes_no_force() {
    let mut rev = two_grains(-REST);
    rev.state.contacts.clear();
    let mut positions = rev.state.positions.clone();
    positions[1][0] -= 2.0 * REST;
    let mut assembly = Assembly::new(&rev, rev.state.cell, positions, vec![1e-7; 2]).unwrap();
    assembly.compute_forces(Friction::ReturnMapping, Record::All);
    let link = only(&assembly);
    let slip = -2.0 * (RADIUS - 0.5 * REST) * 1e-7;
    assert!((link.tangential / (0.5 * KT * slip) - 1.0).abs() < 1e-6);
    assert_eq!(assembly.geometry(&link).status, Status::Sticking);
}
