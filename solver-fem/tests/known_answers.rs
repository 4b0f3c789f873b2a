//! Problems with a known solution: patch test, Lamé cylinder, Cook's membrane, rigid rotation.

mod common;

use std::sync::Arc;

use common::{at_rest, drive, elastic_step, hold, node_at};
use solver_fem::assembly::residual;
use solver_fem::boundary::{Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Annulus, AnnulusExtent, Mesh, Rectangle};
use solver_fem::newton::MacroState;
use solver_fem::post;
use solver_fem::problem::Problem;
use solver_fem::tensor;

/// All boundary nodes move with u = G·x on a mesh whose inner nodes, mid-side ones included, are
/// off their places: stress must be uniform and inner nodes must follow.
#[test]
fn distorted_elements_pass_the_patch_test() {
    let mut mesh = Mesh::rectangle(&Rectangle {
        size: [2.0, 1.0],
        elements: [3, 3],
    })
    .expect("sound");
    for (number, node) in mesh.nodes.iter_mut().enumerate() {
        let inside = node[0] > 0.0 && node[0] < 2.0 && node[1] > 0.0 && node[1] < 1.0;
        if inside {
            node[0] += 0.05 * (number as f64 * 1.7).sin();
            node[1] += 0.03 * (number as f64 * 2.3).cos();
        }
    }
    // Large strain on purpose: the field is linear, so that the test holds at any size.
    let gradient = [[0.10, 0.30], [-0.05, -0.20]];
    let mut conditions = Vec::new();
    let mut loads = Vec::new();
    for (number, node) in mesh.nodes.clone().into_iter().enumerate() {
        if node[0] > 0.0 && node[0] < 2.0 && node[1] > 0.0 && node[1] < 1.0 {
            continue;
        }
        let name = format!("node {number}");
        mesh.node_sets.insert(name.clone(), vec![number]);
        for i in 0..2 {
            let target = Target::node_set(&name);
            conditions.push(Condition::displacement(target, i, Value::load(loads.len())));
            loads.push(gradient[i][0] * node[0] + gradient[i][1] * node[1]);
        }
    }
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, loads.len()).expect("sound"));
    let law = Elastic::new(100.0, 0.3).expect("stable");
    let start = at_rest(&problem, &law, &vec![0.0; loads.len()]);
    let outcome = elastic_step(&problem, &law, &start, &loads, 1e-13).expect("converges");

    let f = [[1.10, 0.30], [-0.05, 0.80]];
    let exact = law.respond(&[[0.0; 2]; 2], &f).expect("regular").stress;
    for point in problem.gauss_points() {
        let sigma = outcome.state.stress_at(point);
        for i in 0..2 {
            for j in 0..2 {
                assert!((sigma[i][j] - exact[i][j]).abs() < 1e-10);
            }
        }
    }
    for (number, node) in problem.mesh().nodes.iter().enumerate() {
        let u = outcome.state.displacement_of(number);
        for i in 0..2 {
            let expected = gradient[i][0] * node[0] + gradient[i][1] * node[1];
            assert!((u[i] - expected).abs() < 1e-10);
        }
    }
}

/// Error of u_r at the inner wall under inner pressure, relative.
fn lame_error(elements: usize) -> f64 {
    // Small enough to be linear, large enough that the roundoff of positions does not show.
    let (a, b, pressure) = (1.0, 3.0, 1e-5);
    let mesh = Mesh::annulus(&Annulus {
        inner_radius: a,
        outer_radius: b,
        circumferential: elements,
        radial: elements,
        growth: 1.0,
        extent: AnnulusExtent::Quarter,
    })
    .expect("sound");
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
        Condition::pressure("outer", Value::load(1)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 2).expect("sound"));
    let law = Elastic::new(1.0, 0.25).expect("stable");
    let start = at_rest(&problem, &law, &[0.0, 0.0]);
    let outer = 0.4 * pressure;
    let outcome =
        elastic_step(&problem, &law, &start, &[pressure, outer], 1e-8).expect("converges");
    // physics.md §7: A, B with compression positive, u = A r/(2(λ+G)) + B/(2Gr) outward positive
    // for inner pressure once A counts tension.
    let big_a = (pressure * a * a - outer * b * b) / (b * b - a * a);
    let big_b = (pressure - outer) * a * a * b * b / (b * b - a * a);
    let exact = big_a * a / (2.0 * (law.lambda + law.shear)) + big_b / (2.0 * law.shear * a);
    let node = node_at(&problem, a, 0.0);
    (outcome.state.displacement_of(node)[0] / exact - 1.0).abs()
}

#[test]
fn the_lame_cylinder_converges_with_the_order_of_the_element() {
    let (coarse, fine) = (lame_error(4), lame_error(8));
    assert!(fine < 2e-4, "{fine:.2e}");
    assert!(
        coarse / fine > 7.0,
        "order 3 at least: {coarse:.2e} to {fine:.2e}"
    );
}

#[test]
fn the_tip_of_cooks_membrane_comes_up_by_the_known_amount() {
    let mesh = Mesh::mapped([16, 16], |s, t| {
        let bottom = 44.0 * s;
        let height = 44.0 + s * (16.0 - 44.0);
        [48.0 * s, bottom + t * height]
    })
    .expect("sound");
    let conditions = vec![
        hold("left", 0),
        hold("left", 1),
        Condition::traction("right", 1, Value::load(0)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 1).expect("sound"));
    let law = Elastic::new(1.0, 1.0 / 3.0)
        .expect("stable")
        .plane_stress_equivalent();
    let start = at_rest(&problem, &law, &[0.0]);
    let total = 1e-5;
    let outcome = elastic_step(&problem, &law, &start, &[total / 16.0], 1e-6).expect("converges");
    let node = node_at(&problem, 48.0, 52.0);
    let tip = outcome.state.displacement_of(node)[1] / total;
    assert!((tip - 23.96).abs() < 0.03, "{tip}");
    let support = post::boundary_force(
        &problem,
        &Target::boundary("left"),
        &outcome.state.reactions,
    );
    assert!(
        (support[1] / total + 1.0).abs() < 1e-6,
        "the clamp carries the load"
    );
}

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
    let balance = residual(&problem, &turned, &flat, &[pressure]).expect("not inverted");
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
    let before = residual(&problem, problem.initial(), &initial, &[0.0]).expect("sound");
    let after = residual(&problem, &turned, &flat, &[0.0]).expect("sound");
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
