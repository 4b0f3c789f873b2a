//! The stiffness is the derivative of the residual, follower pressure included, at finite strain.

mod common;

use solver_fem::assembly::{Configuration, residual, tangent};
use solver_fem::boundary::{Condition, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::post;
use solver_fem::problem::Problem;

#[test]
fn a_missing_term_of_the_linearisation_is_seen() {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 1.0],
        elements: [2, 2],
    })
    .expect("sound");
    let conditions = vec![
        common::hold("bottom", 0),
        common::hold("bottom", 1),
        Condition::pressure("top", Value::Constant(7.0)),
        Condition::pressure("right", Value::load(0)),
        Condition::traction("left", 1, Value::Constant(3.0)),
    ];
    let problem = Problem::plane_strain(mesh, conditions, 1).expect("sound");
    let law = Elastic::new(100.0, 0.3).expect("stable");
    let initial_stress = [[-4.0, 1.5], [1.5, -9.0]];
    let loads = [11.0];

    // A field far from the initial mesh.
    let coordinates: Vec<f64> = problem
        .mesh()
        .nodes
        .iter()
        .flat_map(|[x, y]| {
            [
                x + 0.2 * y + 0.1 * (3.0 * x * y).sin(),
                y - 0.15 * x * y + 0.05 * (2.0 * x).cos(),
            ]
        })
        .collect();
    let answers = |coordinates: &[f64]| -> Vec<_> {
        post::deformation_gradients(&problem, coordinates)
            .iter()
            .map(|f| law.respond(&initial_stress, f).expect("regular"))
            .collect()
    };
    let balance = |coordinates: &[f64]| {
        let stress: Vec<f64> = answers(coordinates)
            .iter()
            .flat_map(|r| r.stress)
            .flatten()
            .collect();
        residual(
            &problem,
            &Configuration::plain(coordinates, &stress, &loads),
        )
        .expect("not inverted")
        .vector
    };
    let here = answers(&coordinates);
    let stress: Vec<f64> = here.iter().flat_map(|r| r.stress).flatten().collect();
    let tangents: Vec<f64> = here
        .iter()
        .flat_map(|r| r.tangent)
        .flatten()
        .flatten()
        .flatten()
        .collect();

    // A direction that moves free and prescribed components alike.
    let direction: Vec<f64> = (0..problem.dof_count())
        .map(|dof| (dof as f64 * 0.7).sin())
        .collect();
    let system = tangent(
        &problem,
        &Configuration::plain(&coordinates, &stress, &loads),
        &tangents,
        &direction,
    )
    .expect("not inverted");
    let free = &problem.constraints().free;
    let moving: Vec<f64> = free.iter().map(|&dof| direction[dof]).collect();
    let mut predicted = problem.pattern().multiply(&system.values, &moving);
    for (value, prescribed) in predicted.iter_mut().zip(&system.prescribed) {
        *value += prescribed;
    }
    let h = 1e-6;
    let moved = |sign: f64| -> Vec<f64> {
        let moved: Vec<f64> = coordinates
            .iter()
            .zip(&direction)
            .map(|(x, d)| x + sign * h * d)
            .collect();
        balance(&moved)
    };
    let (up, down) = (moved(1.0), moved(-1.0));
    let scale = predicted.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
    for (equation, &dof) in free.iter().enumerate() {
        let difference = (up[dof] - down[dof]) / (2.0 * h);
        assert!(
            (difference - predicted[equation]).abs() < 1e-8 * scale,
            "equation {equation}: {difference} against {}",
            predicted[equation]
        );
    }
}
