//! `femdem-flow bench macro`: what the equations of the macro scale cost on this machine.

use std::sync::Arc;

use engine::thread_cpu_time;
use serde::Serialize;
use solver_dem::{Rev, Settings, Start, Tangents, Trust, respond};
use solver_fem::{
    assembly::{self, Configuration, LinearSystem, residual, tangent},
    boundary::{Condition, Target, Value},
    elastic::Elastic,
    element::Q8,
    linear_solver::Method,
    mesh::{Mesh, Rectangle},
    problem::{Problem, Setup},
    second_gradient::SecondGradient,
};

use super::{memory::peak_during, standard, statistics::Spread};
use crate::{
    failure::{Failure, FailureKind},
    machine::Machine,
    progress::Progress,
    report::Report,
    run::text::{Align, Table},
};

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Meshes: elements across and along a 1×2 specimen.
    pub meshes: Vec<[usize; 2]>,
    /// Repetitions, of which the median counts.
    pub repetitions: u32,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            meshes: vec![[8, 16], [16, 32], [32, 64]],
            repetitions: 7,
        }
    }
}

impl Plan {
    /// A glance: the smallest mesh.
    pub fn quick() -> Self {
        Self {
            meshes: vec![[8, 16]],
            repetitions: 3,
        }
    }
}

/// Young's modulus over the confining stress, near that of the standard packing.
const STIFFNESS: f64 = 400.0;
/// Modulus of the second gradient over the confining stress, for a specimen of width 1.
const MODULUS: f64 = 0.64e-2;
/// Grains of the REVs to which the cost is compared.
const GRAINS: u32 = 400;

const METHODS: [(&str, Method); 2] = [
    ("multifrontal", Method::Multifrontal),
    ("faer", Method::Faer),
];

/// One linear solver on one system.
#[derive(Clone, Debug, Serialize)]
struct SolverCost {
    name: &'static str,
    /// CPU milliseconds of what is done once for a mesh.
    analysis_ms: f64,
    /// CPU milliseconds of a factorisation, the search for a motion without stiffness included.
    factorisation_ms: Spread,
    /// CPU milliseconds of a solution with one step of refinement.
    solution_ms: Spread,
    /// ‖b − A·x‖/‖b‖.
    residual: f64,
    /// Largest resident memory of the process meanwhile, in bytes.
    peak_memory: Option<u64>,
}

/// One mesh, plain or with second gradient.
#[derive(Clone, Debug, Serialize)]
struct MeshCost {
    elements: [usize; 2],
    second_gradient: bool,
    unknowns: usize,
    entries: usize,
    /// CPU milliseconds of residual and tangent.
    assembly_ms: Spread,
    solvers: Vec<SolverCost>,
    /// Assembly, factorisation and solution by the solver that runs take: what an iteration costs beside its REVs.
    iteration_ms: f64,
    /// Number of Gauss points, each with a REV.
    revs: usize,
    /// That cost over the whole of an iteration in which each of these REVs answers once.
    share_of_iteration: f64,
}

/// What a REV answers for in an iteration.
#[derive(Clone, Debug, Serialize)]
struct RevCost {
    grains: u32,
    /// CPU milliseconds of answers to increments of 1e-3 before the peak, both tangents included: from the committed
    /// state, and from an answer to a near deformation, in equal parts.
    answer_ms: Spread,
    mean_ms: f64,
}

#[derive(Clone, Debug, Serialize)]
struct Figures {
    machine: Machine,
    rev: RevCost,
    meshes: Vec<MeshCost>,
}

fn failed(what: &str) -> Failure {
    Failure::new(FailureKind::Run, format!("failed to measure {what}"))
}

/// Measures on one thread, whatever else the machine does; CPU time, not wall time.
///
/// # Errors
/// A system that cannot be set up or solved, or a packing that cannot be prepared or deformed.
pub fn measure(plan: &Plan, progress: &dyn Progress) -> Result<Report, Failure> {
    progress.note(&format!("answers of a REV of {GRAINS} grains"));
    let rev = rev_cost()?;
    let mut meshes = Vec::new();
    for second_gradient in [false, true] {
        for &elements in &plan.meshes {
            let [nx, ny] = elements;
            let kind = kind(second_gradient);
            progress.note(&format!("{nx}×{ny} elements, {kind}"));
            let cost = mesh_cost(elements, second_gradient, plan.repetitions, &rev)
                .map_err(|error| failed(&format!("{nx}×{ny} elements, {kind}")).because(error))?;
            meshes.push(cost);
        }
    }
    let figures = Figures {
        machine: Machine::this(),
        rev,
        meshes,
    };
    Ok(Report::new(text(&figures), &figures))
}

