//! What a REV solve costs: a cycle, an increment, the tangents.
//!
//! `cargo bench -p solver-dem`. A solve that is asked for no accuracy stops after 20 cycles: the difference
//! between it and one with both tangents, or one of 2000 cycles, gives the price of each part.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use solver_dem::{Recipe, Rev, Settings, Start, Tangents, prepare, respond};

/// An increment of biaxial compression.
const INCREMENT: [[f64; 2]; 2] = [[1.0 + 4e-4, 0.0], [0.0, 1.0 - 1e-3]];

fn packing(grains: u32) -> Rev<2, 1> {
    let recipe = Recipe {
        grains,
        size_ratio: 2.5,
        confining_stress: 1.0,
        stiffness: 1000.0,
        tangential_stiffness: 1.0,
        friction: 0.5,
        preparation_friction: 0.0,
        cohesion_ratio: 0.0,
        seed: 1,
    };
    prepare(&recipe).expect("the recipe settles").0
}

fn solve(criterion: &mut Criterion) {
    for grains in [100, 400] {
        let rev = packing(grains);
        let mut group = criterion.benchmark_group("rev");
        let stops_at_once = Settings {
            tolerance: f64::MAX,
            drift_tolerance: f64::MAX,
            ..Settings::default()
        };
        for (name, tangents) in [
            ("one tangent", Tangents::Algorithmic),
            ("both tangents", Tangents::Both),
        ] {
            let settings = Settings {
                tangents,
                ..stops_at_once
            };
            group.bench_function(BenchmarkId::new(name, grains), |b| {
                b.iter(|| respond(&rev, None, &INCREMENT, &settings));
            });
        }
        let cold = respond(&rev, None, &INCREMENT, &Settings::default()).expect("it settles");
        group.bench_function(BenchmarkId::new("increment", grains), |b| {
            b.iter(|| respond(&rev, None, &INCREMENT, &Settings::default()));
        });
        let mut near = INCREMENT;
        near[0][0] += 2e-5;
        let start = Start {
            state: &cold.state,
            rotations: &cold.rotations,
        };
        group.bench_function(BenchmarkId::new("increment, warm", grains), |b| {
            b.iter(|| respond(&rev, Some(start), &near, &Settings::default()));
        });
        // Never satisfied, so that it runs into its caps: 2000 cycles, then a path of one.
        let cycles = Settings {
            tolerance: 0.0,
            return_mapping_cap: 2000,
            rebase_after: u32::MAX,
            path_cap: 1,
            ramp_min_cycles: 1,
            ..Settings::default()
        };
        group.throughput(Throughput::Elements(2000));
        group.bench_function(BenchmarkId::new("cycles", grains), |b| {
            b.iter(|| respond(&rev, None, &INCREMENT, &cycles));
        });
        group.finish();
    }
}

criterion_group!(benches, solve);
criterion_main!(benches);
