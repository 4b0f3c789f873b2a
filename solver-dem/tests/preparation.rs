//! Packings: reproducible, at the stress asked for, as dense as their recipe says, and graded, shaped and turned as asked.

mod common;

use common::{UNIT, distance, recipe, tight};
use solver_dem::{
    AnisotropicStress, Fraction, Means, PreparationError, Quality, Quantity, Recipe, Sizes, Target,
    prepare, respond,
};

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
    assert_in(&recipe(400, 1), [0.170, 0.187], [3.85, 4.10]);
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
    assert_in(&loose, [0.200, 0.250], [2.6, 3.2]);
}

#[test]
fn same_seed_same_bits_and_another_seed_another_packing() {
    let (a, _) = prepare(&recipe(64, 7)).unwrap();
    let (b, _) = prepare(&recipe(64, 7)).unwrap();
    let (c, _) = prepare(&recipe(64, 8)).unwrap();
    assert_eq!(a, b);
    assert_ne!(a.state.positions, c.state.positions);
}

fn target(quantity: Quantity, value: f64, by: Means) -> Option<Target> {
    let tolerance = match quantity {
        Quantity::VoidRatio => 0.003,
        Quantity::Coordination => 0.05,
    };
    Some(Target {
        quantity,
        value,
        tolerance,
        by,
    })
}

#[test]
fn targets_are_reached_by_friction_and_by_cycles() {
    let shear = Means::ShearCycles {
        amplitude: 0.02,
        friction: 0.1,
    };
    let compression = Means::CompressionCycles {
        ratio: 4.0,
        friction: 0.1,
    };
    for (quantity, value, by) in [
        (Quantity::VoidRatio, 0.205, Means::Friction),
        (Quantity::Coordination, 3.4, Means::Friction),
        (Quantity::VoidRatio, 0.21, shear),
        (Quantity::VoidRatio, 0.21, compression),
    ] {
        let wanted = Recipe {
            preparation_friction: 0.5,
            target: target(quantity, value, by),
            ..recipe(100, 2)
        };
        let (rev, quality) = prepare(&wanted).unwrap();
        let (reached, tolerance) = match quantity {
            Quantity::VoidRatio => (rev.void_ratio(), 0.003),
            Quantity::Coordination => (rev.coordination(), 0.05),
        };
        assert!((reached - value).abs() <= tolerance, "{by:?}: {reached}");
        assert_eq!(by != Means::Friction, quality.densifying_cycles > 0);
        assert_eq!(rev.law, wanted.law());
        assert!(quality.residual <= 1e-4 && quality.stress_error <= 1e-4);
    }
}

#[test]
fn a_target_out_of_reach_is_refused_with_what_can_be_reached() {
    for value in [0.1, 0.4] {
        let wanted = Recipe {
            target: target(Quantity::VoidRatio, value, Means::Friction),
            ..recipe(64, 1)
        };
        match prepare(&wanted).unwrap_err() {
            PreparationError::OutOfReach { from, to, .. } => {
                assert!(
                    0.2 < from && from < 0.4 && 0.1 < to && to < from,
                    "{from} {to}"
                );
            }
            error => panic!("{error}"),
        }
    }
    // Cycles make nothing looser.
    let cycles = Means::CompressionCycles {
        ratio: 4.0,
        friction: 0.1,
    };
    let looser = Recipe {
        target: target(Quantity::VoidRatio, 0.3, cycles),
        ..recipe(64, 1)
    };
    let error = prepare(&looser).unwrap_err();
    assert!(
        matches!(error, PreparationError::OutOfReach { .. }),
        "{error}"
    );
}

/// Whatever the distribution, lengths are in mean diameters; what is cut off stays off.
#[test]
fn gradings_are_met_whatever_the_seed() {
    let by_area = |radii: &[f64], below: f64| {
        let area = |r: &&f64| **r * **r;
        let all: f64 = radii.iter().map(|r| r * r).sum();
        radii
            .iter()
            .filter(|r| **r < below)
            .map(|r| area(&r))
            .sum::<f64>()
            / all
    };
    let log_normal = Sizes::LogNormal {
        deviation: 0.4,
        smallest: 0.5,
        largest: 2.0,
    };
    let curve = vec![[1.0, 0.0], [2.0, 0.25], [4.0, 1.0]];
    let table = Sizes::Table {
        by: Fraction::Area,
        curve: curve.clone(),
    };
    for sizes in [
        log_normal.clone(),
        table.clone(),
        Sizes::Uniform { ratio: 1.0 },
    ] {
        let graded = |seed| {
            let recipe = Recipe {
                sizes: sizes.clone(),
                ..recipe(200, seed)
            };
            prepare(&recipe).unwrap().0.grains
        };
        let grains = graded(1);
        assert_eq!(grains, graded(2));
        assert!((grains.mean_diameter() - 1.0).abs() < 1e-12);
        let radii = &grains.radii;
        let (largest, smallest) = (radii[0], radii[199]);
        assert!(largest / smallest <= sizes.ratio() * (1.0 + 1e-12));
        let median = 0.5 * (radii[99] + radii[100]);
        if sizes == log_normal {
            // Φ(x) at the 33rd of 200 from above, between cuts at ±ln 2/0.4 = ±1.733, is 0.0415 + 0.8375 · 0.917, so x = 0.876.
            let high: f64 = radii[(0.16 * 200.0) as usize] / median;
            assert!((0.85..0.90).contains(&(high.ln() / 0.4)), "{high}");
        }
        if sizes == table {
            // Sizes are known up to the unit: the largest stands for (nearly) 4.
            let unit = largest / 4.0;
            assert!((by_area(radii, 2.0 * unit) - 0.25).abs() < 0.02);
            assert!((by_area(radii, 3.0 * unit) - 0.625).abs() < 0.02);
        }
    }
}