fn kind(second_gradient: bool) -> &'static str {
    if second_gradient {
        "second gradient"
    } else {
        "plain"
    }
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

/// A biaxial specimen between smooth platens under follower pressure.
fn problem(elements: [usize; 2], second_gradient: bool) -> Result<Problem<2>, AnyError> {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements,
    })?;
    let held = Value::Constant(0.0);
    let conditions = vec![
        Condition::displacement(Target::boundary("bottom"), 1, held),
        Condition::displacement(Target::node_set("bottom_mid"), 0, held),
        Condition::displacement(Target::boundary("top"), 1, Value::load(0)),
        Condition::pressure("left", Value::Constant(1.0)),
        Condition::pressure("right", Value::Constant(1.0)),
    ];
    let modulus = if second_gradient { MODULUS } else { 0.0 };
    let second_gradient = SecondGradient::uniform(&mesh, modulus);
    Ok(Problem::build(Setup {
        second_gradient,
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, 1)
    })?)
}

/// Stresses and unsymmetric tangents of the Gauss points, about those of an elastic body under pressure.
struct Points {
    stress: Vec<f64>,
    tangents: Vec<f64>,
}

impl Points {
    fn new(count: usize) -> Result<Self, AnyError> {
        let elastic = Elastic::new(STIFFNESS, 0.3)?.tangent::<2>();
        let elastic: Vec<f64> = elastic.into_iter().flatten().flatten().flatten().collect();
        // Multiples of the golden ratio: unstructured, the same on every machine.
        let mut number = 0.0;
        let mut noise = || {
            number += 0.618_033_988_749_894_9_f64;
            2.0 * number.fract() - 1.0
        };
        let mut points = Self {
            stress: Vec::new(),
            tangents: Vec::new(),
        };
        for _ in 0..count {
            let shear = 0.1 * noise();
            points.stress.extend([-1.0, shear, shear, -1.5]);
            let tangent = elastic.iter().map(|c| c + 0.1 * STIFFNESS * noise());
            points.tangents.extend(tangent);
        }
        Ok(points)
    }
}

fn mesh_cost(
    elements: [usize; 2],
    second_gradient: bool,
    repetitions: u32,
    rev: &RevCost,
) -> Result<MeshCost, AnyError> {
    let mut problem = problem(elements, second_gradient)?;
    let points = Points::new(problem.gauss_point_count())?;
    let mut unknowns = problem.initial().to_vec();
    unknowns.resize(problem.layout().len(), 0.0);
    let still = vec![0.0; problem.dof_count()];
    let double_stress = vec![0.0; 8 * problem.gauss_point_count()];
    let at = |coordinates| Configuration {
        unknowns: &unknowns,
        stress: &points.stress,
        loads: &[0.0],
        start: assembly::Start {
            coordinates,
            double_stress: &double_stress,
        },
    };
    let coordinates = problem.initial().to_vec();
    let at = at(&coordinates);
    let assemble = || -> Result<(LinearSystem, Vec<f64>), AnyError> {
        let forces = residual(&problem, &at)?.vector;
        let system = tangent(&problem, &at, &points.tangents, &still)?;
        let free = problem.constraints().free.iter();
        Ok((system, free.map(|&dof| forces[dof]).collect()))
    };
    let ((system, rhs), assembly_ms) = timed(repetitions, assemble)?;
    let mut solvers = Vec::new();
    for (name, method) in METHODS {
        let begun = thread_cpu_time();
        problem = problem.solved_by(method)?;
        let analysis_ms = milliseconds_since(begun);
        let (cost, peak_memory) = peak_during(|| -> Result<_, AnyError> {
            let (factors, factorisation_ms) = timed(repetitions, || {
                Ok(problem.solver().factorise(&system.values)?)
            })?;
            let (solution, solution_ms) = timed(repetitions, || Ok(factors.solve(&rhs)?))?;
            Ok((factorisation_ms, solution_ms, solution.relative_residual))
        });
        let (factorisation_ms, solution_ms, residual) = cost?;
        solvers.push(SolverCost {
            name,
            analysis_ms,
            factorisation_ms,
            solution_ms,
            residual,
            peak_memory,
        });
    }
    let iteration_ms =
        assembly_ms.median + solvers[0].factorisation_ms.median + solvers[0].solution_ms.median;
    Ok(MeshCost {
        elements,
        second_gradient,
        unknowns: problem.pattern().size,
        entries: problem.pattern().entry_count(),
        assembly_ms,
        solvers,
        iteration_ms,
        revs: problem.gauss_point_count(),
        share_of_iteration: share(iteration_ms, problem.gauss_point_count(), rev),
    })
}

