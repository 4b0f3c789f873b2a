//! Problems with a known solution that do not depend on the element: rigid rotation, homogeneous biaxial test.

mod common;

use std::sync::Arc;

use common::{drive, elastic_step, hold, node_at};
use solver_fem::assembly::{Configuration, residual};
use solver_fem::boundary::{Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::MacroState;
use solver_fem::post;
use solver_fem::problem::Problem;
use solver_fem::tensor;

/// The whole body turns by 30° with its stress: no force may appear out of nowhere.
#[test]
fn a_rigid_rotation_of_a_stressed_specimen_leaves_no_residual() {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [2, 4],
    })
    .expect("sound");
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        Condition::pressure("left", Value::load(0)),
        Condition::pressure("right", Value::load(0)),
        Condition::pressure("top", Value::load(0)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 1).expect("sound"));
    let law = Elastic::new(100.0, 0.3).expect("stable");
    let pressure = 2.5;
    let stress = [[-pressure, 0.0], [0.0, -pressure]];
    // A deviatoric part too: held by nothing but the rotation itself, so compared, not balanced.
    let (s, c) = (30.0_f64).to_radians().sin_cos();
    let rotation = [[c, -s], [s, c]];
    let turned: Vec<f64> = problem
        .mesh()
        .nodes
        .iter()
        .flat_map(|[x, y]| [c * x - s * y + 0.3, s * x + c * y - 0.1])
        .collect();
    let points = problem.gauss_point_count();
    let f = post::deformation_gradients(&problem, &turned);
    let flat: Vec<f64> = f
        .iter()
        .flat_map(|f| law.respond(&stress, f).expect("regular").stress)
        .flatten()
        .collect();
    let balance = residual(&problem, &Configuration::plain(&turned, &flat, &[pressure]))
        .expect("not inverted");
    assert!(
        balance.free_norm < 1e-13 * balance.external_norm,
        "{:e}",
        balance.free_norm
    );

    let stress = [[-1.0, 0.7], [0.7, -9.0]];
    let initial = vec![stress; points]
        .into_iter()
        .flatten()
        .flatten()
        .collect::<Vec<_>>();
    let flat: Vec<f64> = f
        .iter()
        .flat_map(|f| law.respond(&stress, f).expect("regular").stress)
        .flatten()
        .collect();
    let expected = tensor::rotate(&rotation, &stress);
    for (number, value) in flat.iter().enumerate() {
        assert!((value - expected[number / 2 % 2][number % 2]).abs() < 1e-12);
    }
    let before = residual(
        &problem,
        &Configuration::plain(problem.initial(), &initial, &[0.0]),
    )
    .expect("sound");
    let after = residual(&problem, &Configuration::plain(&turned, &flat, &[0.0])).expect("sound");
    for (b, a) in before.vector.chunks(2).zip(after.vector.chunks(2)) {
        assert!((c * b[0] - s * b[1] - a[0]).abs() < 1e-12);
        assert!((s * b[0] + c * b[1] - a[1]).abs() < 1e-12);
    }
}

/// A uniform body must stay uniform under smooth platens, and its reaction be stress × width.
#[test]
fn a_homogeneous_biaxial_test_stays_homogeneous() {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [3, 5],
    })
    .expect("sound");
    let conditions = vec![
        hold("bottom", 1),
        Condition::displacement(Target::node_set("bottom_mid"), 0, Value::Constant(0.0)),
        drive("top", 1, 0),
        Condition::pressure("left", Value::load(1)),
        Condition::pressure("right", Value::load(1)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 2).expect("sound"));
    let law = Elastic::new(100.0, 0.3).expect("stable");
    let points = problem.gauss_point_count();
    let sigma0 = [[-1.0, 0.0], [0.0, -1.0]];
    let mut state = MacroState::initial(
        &problem,
        &vec![sigma0; points],
        &vec![law.tangent_at(&sigma0); points],
        &[0.0, 1.0],
    )
    .expect("fits");
    for step in 1..=5 {
        let loads = [-0.04 * f64::from(step), 1.0];
        state = elastic_step(&problem, &law, &state, &loads, 1e-12)
            .expect("converges")
            .state;
    }
    let first = state.stress_at(solver_fem::GaussPointId(0));
    for point in problem.gauss_points() {
        let sigma = state.stress_at(point);
        assert!((sigma[0][0] + 1.0).abs() < 1e-9);
        assert!((sigma[1][1] - first[1][1]).abs() < 1e-9 && sigma[0][1].abs() < 1e-9);
    }
    let top = Target::boundary("top");
    let force = post::boundary_force(&problem, &top, &state.reactions)[1];
    let width = 1.0 + state.displacement_of(node_at(&problem, 1.0, 1.0))[0]
        - state.displacement_of(node_at(&problem, 0.0, 1.0))[0];
    assert!((force / (first[1][1] * width) - 1.0).abs() < 1e-9);
    let mean = post::boundary_mean_displacement(&problem, &top, &state.displacement);
    assert!((mean[1] + 0.2).abs() < 1e-15);
}
