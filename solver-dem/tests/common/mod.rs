//! Packings that several tests start from.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::sync::LazyLock;

use solver_dem::{
    Component, Control, Method, Recipe, Response, Rev, Settings, drive,
    exchange::PackingRecord,
    prepare,
    tensor::{Tensor2, Tensor4, apply},
};

/// No deformation.
pub const UNIT: Tensor2<2> = [[1.0, 0.0], [0.0, 1.0]];

/// The standard recipe with `grains` grains: σ0 = 1, kn = kt = 1000, μ = 0.5, dense.
pub fn recipe(grains: u32, seed: u64) -> Recipe {
    Recipe {
        grains,
        seed,
        ..Recipe::default()
    }
}

/// A dense packing of 100 grains at σ0 = 1.
pub static SMALL: LazyLock<Rev<2, 1>> = LazyLock::new(|| prepare(&recipe(100, 3)).unwrap().0);

/// [`SMALL`] after 0.3 % of biaxial compression at constant lateral stress.
pub static SHEARED: LazyLock<Rev<2, 1>> = LazyLock::new(|| {
    let mut rev = SMALL.clone();
    for _ in 0..15 {
        rev.state = biaxial_step(&rev, 2e-4, &Settings::default()).state;
    }
    rev
});

/// Like [`SMALL`], with a bond of f_c = a σ0 at every contact.
pub static COHESIVE: LazyLock<Rev<2, 1>> = LazyLock::new(|| {
    let recipe = Recipe {
        cohesion_ratio: 1.0,
        ..recipe(100, 3)
    };
    prepare(&recipe).unwrap().0
});

/// Both normal stresses given, no shear strain and no rotation.
pub fn stress_control(xx: f64, yy: f64) -> Control {
    Control {
        components: [
            [Component::Stress(xx), Component::Gradient(0.0)],
            [Component::Gradient(0.0), Component::Stress(yy)],
        ],
    }
}

/// The packing of another code in tests/data.
pub fn imported() -> Rev<2, 1> {
    record().to_rev().unwrap()
}

/// The same as it was written.
pub fn record() -> PackingRecord {
    serde_json::from_str(include_str!("../data/packing400.json")).unwrap()
}

/// Shortens a REV along the second axis by `strain` while the lateral stress stays −1.
pub fn biaxial_step(rev: &Rev<2, 1>, strain: f64, settings: &Settings) -> Response {
    let control = Control {
        components: [
            [Component::Stress(-1.0), Component::Gradient(0.0)],
            [Component::Gradient(0.0), Component::Gradient(1.0 - strain)],
        ],
    };
    drive(rev, &UNIT, &control, Method::ReturnMapping, settings).unwrap()
}

/// Settings that find an equilibrium to round-off and never move the reference state.
pub fn tight() -> Settings {
    Settings {
        tolerance: 1e-9,
        drift_tolerance: 1e-10,
        rebase_after: u32::MAX,
        return_mapping_cap: 100_000,
        network_regularisation: 0.0,
        ..Settings::default()
    }
}

/// The REV turned as a rigid body.
pub fn rotated_rev(r: &Tensor2<2>, rev: &Rev<2, 1>) -> Rev<2, 1> {
    let mut turned = rev.clone();
    turned.state.cell = rev.state.cell.deformed(r);
    for x in &mut turned.state.positions {
        *x = apply(r, x);
    }
    turned
}

/// The largest difference of two components.
pub fn distance(a: &Tensor2<2>, b: &Tensor2<2>) -> f64 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()))
}

/// ‖a − b‖/‖b‖ (Frobenius).
pub fn relative(a: &Tensor4<2>, b: &Tensor4<2>) -> f64 {
    let flat =
        |c: &Tensor4<2>| -> Vec<f64> { c.iter().flatten().flatten().flatten().copied().collect() };
    let (a, b) = (flat(a), flat(b));
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let difference: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x - y).collect();
    norm(&difference) / norm(&b)
}
