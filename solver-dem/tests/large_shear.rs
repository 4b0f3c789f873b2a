//! Simple shear to γ = 3 turns the cell into a needle, which is described anew by shorter vectors three times on the way. If
//! an image were lost or a contact forgotten there, the stress would jump where nothing happens.

mod common;

use std::collections::BTreeMap;

use common::{SMALL, UNIT, distance, tight};
use solver_dem::{
    Cell, Component, Control, Method, Rev, Settings, drive, respond,
    tensor::{Tensor2, product},
};

const STEP: f64 = 0.01;
const STEPS: usize = 300;

/// What a state holds, from positions and tangential forces alone: contacts, stress, elastic energy per volume. The cell is
/// searched for images as far as `images` cell vectors.
fn contents(rev: &Rev<2, 1>, images: i32) -> (usize, Tensor2<2>, f64) {
    let (state, radii, law) = (&rev.state, &rev.grains.radii, &rev.law);
    let volume = state.cell.volume();
    let tangential: BTreeMap<(u32, u32), f64> = state
        .contacts
        .iter()
        .map(|c| ((c.i, c.j), c.tangential[0]))
        .collect();
    let (mut count, mut stress, mut energy) = (0, [[0.0; 2]; 2], 0.0);
    for (j, b) in state.positions.iter().enumerate() {
        for (i, a) in state.positions[..j].iter().enumerate() {
            let apart = [b[0] - a[0], b[1] - a[1]];
            // From the image that is near in cell coordinates.
            let inverse = state.cell.inverse().unwrap();
            let near = inverse.map(|row| (row[0] * apart[0] + row[1] * apart[1]).round());
            for k in -images..=images {
                for l in -images..=images {
                    let shift = [f64::from(k) - near[0], f64::from(l) - near[1]];
                    let image = state.cell.translation(&shift);
                    let branch = [apart[0] + image[0], apart[1] + image[1]];
                    let length = branch[0].hypot(branch[1]);
                    let overlap = radii[i] + radii[j] - length;
                    if overlap <= 0.0 {
                        continue;
                    }
                    count += 1;
                    let n = branch.map(|x| x / length);
                    let normal = law.normal_stiffness * overlap;
                    let along = tangential[&(i as u32, j as u32)];
                    // The tangential force is that on i along (−n_y, n_x).
                    let force = [
                        (normal - law.cohesion) * n[0] + along * n[1],
                        (normal - law.cohesion) * n[1] - along * n[0],
                    ];
                    for (row, f) in stress.iter_mut().zip(force) {
                        for (component, l) in row.iter_mut().zip(branch) {
                            *component -= f * l / volume;
                        }
                    }
                    energy += 0.5
                        * (normal * normal / law.normal_stiffness
                            + along * along / law.tangential_stiffness)
                        / volume;
                }
            }
        }
    }
    (count, stress, energy)
}

struct Step {
    /// Change of the stress over the mean stress.
    jump: f64,
    reduced: bool,
}

#[test]
fn nothing_jumps_where_the_cell_is_described_anew() {
    let settings = Settings::default();
    let mut rev = SMALL.clone();
    let mut from = UNIT;
    let mut last: Option<Tensor2<2>> = None;
    let mut steps = Vec::new();
    for k in 1..=STEPS {
        let none = Component::Gradient(0.0);
        let shear = Component::Gradient(STEP * k as f64);
        let control = Control {
            components: [
                [Component::Gradient(1.0), shear],
                [none, Component::Stress(-1.0)],
            ],
        };
        let response = drive(&rev, &from, &control, Method::ReturnMapping, &settings).unwrap();
        let back = Cell { h: from }.inverse().unwrap();
        let carried = rev.state.cell.deformed(&product(&response.gradient, &back));
        (rev.state, from) = (response.state, response.gradient);
        let reduced = distance(&carried.h, &rev.state.cell.h) > 1.0;
        if reduced {
            assert_equal_as_carried(&rev, carried);
        }
        if let Some(last) = last {
            let scale = 0.5 * (last[0][0] + last[1][1]).abs();
            let jump = distance(&last, &response.stress) / scale;
            steps.push(Step { jump, reduced });
        }
        last = Some(response.stress);
    }
    assert!((from[0][1] - 3.0).abs() < 1e-12);
    // Looked at from outside, the steps with a reduction are steps like all others.
    let reductions = steps.iter().filter(|step| step.reduced).count();
    assert!((2..=6).contains(&reductions), "{reductions}");
    let largest = |reduced: bool| {
        let chosen = steps.iter().filter(|step| step.reduced == reduced);
        chosen.map(|step| step.jump).fold(0.0, f64::max)
    };
    assert!(largest(true) <= largest(false));
}

/// The state as it is and with the long cell vectors it would have had: the same contents, and the same answer.
fn assert_equal_as_carried(rev: &Rev<2, 1>, carried: Cell<2>) {
    let mut long = rev.clone();
    long.state.cell = carried;
    let (short, long_too) = (contents(rev, 1), contents(&long, 3));
    assert_eq!(short.0, rev.state.contacts.len());
    assert_eq!(short.0, long_too.0);
    assert!(distance(&short.1, &long_too.1) < 1e-9);
    assert!((short.2 / long_too.2 - 1.0).abs() < 1e-9);
    let a = respond(rev, None, &UNIT, &tight()).unwrap();
    let b = respond(&long, None, &UNIT, &tight()).unwrap();
    assert!(distance(&a.stress, &b.stress) < 1e-5);
}
