//! Strength and dilation are what a packing is for. A preparation that packs a little looser, or a solver that follows friction
//! a little worse, changes no other test: here one packing of each kind must behave as the bands of docs/packings.md say,
//! widened by the scatter of single packings. `examples/statistics.rs` compares ten of each.

mod common;

use common::{UNIT, recipe};
use solver_dem::{Component, Control, Method, Recipe, Settings, drive, prepare};

/// e0, z0, largest σ1/σ2, its mean over the last 1 %, and volume strain at 6 % axial strain.
struct Figures {
    void_ratio: f64,
    coordination: f64,
    peak: f64,
    late: f64,
    volume: f64,
}

fn compressed(recipe: &Recipe) -> Figures {
    const STEPS: u32 = 60;
    let (mut rev, quality) = prepare(recipe).unwrap();
    let mut gradient = UNIT;
    let mut ratios = Vec::new();
    for step in 1..=STEPS {
        let control = Control {
            components: [
                [Component::Stress(-1.0), Component::Gradient(0.0)],
                [
                    Component::Gradient(0.0),
                    Component::Gradient(1.0 - 1e-3 * f64::from(step)),
                ],
            ],
        };
        let method = Method::ReturnMapping;
        let response = drive(&rev, &gradient, &control, method, &Settings::default()).unwrap();
        gradient = response.gradient;
        rev.state = response.state;
        ratios.push(response.stress[1][1] / response.stress[0][0]);
    }
    Figures {
        void_ratio: quality.void_ratio,
        coordination: quality.coordination,
        peak: ratios.iter().copied().fold(0.0, f64::max),
        late: ratios[50..].iter().sum::<f64>() / 10.0,
        volume: gradient[0][0] * gradient[1][1] - 1.0,
    }
}

#[track_caller]
fn assert_within(what: &str, value: f64, band: [f64; 2]) {
    assert!(band[0] < value && value < band[1], "{what} is {value}");
}

#[test]
fn dense_cohesive_and_loose_packings_are_as_strong_and_dilate_as_they_should() {
    let dense = compressed(&recipe(400, 1));
    assert_within("e0", dense.void_ratio, [0.170, 0.190]);
    assert_within("z0", dense.coordination, [3.82, 4.12]);
    assert_within("peak", dense.peak, [2.3, 3.4]);
    assert_within("late", dense.late, [1.6, 2.7]);
    assert_within("volume strain", dense.volume, [0.010, 0.055]);

    let cohesive = compressed(&Recipe {
        cohesion_ratio: 1.0,
        ..recipe(400, 1)
    });
    assert_within("cohesive e0", cohesive.void_ratio, [0.168, 0.188]);
    assert_within("cohesive z0", cohesive.coordination, [3.93, 4.20]);
    assert_within("cohesive peak", cohesive.peak, [3.4, 5.0]);
    assert_within("cohesive volume strain", cohesive.volume, [0.020, 0.07]);

    let loose = compressed(&Recipe {
        preparation_friction: 0.5,
        ..recipe(400, 1)
    });
    assert_within("loose e0", loose.void_ratio, [0.215, 0.240]);
    assert_within("loose z0", loose.coordination, [2.65, 3.10]);
    assert_within("loose peak", loose.peak, [1.75, 2.45]);
    assert_within("loose volume strain", loose.volume, [-0.013, 0.013]);
}
