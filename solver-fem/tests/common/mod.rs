//! Shared by the test files: a driver that plays the part of the engine.

#![allow(dead_code, reason = "each test file uses its own part")]

pub mod second_gradient;

use std::sync::Arc;

use solver_fem::boundary::{Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::{MacroState, Request, StepFailure, StepOutcome, StepSettings, StepSolver};
use solver_fem::problem::Problem;
use solver_fem::{ConstitutiveResponse, Tensor2};

pub fn hold(boundary: &str, component: usize) -> Condition {
    Condition::displacement(Target::boundary(boundary), component, Value::Constant(0.0))
}

pub fn drive(boundary: &str, component: usize, load: usize) -> Condition {
    Condition::displacement(Target::boundary(boundary), component, Value::load(load))
}

/// A column of elements of size 1 between rollers, its top driven by load 0.
pub fn column(elements: usize) -> Arc<Problem<2>> {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, elements as f64],
        elements: [1, elements],
    });
    let conditions = vec![
        hold("bottom", 1),
        hold("left", 0),
        hold("right", 0),
        drive("top", 1, 0),
    ];
    let problem = Problem::plane_strain(mesh.expect("sound"), conditions, 1);
    Arc::new(problem.expect("sound"))
}

/// An unstressed elastic body.
pub fn at_rest(problem: &Problem<2>, law: &Elastic, loads: &[f64]) -> MacroState<2> {
    let points = problem.gauss_point_count();
    MacroState::initial(
        problem,
        &vec![[[0.0; 2]; 2]; points],
        &vec![law.tangent(); points],
        loads,
    )
    .expect("fits")
}

/// Answers of the elastic law from the committed stress (pure sweeps).
pub fn elastic_answers(
    law: &Elastic,
    base: &MacroState<2>,
    points: &[(solver_fem::GaussPointId, Tensor2<2>)],
) -> Vec<ConstitutiveResponse<2>> {
    let answer = |(id, f): &(_, _)| law.respond(&base.stress_at(*id), f).expect("regular");
    points.iter().map(answer).collect()
}

/// One step with the elastic law by plain Newton.
pub fn elastic_step(
    problem: &Arc<Problem<2>>,
    law: &Elastic,
    state: &MacroState<2>,
    loads: &[f64],
    tolerance: f64,
) -> Result<StepOutcome<2>, StepFailure> {
    let settings = StepSettings::smooth(tolerance);
    let mut step = StepSolver::begin(problem, state, &state.loads, loads, &settings).expect("fits");
    let mut request = step.next();
    loop {
        request = match request {
            Request::Evaluate(wave) => step.advance(&elastic_answers(law, state, &wave.points)),
            Request::Converged(outcome) => return Ok(*outcome),
            Request::Failed(failure) => return Err(*failure),
        };
    }
}

/// Node closest to a point of the initial mesh.
pub fn node_at(problem: &Problem<2>, x: f64, y: f64) -> usize {
    let distance = |n: usize| {
        let [a, b] = problem.mesh().nodes[n];
        (a - x).hypot(b - y)
    };
    (0..problem.mesh().nodes.len())
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .expect("a mesh has nodes")
}
