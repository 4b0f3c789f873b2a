//! A body under its own weight, against the column whose answer is known: what is forgotten or counted twice here makes a
//! slope or a foundation safe on paper.

mod common;

use std::sync::Arc;

use common::{at_rest, elastic_step, hold};
use solver_fem::boundary::{BoundaryProblem, Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::element::PlaneElement;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::MacroState;
use solver_fem::problem::Problem;

const SIZE: [f64; 2] = [1.0, 2.0];
const YOUNG: f64 = 100.0;
const POISSON: f64 = 0.3;

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// A regular grid.
    Regular,
    /// Inner corners off their places, sides straight with their nodes in the middle.
    Distorted,
}

fn mesh(kind: PlaneElement, shape: Shape) -> Mesh<2> {
    let grid = Mesh::rectangle(&Rectangle {
        size: SIZE,
        elements: [3, 4],
    });
    let grid = grid.expect("sound");
    let mut mesh = match kind {
        PlaneElement::Q8 | PlaneElement::Q8Full => grid,
        PlaneElement::Q4 => grid.into_linear(),
        PlaneElement::T6 | PlaneElement::T6Full => grid.into_triangles(3),
    };
    if shape == Shape::Regular {
        return mesh;
    }
    let element = kind.element();
    let corners = element.corner_count();
    let mut moved = vec![false; mesh.nodes.len()];
    for e in 0..mesh.element_count() {
        for &node in &mesh.element(e)[..corners].to_vec() {
            let [x, y] = mesh.nodes[node];
            let inside = x > 0.0 && x < SIZE[0] && y > 0.0 && y < SIZE[1];
            if inside && !std::mem::replace(&mut moved[node], true) {
                mesh.nodes[node][0] += 0.05 * (node as f64 * 1.7).sin();
                mesh.nodes[node][1] += 0.07 * (node as f64 * 2.3).cos();
            }
        }
    }
    for e in 0..mesh.element_count() {
        let nodes = mesh.element(e).to_vec();
        for facet in 0..element.facet_count() {
            if let [a, b, middle] = *element.facet_nodes(facet) {
                let [a, b] = [nodes[a], nodes[b]].map(|node| mesh.nodes[node]);
                mesh.nodes[nodes[middle]] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            }
        }
    }
    mesh
}

/// Between smooth walls, on a smooth floor, open at the top; `loads` are the components of the body force.
fn column(kind: PlaneElement, shape: Shape) -> Arc<Problem<2>> {
    let conditions = vec![
        hold("left", 0),
        hold("right", 0),
        hold("bottom", 1),
        Condition::body_force(0, Value::load(0)),
        Condition::body_force(1, Value::load(1)),
    ];
    let mesh = mesh(kind, shape);
    Arc::new(Problem::new(mesh, kind.element(), conditions, 2).expect("sound"))
}

fn under(problem: &Arc<Problem<2>>, force: [f64; 2], tolerance: f64) -> MacroState<2> {
    let law = Elastic::new(YOUNG, POISSON).expect("stable");
    let start = at_rest(problem, &law, &[0.0; 2]);
    let outcome = elastic_step(problem, &law, &start, &force, tolerance);
    outcome.expect("converges").state
}

/// Force of all supports on the body.
fn support(problem: &Problem<2>, state: &MacroState<2>) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for one in &problem.constraints().prescribed {
        sum[one.dof % 2] += state.reactions[one.dof];
    }
    sum
}

