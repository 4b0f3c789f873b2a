//! Bodies with second gradient.

use std::sync::Arc;

use solver_fem::boundary::{Condition, Value};
use solver_fem::elastic::Elastic;
use solver_fem::element::Q8;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::MacroState;
use solver_fem::problem::{Problem, Setup};
use solver_fem::second_gradient::SecondGradient;

use super::{at_rest, drive, elastic_step, hold};

pub const YOUNG: f64 = 100.0;

pub fn law() -> Elastic {
    Elastic::new(YOUNG, 0.3).expect("stable")
}

pub fn rectangle(size: [f64; 2], elements: [usize; 2]) -> Mesh<2> {
    Mesh::rectangle(&Rectangle { size, elements }).expect("sound")
}

pub fn setup(mesh: Mesh<2>, conditions: Vec<Condition>, loads: usize, modulus: f64) -> Setup<2> {
    let second_gradient = SecondGradient::uniform(&mesh, modulus);
    Setup {
        second_gradient,
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, loads)
    }
}

pub fn build(setup: Setup<2>) -> Arc<Problem<2>> {
    Arc::new(Problem::build(setup).expect("sound"))
}

/// Clamped below, pushed down and aside above: no symmetry, nothing uniform.
pub fn sheared(elements: [usize; 2], modulus: f64) -> Arc<Problem<2>> {
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        drive("top", 1, 0),
        drive("top", 0, 1),
        Condition::pressure("right", Value::load(2)),
    ];
    build(setup(
        rectangle([1.0, 2.0], elements),
        conditions,
        3,
        modulus,
    ))
}

pub fn loaded(problem: &Arc<Problem<2>>) -> MacroState<2> {
    let start = at_rest(problem, &law(), &[0.0; 3]);
    let loads = [-0.1, 0.06, 2.0];
    let outcome = elastic_step(problem, &law(), &start, &loads, 1e-11);
    outcome.expect("converges").state
}