/// Share of an iteration that its equations take beside the answers of `revs` REVs.
fn share(iteration_ms: f64, revs: usize, rev: &RevCost) -> f64 {
    iteration_ms / (iteration_ms + revs as f64 * rev.mean_ms)
}

fn milliseconds_since(begun: std::time::Duration) -> f64 {
    1e3 * thread_cpu_time().saturating_sub(begun).as_secs_f64()
}

/// The last result of some repetitions, and what they cost.
fn timed<T>(
    repetitions: u32,
    work: impl Fn() -> Result<T, AnyError>,
) -> Result<(T, Spread), AnyError> {
    let mut times = Vec::new();
    let mut once = || {
        let begun = thread_cpu_time();
        let done = work();
        times.push(milliseconds_since(begun));
        done
    };
    let mut done = once()?;
    for _ in 1..repetitions {
        // Let go of the last result first: a run does not hold two factorisations.
        drop(done);
        done = once()?;
    }
    Ok((done, Spread::of(&times).unwrap_or_default()))
}

fn rev_cost() -> Result<RevCost, Failure> {
    /// Up to 0.6 % axial strain.
    const INCREMENTS: u32 = 6;
    let failed = || failed(&format!("a REV of {GRAINS} grains"));
    let mut rev: Rev<2, 1> = standard(GRAINS, 0.0, 1).map_err(|error| failed().because(error))?;
    let settings = Settings {
        tangents: Tangents::Both,
        tolerance: 1e-4,
        ..Settings::default()
    };
    let mut times = Vec::new();
    for _ in 0..INCREMENTS {
        let gradient = [[1.0 + 4e-4, 0.0], [0.0, 1.0 - 1e-3]];
        let mut near = gradient;
        near[0][0] += 2e-5;
        let begun = thread_cpu_time();
        let first =
            respond(&rev, None, &near, &settings).map_err(|error| failed().because(error))?;
        times.push(milliseconds_since(begun));
        let start = Start {
            state: &first.state,
            rotations: &first.rotations,
            trust: Trust::Guess,
        };
        let begun = thread_cpu_time();
        let second = respond(&rev, Some(start), &gradient, &settings)
            .map_err(|error| failed().because(error))?;
        times.push(milliseconds_since(begun));
        rev.state = second.state;
    }
    Ok(RevCost {
        grains: GRAINS,
        answer_ms: Spread::of(&times).unwrap_or_default(),
        mean_ms: times.iter().sum::<f64>() / times.len() as f64,
    })
}

fn text(figures: &Figures) -> String {
    let machine = &figures.machine;
    let mut text = format!(
        "femdem-flow {} on {} ({}), one thread, CPU time\n\n",
        machine.version,
        machine.processor,
        machine.features.join(" ")
    );
    text.push_str("An iteration's equations on a 1×2 specimen of Q8 (milliseconds, medians)\n");
    text.push_str(&table(figures).render("  "));
    text.push_str(&format!(
        "\nAn iteration is assembly, factorisation and solution by the solver of the line; its share is that of an iteration in\nwhich a REV of {} grains answers at each Gauss point, in {:.2} ms on the mean before the peak (median {:.2}).\n",
        figures.rev.grains, figures.rev.mean_ms, figures.rev.answer_ms.median
    ));
    text
}

fn table(figures: &Figures) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("elements", Right),
        ("", Left),
        ("REVs", Right),
        ("unknowns", Right),
        ("entries", Right),
        ("solver", Left),
        ("analysis", Right),
        ("assembly", Right),
        ("factorisation", Right),
        ("solution", Right),
        ("iteration", Right),
        ("share", Right),
        ("residual", Right),
        ("peak MB", Right),
    ]);
    for mesh in &figures.meshes {
        let [nx, ny] = mesh.elements;
        for solver in &mesh.solvers {
            let (factorisation, solution) =
                (solver.factorisation_ms.median, solver.solution_ms.median);
            let iteration = mesh.assembly_ms.median + factorisation + solution;
            let share = share(iteration, mesh.revs, &figures.rev);
            table.row([
                format!("{nx}×{ny}"),
                kind(mesh.second_gradient).to_owned(),
                mesh.revs.to_string(),
                mesh.unknowns.to_string(),
                mesh.entries.to_string(),
                solver.name.to_owned(),
                format!("{:.1}", solver.analysis_ms),
                format!("{:.1}", mesh.assembly_ms.median),
                format!("{factorisation:.1}"),
                format!("{solution:.1}"),
                format!("{iteration:.1}"),
                format!("{:.2} %", 100.0 * share),
                format!("{:.0e}", solver.residual),
                solver
                    .peak_memory
                    .map_or(String::new(), |bytes| format!("{:.0}", 1e-6 * bytes as f64)),
            ]);
        }
    }
    table
}
