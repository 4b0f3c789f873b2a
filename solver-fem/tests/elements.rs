//! Every plane element against what it must be able to do: shape functions that are derivatives of one another, the
//! patch test on distorted meshes, Cook's membrane, Lamé's cylinder with its order of convergence.

mod common;

use std::sync::Arc;

use common::{at_rest, elastic_step, hold, node_at};
use solver_fem::boundary::{Condition, Target, Value};
use solver_fem::elastic::Elastic;
use solver_fem::element::PlaneElement;
use solver_fem::mesh::{Annulus, AnnulusExtent, Mesh, Rectangle};
use solver_fem::post;
use solver_fem::problem::Problem;

/// A grid of Q8 with `per_row` elements a row, as a mesh of `element`.
fn of(element: PlaneElement, grid: Mesh<2>, per_row: usize) -> Mesh<2> {
    match element {
        PlaneElement::Q8 | PlaneElement::Q8Full => grid,
        PlaneElement::Q4 => grid.into_linear(),
        PlaneElement::T6 | PlaneElement::T6Full => grid.into_triangles(per_row),
    }
}

fn problem(
    element: PlaneElement,
    mesh: Mesh<2>,
    conditions: Vec<Condition>,
    loads: usize,
) -> Arc<Problem<2>> {
    Arc::new(Problem::new(mesh, element.element(), conditions, loads).expect("sound"))
}

#[test]
fn a_wrong_sign_in_a_shape_derivative_is_seen() {
    for kind in PlaneElement::ALL {
        let element = kind.element();
        let count = element.node_count();
        assert_eq!(
            (count, element.quadrature().len()),
            (kind.node_count(), kind.point_count())
        );
        let point = [0.31, 0.17];
        let mut gradients = vec![[0.0; 2]; count];
        element.shape_gradients(&point, &mut gradients);
        for direction in 0..2 {
            let h = 1e-6;
            let (mut up, mut down) = (point, point);
            up[direction] += h;
            down[direction] -= h;
            let (mut above, mut below) = (vec![0.0; count], vec![0.0; count]);
            element.shape(&up, &mut above);
            element.shape(&down, &mut below);
            for a in 0..count {
                let difference = (above[a] - below[a]) / (2.0 * h);
                let error = (difference - gradients[a][direction]).abs();
                assert!(error < 1e-9, "{kind:?}, node {a}: {error:e}");
            }
        }
    }
}

#[test]
fn shape_functions_are_one_at_their_own_node_only_and_corners_come_first() {
    for kind in PlaneElement::ALL {
        let element = kind.element();
        let nodes = element.node_positions();
        assert_eq!(nodes.len(), element.node_count());
        for (a, node) in nodes.iter().enumerate() {
            let mut values = vec![0.0; nodes.len()];
            element.shape(node, &mut values);
            for (b, value) in values.into_iter().enumerate() {
                assert_eq!(value, if a == b { 1.0 } else { 0.0 }, "{kind:?}");
            }
        }
        // The ends of the sides are the corners, one after the other.
        for facet in 0..element.facet_count() {
            let ends = &element.facet_nodes(facet)[..2];
            assert_eq!(ends, [facet, (facet + 1) % element.corner_count()]);
        }
        let area: f64 = element.quadrature().iter().map(|p| p.weight).sum();
        let exact = if element.corner_count() == 3 {
            0.5
        } else {
            4.0
        };
        assert!((area - exact).abs() < 1e-15);
    }
}

/// Fields in pictures and files are carried to the nodes; a linear one must arrive unchanged.
#[test]
fn extrapolation_to_the_nodes_keeps_a_linear_field() {
    for kind in PlaneElement::ALL {
        let element = kind.element();
        let field = |[x, y]: [f64; 2]| 2.0 - x + 0.5 * y;
        let values: Vec<f64> = element.quadrature().iter().map(|p| field(p.xi)).collect();
        let matrix = element.extrapolation();
        for (row, node) in matrix.chunks(values.len()).zip(element.node_positions()) {
            let found: f64 = row.iter().zip(&values).map(|(m, v)| m * v).sum();
            assert!((found - field(*node)).abs() < 1e-14, "{kind:?}: {found}");
        }
    }
}