/// The excess of contacts follows the larger stress, turns with the packing, and the finished stress is isotropic.
#[test]
fn anisotropy_points_along_the_larger_stress_and_turns_with_the_packing() {
    let pressed_along = |direction: f64, orientation: f64| Recipe {
        preparation_friction: 0.5,
        anisotropy: Some(AnisotropicStress {
            stress_ratio: 1.7,
            direction,
        }),
        orientation,
        ..recipe(400, 2)
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let (upright, quality) = prepare(&pressed_along(quarter, 0.0)).unwrap();
    assert!(quality.anisotropy > 0.05, "{quality:?}");
    assert!(quality.direction.abs() > quarter - 0.35, "{quality:?}");
    let (turned, after) = prepare(&pressed_along(quarter, -quarter)).unwrap();
    assert!(after.direction.abs() < 0.35, "{after:?}");
    assert!((after.anisotropy - quality.anisotropy).abs() < 1e-9);
    assert_eq!(turned.state.contacts, upright.state.contacts);
    let answer = respond(&turned, None, &UNIT, &tight()).unwrap();
    assert!(distance(&answer.stress, &[[-1.0, 0.0], [0.0, -1.0]]) < 2e-4);
    // Grains without friction bear hardly any deviator.
    let flows = Recipe {
        preparation_friction: 0.0,
        ..pressed_along(0.0, 0.0)
    };
    let error = prepare(&flows).unwrap_err();
    assert!(matches!(error, PreparationError::Flows { .. }), "{error}");
}

#[test]
fn an_elongated_cell_keeps_its_shape_and_its_density() {
    let long = Recipe {
        aspect_ratio: 3.0,
        ..recipe(300, 1)
    };
    let (rev, quality) = prepare(&long).unwrap();
    let h = rev.state.cell.h;
    assert!((h[0][0] / h[1][1] / 3.0 - 1.0).abs() < 0.2, "{h:?}");
    assert!((0.165..0.19).contains(&quality.void_ratio), "{quality:?}");
}

#[test]
fn impossible_recipes_are_refused_with_the_reason() {
    let bad = [
        Recipe {
            grains: 3,
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Uniform { ratio: 0.5 },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Uniform { ratio: f64::NAN },
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
        Recipe {
            sizes: Sizes::Table {
                by: Fraction::Number,
                curve: vec![[1.0, 0.0]],
            },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Table {
                by: Fraction::Number,
                curve: vec![[1.0, 0.1], [2.0, 1.0]],
            },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Table {
                by: Fraction::Number,
                curve: vec![[2.0, 0.0], [1.0, 1.0]],
            },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Table {
                by: Fraction::Number,
                curve: vec![[1.0, 0.0], [f64::NAN, 1.0]],
            },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::Table {
                by: Fraction::Number,
                curve: vec![[1.0, 0.0], [50.0, 1.0]],
            },
            ..recipe(100, 1)
        },
        Recipe {
            sizes: Sizes::LogNormal {
                deviation: 0.0,
                smallest: 0.5,
                largest: 2.0,
            },
            ..recipe(100, 1)
        },
        Recipe {
            aspect_ratio: 0.0,
            ..recipe(100, 1)
        },
        Recipe {
            orientation: f64::NAN,
            ..recipe(100, 1)
        },
        Recipe {
            target: target(Quantity::VoidRatio, f64::NAN, Means::Friction),
            ..recipe(100, 1)
        },
    ];
    for recipe in bad {
        let error = prepare(&recipe).unwrap_err();
        assert!(matches!(error, PreparationError::Recipe(_)), "{error}");
    }
}

/// Sizes whose quotients or squares overflow made grains of no size, and a preparation without end.
#[test]
fn sizes_near_the_ends_of_the_number_range_are_refused() {
    let narrow = Sizes::LogNormal {
        deviation: 1e-310,
        smallest: 0.5,
        largest: 2.0,
    };
    assert!(narrow.check().is_err());
    let tiny = Sizes::Table {
        by: Fraction::Area,
        curve: vec![[1e-200, 0.0], [2e-200, 1.0]],
    };
    assert!(tiny.check().is_err());
}
