//! A quasi-static answer knows no rate and no step. Where the curve depends on the ramp of the path solver or on the
//! increments of return mapping, it is a curve of the solver and not of the grains.

mod common;

use std::sync::LazyLock;

use common::{imported, recipe};
use solver_dem::{Component, Control, Method, Rev, Settings, drive, prepare};

/// σ_yy at every 5e-4 of axial strain up to 0.5 %, at constant lateral stress.
fn curve(rev: &Rev<2, 1>, step: f64, method: Method, settings: &Settings) -> Vec<f64> {
    let mut rev = rev.clone();
    let mut from = common::UNIT;
    let between = (5e-4 / step).round() as usize;
    let mut curve = Vec::new();
    for k in 1..=10 * between {
        let axial = Component::Gradient(1.0 - step * k as f64);
        let none = Component::Gradient(0.0);
        let control = Control {
            components: [[Component::Stress(-1.0), none], [none, axial]],
        };
        let response = drive(&rev, &from, &control, method, settings).unwrap();
        (rev.state, from) = (response.state, response.gradient);
        if k.is_multiple_of(between) {
            curve.push(response.stress[1][1]);
        }
    }
    curve
}

static REVS: LazyLock<Vec<Rev<2, 1>>> = LazyLock::new(|| {
    let seeds = (1..=2).map(|seed| prepare(&recipe(400, seed)).unwrap().0);
    std::iter::once(imported()).chain(seeds).collect()
});

/// How far two curves may be apart: nine points in ten, and all.
struct Bounds {
    most: f64,
    all: f64,
}

/// Three packings of 400 grains, ten strains each. A slip that comes one step earlier on one curve than on the other is
/// no error of either; so a few points may be further apart than the rest.
fn assert_same(
    bounds: &Bounds,
    coarse: impl Fn(&Rev<2, 1>) -> Vec<f64>,
    fine: impl Fn(&Rev<2, 1>) -> Vec<f64>,
) {
    let mut apart = Vec::new();
    for rev in REVS.iter() {
        let pairs = coarse(rev).into_iter().zip(fine(rev));
        apart.extend(pairs.map(|(coarse, fine)| (coarse / fine - 1.0).abs()));
    }
    apart.sort_by(f64::total_cmp);
    let (most, all) = (apart[26], apart[29]);
    assert!(most < bounds.most, "nine in ten are {most:.2e} apart");
    assert!(all < bounds.all, "one is {all:.2e} apart");
}

const HALVED: Bounds = Bounds {
    most: 0.002,
    all: 0.01,
};

fn fine_settings() -> Settings {
    Settings {
        tolerance: 1e-5,
        ramp_min_cycles: 1,
        ..Settings::default()
    }
}

#[test]
fn half_the_ramp_of_the_path_solver_gives_the_same_stress() {
    let at = |ramp_rate| {
        move |rev: &_| {
            let settings = Settings {
                ramp_rate,
                ..fine_settings()
            };
            curve(rev, 5e-4, Method::Path, &settings)
        }
    };
    assert_same(&HALVED, at(5e-7), at(2.5e-7));
}

#[test]
fn half_the_increment_of_return_mapping_gives_the_same_stress() {
    let by = |step| move |rev: &_| curve(rev, step, Method::ReturnMapping, &fine_settings());
    assert_same(&HALVED, by(1e-4), by(5e-5));
}

/// Two ways to integrate friction that share nothing but the contact law.
#[test]
fn return_mapping_and_a_slow_path_meet() {
    let slow = Settings {
        ramp_rate: 2.5e-7,
        ..fine_settings()
    };
    assert_same(
        &Bounds {
            most: 0.005,
            all: 0.02,
        },
        |rev| curve(rev, 1e-4, Method::ReturnMapping, &fine_settings()),
        |rev| curve(rev, 5e-4, Method::Path, &slow),
    );
}