/// σ_yy = −γ (H − y), σ_xx = ν/(1 − ν) σ_yy, u_y = −γ/M (H y − y²/2) with the oedometric modulus M: elements with a
/// quadratic field have it exactly where their sides are straight and halved, quadrilaterals only as parallelograms.
#[test]
fn a_column_under_its_own_weight_has_a_stress_linear_in_depth() {
    let weight = 1e-3;
    let modulus = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let exact = |shape| {
        let kinds = PlaneElement::ALL.into_iter();
        kinds.filter(move |kind| match kind {
            PlaneElement::T6 | PlaneElement::T6Full => true,
            PlaneElement::Q8 | PlaneElement::Q8Full => shape == Shape::Regular,
            PlaneElement::Q4 => false,
        })
    };
    for shape in [Shape::Regular, Shape::Distorted] {
        for kind in exact(shape) {
            let problem = column(kind, shape);
            // What is not linear in the weight is the same for its opposite.
            let down = under(&problem, [0.0, -weight], 1e-9);
            let up = under(&problem, [0.0, weight], 1e-9);
            let places = problem.gauss_point_positions(problem.initial());
            for (point, [_, y]) in problem.gauss_points().zip(places) {
                let depth = SIZE[1] - y;
                let [a, b] = [&down, &up].map(|state| state.stress_at(point));
                let lateral = POISSON / (1.0 - POISSON);
                for (i, j, over_depth) in [(1, 1, 1.0), (0, 0, lateral), (0, 1, 0.0)] {
                    let sigma = 0.5 * (a[i][j] - b[i][j]);
                    let error = (sigma + weight * depth * over_depth).abs() / (weight * SIZE[1]);
                    assert!(error < 1e-8, "{kind:?}, σ_{i}{j}: {error:e}");
                }
            }
            for (node, [_, y]) in problem.mesh().nodes.iter().enumerate() {
                let [a, b] = [&down, &up].map(|state| state.displacement_of(node)[1]);
                let expected = -weight / modulus * (SIZE[1] * y - 0.5 * y * y);
                let error = (0.5 * (a - b) - expected).abs() / (weight / modulus);
                assert!(error < 1e-7, "{kind:?}: {error:e}");
            }
        }
    }
}

/// On every element and mesh, also where the column has lost a fifth of its height: the supports bear the weight that the
/// body had at the beginning, as mass goes nowhere.
#[test]
fn supports_bear_the_whole_weight_however_far_the_body_deforms() {
    for shape in [Shape::Regular, Shape::Distorted] {
        for kind in PlaneElement::ALL {
            let problem = column(kind, shape);
            for size in [10.0, 30.0] {
                let force = [0.3 * size, -size];
                let state = under(&problem, force, 1e-13);
                let volume = SIZE[0] * SIZE[1];
                let found = support(&problem, &state);
                for i in 0..2 {
                    let error = (found[i] / (force[i] * volume) + 1.0).abs();
                    assert!(error < 1e-12, "{kind:?}, component {i}: {error:e}");
                }
                if size > 20.0 {
                    let top = common::node_at(&problem, 0.5, SIZE[1]);
                    let settled = -state.displacement_of(top)[1] / SIZE[1];
                    assert!(settled > 0.1, "{kind:?}: {settled}");
                }
            }
        }
    }
}

/// Two forces on the same component add up, a constant one and one that follows a load.
#[test]
fn body_forces_add_up() {
    let problem = |forces: Vec<Condition>| {
        let mut conditions = vec![hold("bottom", 0), hold("bottom", 1)];
        conditions.extend(forces);
        let mesh = mesh(PlaneElement::Q8, Shape::Regular);
        Arc::new(Problem::plane_strain(mesh, conditions, 2).expect("sound"))
    };
    let at = |problem: &Problem<2>, loads: &[f64]| {
        let initial = problem.initial();
        problem
            .external_loads()
            .forces::<2>(initial, initial, loads)
    };
    let one = problem(vec![Condition::body_force(1, Value::load(1))]);
    let two = problem(vec![
        Condition::body_force(1, Value::Constant(-2.0)),
        Condition::body_force(1, Value::load(0)),
    ]);
    let (one, two) = (at(&one, &[7.0, -5.0]), at(&two, &[-3.0, 7.0]));
    for (a, b) in one.iter().zip(&two) {
        assert!((a - b).abs() < 1e-15, "{a} {b}");
    }
}

#[test]
fn a_body_force_that_cannot_be_meant_is_refused() {
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        Condition::body_force(2, Value::Constant(-1.0)),
        Condition::body_force(1, Value::load(1)),
        Condition::body_force(0, Value::Constant(f64::INFINITY)),
        Condition::displacement(Target::boundary("top"), 1, Value::load(0)),
    ];
    let mesh = mesh(PlaneElement::Q8, Shape::Regular);
    let faults = Problem::plane_strain(mesh, conditions, 1)
        .err()
        .map(|error| error.boundary);
    assert_eq!(
        faults.unwrap_or_default(),
        vec![
            BoundaryProblem::UnknownComponent {
                condition: 2,
                component: 2,
                dimension: 2
            },
            BoundaryProblem::UnknownLoad {
                condition: 3,
                index: 1,
                count: 1
            },
            BoundaryProblem::NonFiniteValue { condition: 4 },
        ]
    );
}
