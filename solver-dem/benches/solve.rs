//! What a REV solve costs: a cycle, an increment, the tangents.
//!
//! `cargo bench -p solver-dem`. First a table of the cycle loop by CPU time, the figures by which codes are compared; then
//! solves by the clock. A solve that is asked for no accuracy stops after 20 cycles: the difference between it and one with
//! both tangents gives the price of the second one.

use criterion::{BenchmarkId, Criterion, criterion_group};
use rustix::time::{ClockId, clock_gettime};
use solver_dem::{
    Recipe, Rev, Settings, Start, Tangents, Trust, measure::run_cycles, prepare, respond,
};

/// An increment of biaxial compression.
const INCREMENT: [[f64; 2]; 2] = [[1.0 + 4e-4, 0.0], [0.0, 1.0 - 1e-3]];

fn packing(grains: u32) -> Rev<2, 1> {
    let recipe = Recipe {
        grains,
        ..Recipe::default()
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
            trust: Trust::Guess,
        };
        group.bench_function(BenchmarkId::new("increment, warm", grains), |b| {
            b.iter(|| respond(&rev, Some(start), &near, &Settings::default()));
        });
        group.finish();
    }
}

/// CPU seconds of this thread.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Prints what a cycle costs: the median of 15 stretches of 2000 cycles.
fn cycles() {
    println!("grains  contacts  listed pairs  contact updates/CPU s  us/cycle  ns/listed pair");
    for grains in [100, 400, 1600] {
        let rev = packing(grains);
        let stretch = || {
            let begun = cpu_seconds();
            let work = run_cycles(&rev, &INCREMENT, 2000).expect("the cell has room");
            (cpu_seconds() - begun, work)
        };
        let (_, work) = stretch();
        let mut seconds: Vec<f64> = (0..15).map(|_| stretch().0).collect();
        seconds.sort_by(f64::total_cmp);
        let per_cycle = seconds[7] / f64::from(work.cycles);
        println!(
            "{grains:6}  {:8}  {:12}  {:21.2e}  {:8.2}  {:14.2}",
            work.contacts,
            work.listed_pairs,
            work.contact_updates() / seconds[7],
            1e6 * per_cycle,
            1e9 * per_cycle / f64::from(work.listed_pairs),
        );
    }
}

criterion_group!(benches, solve);

fn main() {
    // Cargo passes `--bench`; tests of benchmarks and lists of their names pass it not.
    if std::env::args().any(|argument| argument == "--bench") {
        cycles();
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