#[test]
fn a_grid_keeps_its_area_boundaries_and_pieces_whatever_its_elements() {
    for kind in PlaneElement::ALL {
        let ring = Mesh::annulus(&Annulus {
            inner_radius: 1.0,
            outer_radius: 3.0,
            circumferential: 12,
            radial: 3,
            growth: 1.4,
            extent: AnnulusExtent::Full,
        });
        let mesh = of(kind, ring.expect("sound"), 3);
        let element = kind.element();
        assert_eq!(mesh.check(element.as_ref()), vec![], "{kind:?}");
        assert_eq!(mesh.check_conformity(element.as_ref()), vec![], "{kind:?}");
        let sides = mesh.sides(element.as_ref());
        let open = sides.values().filter(|users| users.len() == 1).count();
        assert_eq!(
            open, 24,
            "{kind:?}: the two circles and nothing else is open"
        );
        for (name, radius) in [("inner", 1.0), ("outer", 3.0)] {
            assert_eq!(mesh.boundaries[name].len(), 12);
            for facet in &mesh.boundaries[name] {
                for &a in element.facet_nodes(facet.local) {
                    let [x, y] = mesh.nodes[mesh.element(facet.element)[a]];
                    assert!((x.hypot(y) - radius).abs() < 1e-14, "{kind:?} {name}");
                }
            }
        }
    }
}

