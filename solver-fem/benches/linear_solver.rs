//! What the linear solvers cost.
//!
//! `cargo bench -p solver-fem`. First a table by CPU time, the figures of docs/benchmarks.md; then factorisation and
//! solution by the clock.

#[path = "../tests/common/systems.rs"]
mod systems;

use criterion::{BenchmarkId, Criterion, criterion_group};
use rustix::time::{ClockId, clock_gettime};
use solver_fem::linear_solver::{LinearSolver, Method};
use systems::{System, Unknowns, assemble, specimen};

const MESHES: [[usize; 2]; 3] = [[8, 16], [16, 32], [32, 64]];
const KINDS: [(&str, Unknowns); 2] = [
    ("plain", Unknowns::Displacement),
    ("second gradient", Unknowns::SecondGradient(1e-3)),
];
const METHODS: [Method; 2] = [Method::Multifrontal, Method::Faer];

fn system(elements: [usize; 2], unknowns: Unknowns) -> System<2> {
    let mesh = specimen(elements);
    let all: Vec<usize> = (0..mesh.element_count()).collect();
    assemble(&mesh, &all, unknowns, 1)
}

fn analyse(method: Method, system: &System<2>) -> Box<dyn LinearSolver> {
    method
        .analyse(&system.pattern, system.fields.clone(), &system.centres)
        .expect("there is memory")
}

/// CPU seconds of this thread.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Smallest of some repetitions, in milliseconds.
fn milliseconds(repetitions: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..repetitions).map(|_| {
        let begun = cpu_seconds();
        work();
        1e3 * (cpu_seconds() - begun)
    });
    times.fold(f64::INFINITY, f64::min)
}

fn table() {
    println!(
        "CPU ms, smallest of 7: kind, elements, unknowns, entries, solver, analysis, factorisation, solution"
    );
    for (name, unknowns) in KINDS {
        for [nx, ny] in MESHES {
            let system = system([nx, ny], unknowns);
            let (rhs, _) = system.known();
            for method in METHODS {
                let analysis = milliseconds(2, || drop(analyse(method, &system)));
                let solver = analyse(method, &system);
                let factorisation = milliseconds(7, || {
                    drop(solver.factorise(&system.values).expect("regular"))
                });
                let factors = solver.factorise(&system.values).expect("regular");
                let solution = milliseconds(7, || drop(factors.solve(&rhs).expect("finite")));
                println!(
                    "{name}  {nx}x{ny}  {}  {}  {method:?}  {analysis:.1}  {factorisation:.1}  {solution:.1}",
                    system.pattern.size,
                    system.pattern.entry_count(),
                );
            }
        }
    }
}

fn solvers(criterion: &mut Criterion) {
    for (name, unknowns) in KINDS {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        for [nx, ny] in MESHES {
            let system = system([nx, ny], unknowns);
            let (rhs, _) = system.known();
            for method in METHODS {
                let solver = analyse(method, &system);
                let place = format!("{nx}x{ny} {method:?}");
                group.bench_function(BenchmarkId::new("factorise", &place), |b| {
                    b.iter(|| drop(solver.factorise(&system.values)));
                });
                let factors = solver.factorise(&system.values).expect("regular");
                group.bench_function(BenchmarkId::new("solve", &place), |b| {
                    b.iter(|| factors.solve(&rhs));
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, solvers);

fn main() {
    // Cargo passes `--bench`; tests of benchmarks and lists of their names pass it not.
    if std::env::args().any(|argument| argument == "--bench") {
        table();
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
