//! Packings: reproducible, at the stress asked for, and as dense as their recipe says.

mod common;

use common::{UNIT, recipe, tight};
use solver_dem::{PreparationError, Quality, Recipe, prepare, respond};

/// Void ratio and coordination must lie in the bands, the stress at σ0.
fn assert_in(recipe: &Recipe, void_ratio: [f64; 2], coordination: [f64; 2]) -> Quality {
    let (rev, quality) = prepare(recipe).unwrap();
    let (e, z) = (quality.void_ratio, quality.coordination);
    assert!(void_ratio[0] < e && e < void_ratio[1], "e = {e}");
    assert!(coordination[0] < z && z < coordination[1], "z = {z}");
    assert!(quality.residual <= 1e-4, "{quality:?}");
    // Not what the preparation says of itself: the stress that the finished REV answers with.
    let response = respond(&rev, None, &UNIT, &tight()).unwrap();
    for (k, target) in [(0, -1.0), (1, 0.0), (2, 0.0), (3, -1.0)] {
        let error = (response.stress[k / 2][k % 2] - target).abs();
        assert!(error <= 1e-4, "component {k} is off by {error:e}");
    }
    quality
}

#[test]
fn frictionless_preparation_packs_dense() {
    assert_in(&recipe(400, 1), [0.172, 0.190], [3.90, 4.15]);
}

#[test]
fn cohesion_closes_more_contacts() {
    let cohesive = Recipe {
        cohesion_ratio: 1.0,
        ..recipe(100, 1)
    };
    let with = assert_in(&cohesive, [0.165, 0.200], [3.8, 4.4]);
    let without = assert_in(&recipe(100, 1), [0.165, 0.200], [3.7, 4.2]);
    assert!(with.coordination > without.coordination);
    assert!(with.void_ratio < without.void_ratio);
}

#[test]
fn friction_while_compressing_packs_loose() {
    let loose = Recipe {
        preparation_friction: 0.5,
        ..recipe(100, 1)
    };
    assert_in(&loose, [0.205, 0.275], [2.6, 3.3]);
}

#[test]
fn same_seed_same_bits_and_another_seed_another_packing() {
    let (a, _) = prepare(&recipe(64, 7)).unwrap();
    let (b, _) = prepare(&recipe(64, 7)).unwrap();
    let (c, _) = prepare(&recipe(64, 8)).unwrap();
    assert_eq!(a, b);
    assert_ne!(a.state.positions, c.state.positions);
}

#[test]
fn impossible_recipes_are_refused_with_the_reason() {
    let bad = [
        Recipe {
            grains: 3,
            ..recipe(100, 1)
        },
        Recipe {
            size_ratio: 0.5,
            ..recipe(100, 1)
        },
        Recipe {
            size_ratio: f64::NAN,
            ..recipe(100, 1)
        },
        Recipe {
            confining_stress: 0.0,
            ..recipe(100, 1)
        },
        Recipe {
            confining_stress: f64::INFINITY,
            ..recipe(100, 1)
        },
        Recipe {
            stiffness: -1.0,
            ..recipe(100, 1)
        },
        Recipe {
            tangential_stiffness: f64::NAN,
            ..recipe(100, 1)
        },
        Recipe {
            friction: -0.1,
            ..recipe(100, 1)
        },
        Recipe {
            preparation_friction: f64::NAN,
            ..recipe(100, 1)
        },
        Recipe {
            cohesion_ratio: -1.0,
            ..recipe(100, 1)
        },
    ];
    for recipe in bad {
        let error = prepare(&recipe).unwrap_err();
        assert!(matches!(error, PreparationError::Recipe(_)), "{error}");
    }
}