/// All boundary nodes move with u = G·x on a mesh whose inner nodes, mid-side ones included, are off their places:
/// stress must be uniform and inner nodes must follow. Large strain on purpose: the field is linear, so that the test
/// holds at any size.
#[test]
fn distorted_elements_pass_the_patch_test() {
    for kind in PlaneElement::ALL {
        let grid = Mesh::rectangle(&Rectangle {
            size: [2.0, 1.0],
            elements: [3, 3],
        });
        let mut mesh = of(kind, grid.expect("sound"), 3);
        let is_inside = |[x, y]: [f64; 2]| x > 0.0 && x < 2.0 && y > 0.0 && y < 1.0;
        for (number, node) in mesh.nodes.iter_mut().enumerate() {
            if is_inside(*node) {
                node[0] += 0.04 * (number as f64 * 1.7).sin();
                node[1] += 0.025 * (number as f64 * 2.3).cos();
            }
        }
        let gradient = [[0.10, 0.30], [-0.05, -0.20]];
        let mut conditions = Vec::new();
        let mut loads = Vec::new();
        for (number, node) in mesh.nodes.clone().into_iter().enumerate() {
            if is_inside(node) {
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
        let problem = problem(kind, mesh, conditions, loads.len());
        let law = Elastic::new(100.0, 0.3).expect("stable");
        let start = at_rest(&problem, &law, &vec![0.0; loads.len()]);
        let outcome = elastic_step(&problem, &law, &start, &loads, 1e-13).expect("converges");
        let f = [[1.10, 0.30], [-0.05, 0.80]];
        let exact = law.respond(&[[0.0; 2]; 2], &f).expect("regular").stress;
        for point in problem.gauss_points() {
            let sigma = outcome.state.stress_at(point);
            for i in 0..2 {
                for j in 0..2 {
                    let error = (sigma[i][j] - exact[i][j]).abs();
                    assert!(error < 1e-10, "{kind:?}: {error:e}");
                }
            }
        }
        for (number, node) in problem.mesh().nodes.iter().enumerate() {
            let u = outcome.state.displacement_of(number);
            for i in 0..2 {
                let expected = gradient[i][0] * node[0] + gradient[i][1] * node[1];
                assert!((u[i] - expected).abs() < 1e-10, "{kind:?}");
            }
        }
    }
}

/// Error of u_r at the inner wall under inner and outer pressure, relative.
fn lame_error(kind: PlaneElement, elements: usize) -> f64 {
    // Large enough that the roundoff of positions does not show. What is not linear in it, relative 1e-5, is as large
    // as the error of a fine mesh and cancels between pressure and suction.
    let (a, b, pressure) = (1.0, 3.0, 1e-5);
    let ring = Mesh::annulus(&Annulus {
        inner_radius: a,
        outer_radius: b,
        circumferential: elements,
        radial: elements,
        growth: 1.0,
        extent: AnnulusExtent::Quarter,
    });
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
        Condition::pressure("outer", Value::load(1)),
    ];
    let problem = problem(
        kind,
        of(kind, ring.expect("sound"), elements),
        conditions,
        2,
    );
    let law = Elastic::new(1.0, 0.25).expect("stable");
    let start = at_rest(&problem, &law, &[0.0, 0.0]);
    let outer = 0.4 * pressure;
    let node = node_at(&problem, a, 0.0);
    let moved = |sign: f64| {
        let loads = [sign * pressure, sign * outer];
        let outcome = elastic_step(&problem, &law, &start, &loads, 1e-8).expect("converges");
        outcome.state.displacement_of(node)[0]
    };
    // u = A r/(2(λ+G)) + B/(2Gr), outward positive.
    let big_a = (pressure * a * a - outer * b * b) / (b * b - a * a);
    let big_b = (pressure - outer) * a * a * b * b / (b * b - a * a);
    let exact = big_a * a / (2.0 * (law.lambda + law.shear)) + big_b / (2.0 * law.shear * a);
    (0.5 * (moved(1.0) - moved(-1.0)) / exact - 1.0).abs()
}

/// Displacements at a node converge with h² for linear and at least h³ for quadratic elements.
#[test]
fn the_lame_cylinder_converges_with_the_order_of_each_element() {
    for (kind, order, bound) in [
        (PlaneElement::Q4, 1.8, 2e-2),
        (PlaneElement::T6, 2.7, 2e-3),
        (PlaneElement::T6Full, 2.7, 2e-3),
        (PlaneElement::Q8, 3.5, 1e-4),
        (PlaneElement::Q8Full, 3.5, 1e-4),
    ] {
        let errors = [4, 8, 16].map(|n| lame_error(kind, n));
        let found = (errors[1] / errors[2]).log2();
        println!("Lamé {kind:?}: errors {errors:?}, order {found:.2}");
        assert!(errors[1] < bound, "{kind:?}: {errors:?}");
        assert!(found > order, "{kind:?}: {errors:?}, order {found:.2}");
    }
}

/// Deflection of the tip of Cook's membrane for a unit shear force; 23.96 is the value of fine meshes.
fn cook(kind: PlaneElement, elements: usize) -> f64 {
    let grid = Mesh::mapped([elements, elements], |s, t| {
        let bottom = 44.0 * s;
        let height = 44.0 + s * (16.0 - 44.0);
        [48.0 * s, bottom + t * height]
    });
    let conditions = vec![
        hold("left", 0),
        hold("left", 1),
        Condition::traction("right", 1, Value::load(0)),
    ];
    let problem = problem(
        kind,
        of(kind, grid.expect("sound"), elements),
        conditions,
        1,
    );
    let law = Elastic::new(1.0, 1.0 / 3.0)
        .expect("stable")
        .plane_stress_equivalent();
    let start = at_rest(&problem, &law, &[0.0]);
    let total = 1e-5;
    let outcome = elastic_step(&problem, &law, &start, &[total / 16.0], 1e-6).expect("converges");
    let left = Target::boundary("left");
    let support = post::boundary_force(&problem, &left, &outcome.state.reactions);
    assert!(
        (support[1] / total + 1.0).abs() < 1e-6,
        "the clamp carries the load"
    );
    outcome.state.displacement_of(node_at(&problem, 48.0, 52.0))[1] / total
}

#[test]
fn cooks_membrane_comes_up_by_the_known_amount_and_q4_lags_behind() {
    let reference = 23.96;
    for (kind, bounds) in [
        (PlaneElement::Q4, [0.51, 0.24, 0.08]),
        (PlaneElement::T6, [0.08, 0.02, 0.005]),
        (PlaneElement::T6Full, [0.08, 0.02, 0.005]),
        (PlaneElement::Q8, [0.06, 0.02, 0.005]),
        (PlaneElement::Q8Full, [0.06, 0.02, 0.005]),
    ] {
        let tips = [2, 4, 8].map(|n| cook(kind, n));
        println!("Cook {kind:?}: 2, 4, 8 elements a side: {tips:.3?}");
        for (tip, bound) in tips.into_iter().zip(bounds) {
            assert!(
                (tip / reference - 1.0).abs() < bound,
                "{kind:?}: {tips:.3?}"
            );
        }
    }
    // What locking means in figures: the values that the literature gives for this element.
    for (elements, published) in [(2, 11.845), (4, 18.299), (8, 22.079)] {
        let tip = cook(PlaneElement::Q4, elements);
        assert!((tip - published).abs() < 1e-3, "{elements}: {tip}");
    }
}
