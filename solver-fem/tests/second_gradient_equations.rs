//! Second gradient: the equations, whatever the material.

mod common;

use common::second_gradient::{YOUNG, build, law, loaded, rectangle, setup, sheared};
use common::{at_rest, elastic_step, hold};
use nalgebra::DMatrix;
use solver_fem::assembly::{Configuration, Start, element_tangent, residual, tangent};
use solver_fem::boundary::{Condition, Value};
use solver_fem::element::PlaneElement;
use solver_fem::layout::Field;
use solver_fem::mesh::Mesh;
use solver_fem::second_gradient::double_stresses;
use solver_fem::tensor::{self, Tensor3};

/// A missing term of the tangent would cost the quadratic convergence, silently.
#[test]
fn the_tangent_is_the_derivative_of_all_rows() {
    let mut mesh = rectangle([1.0, 1.0], [2, 2]);
    for node in &mut mesh.nodes {
        if *node == [0.5, 0.5] {
            *node = [0.55, 0.46];
        }
    }
    // A region without second gradient beside one with it.
    mesh.assign_region("plain", &[3]).expect("exists");
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        Condition::pressure("right", Value::load(0)),
    ];
    let mut setup = setup(mesh, conditions, 1, 8.0);
    setup.second_gradient.moduli[1] = 0.0;
    let problem = build(setup);
    let stress = [[-4.0, 1.5], [1.5, -9.0]];
    let loads = [11.0];
    let points = problem.gauss_point_count();
    let chi: Vec<f64> = (0..8 * points).map(|n| (n as f64).sin()).collect();
    let start = Start {
        coordinates: problem.initial(),
        double_stress: &chi,
    };
    let answers = |unknowns: &[f64]| -> Vec<_> {
        let coordinates = &unknowns[..problem.dof_count()];
        let f = solver_fem::post::deformation_gradients(&problem, coordinates);
        f.iter()
            .map(|f| law().respond(&stress, f).expect("regular"))
            .collect()
    };
    let flat = |unknowns: &[f64]| -> Vec<f64> {
        let answers = answers(unknowns);
        answers.iter().flat_map(|r| r.stress).flatten().collect()
    };
    let balance = |unknowns: &[f64]| {
        let at = Configuration {
            unknowns,
            stress: &flat(unknowns),
            loads: &loads,
            start,
        };
        residual(&problem, &at).expect("not inverted").vector
    };
    let mut unknowns: Vec<f64> = problem
        .mesh()
        .nodes
        .iter()
        .flat_map(|[x, y]| {
            [
                x + 0.2 * y + 0.05 * (3.0 * x * y).sin(),
                y - 0.1 * x * y + 0.03 * (2.0 * x).cos(),
            ]
        })
        .collect();
    let layout = problem.layout();
    for dof in layout.displacement_count()..layout.len() {
        let size = if layout.field(dof) == Field::Gradient {
            0.2
        } else {
            20.0
        };
        unknowns.push(size * (dof as f64 * 1.3).sin());
    }
    let tangents: Vec<f64> = answers(&unknowns)
        .iter()
        .flat_map(|r| r.tangent)
        .flatten()
        .flatten()
        .flatten()
        .collect();
    let free = &problem.constraints().free;
    let mut direction = vec![0.0; layout.len()];
    for dof in 0..layout.len() {
        let moves = layout.field(dof) == Field::Displacement
            || problem.constraints().equation[dof].is_some();
        if moves {
            direction[dof] = (dof as f64 * 0.7).sin();
        }
    }
    let stress_here = flat(&unknowns);
    let at = Configuration {
        unknowns: &unknowns,
        stress: &stress_here,
        loads: &loads,
        start,
    };
    let system = tangent(&problem, &at, &tangents, &direction).expect("not inverted");
    let moving: Vec<f64> = free.iter().map(|&dof| direction[dof]).collect();
    let mut predicted = problem.pattern().multiply(&system.values, &moving);
    for (value, prescribed) in predicted.iter_mut().zip(&system.prescribed) {
        *value += prescribed;
    }
    let h = 1e-6;
    let moved = |sign: f64| -> Vec<f64> {
        let moved = unknowns.iter().zip(&direction);
        balance(&moved.map(|(x, d)| x + sign * h * d).collect::<Vec<_>>())
    };
    let (up, down) = (moved(1.0), moved(-1.0));
    for field in [Field::Displacement, Field::Gradient, Field::Multiplier] {
        let rows = || (0..free.len()).filter(|&row| layout.field(free[row]) == field);
        assert!(rows().count() > 4);
        let scale = rows().fold(0.0_f64, |max, row| max.max(predicted[row].abs()));
        for row in rows() {
            let difference = (up[free[row]] - down[free[row]]) / (2.0 * h);
            assert!(
                (difference - predicted[row]).abs() < 1e-8 * scale,
                "{}: {difference} against {}",
                layout.describe(free[row]),
                predicted[row]
            );
        }
    }
}

/// Number of motions without stiffness of a dense tangent.
fn zero_modes(matrix: DMatrix<f64>) -> usize {
    let values = matrix.svd(false, false).singular_values;
    let largest = values.iter().copied().fold(0.0, f64::max);
    values
        .iter()
        .filter(|&&value| value < 1e-10 * largest)
        .count()
}

/// Motions without stiffness of every element alone, and of the whole mesh, at rest.
fn motions(kind: PlaneElement, mesh: Mesh<2>) -> (Vec<usize>, usize) {
    let mut given = setup(
        mesh,
        vec![hold("bottom", 0), hold("bottom", 1)],
        0,
        0.3 * YOUNG,
    );
    given.element = kind.element();
    let problem = build(given);
    let points = problem.gauss_point_count();
    let stress = vec![0.0; 4 * points];
    let state = at_rest(&problem, &law(), &[]);
    let unknowns = state.unknowns();
    let at = Configuration {
        stress: &stress,
        ..state.configuration(&unknowns, &[])
    };
    let layout = problem.layout();
    let mut assembled = DMatrix::<f64>::zeros(layout.len(), layout.len());
    let mut alone = Vec::new();
    for element in 0..problem.mesh().element_count() {
        let mut matrix = Vec::new();
        element_tangent(&problem, &at, &state.elastic_tangents, element, &mut matrix)
            .expect("not inverted");
        let dofs = layout.element_dofs(problem.mesh(), element);
        let matrix = DMatrix::from_row_slice(dofs.len(), dofs.len(), &matrix);
        for row in 0..dofs.len() {
            for column in 0..dofs.len() {
                assembled[(dofs[row], dofs[column])] += matrix[(row, column)];
            }
        }
        alone.push(zero_modes(matrix));
    }
    (alone, zero_modes(assembled))
}

/// An element with too many of them needs a crutch, one with too few locks.
#[test]
fn a_mesh_has_the_three_rigid_motions_and_no_other_whatever_one_element_has() {
    for kind in [PlaneElement::Q8, PlaneElement::Q8Full] {
        let (alone, assembled) = motions(kind, rectangle([1.0, 2.0], [1, 2]));
        let (_, larger) = motions(kind, rectangle([1.0, 2.0], [2, 3]));
        // The third rule takes away the spurious mode that two points a direction leave to one element.
        let expected = if kind == PlaneElement::Q8 { 8 } else { 7 };
        assert_eq!(alone, vec![expected; 2]);
        assert_eq!((assembled, larger), (3, 3));
    }
    for kind in [PlaneElement::T6, PlaneElement::T6Full] {
        for size in [[1, 1], [2, 3]] {
            let mesh = rectangle([1.0, 2.0], size).into_triangles(size[0]);
            let (alone, assembled) = motions(kind, mesh);
            assert!(alone.iter().all(|&count| count == 7), "{kind:?}: {alone:?}");
            assert_eq!(assembled, 3, "{kind:?} {size:?}");
        }
    }
}

fn turned_back(values: &[f64]) -> [f64; 4] {
    [values[0], values[1], values[2], values[3]]
}

/// The body turns by 50° with all its stresses: no force may appear, and χ must have turned.
#[test]
fn a_rigid_rotation_of_a_stressed_body_turns_its_double_stresses_and_nothing_else() {
    let problem = sheared([2, 4], 0.05 * YOUNG);
    let state = loaded(&problem);
    let (s, c) = 50.0_f64.to_radians().sin_cos();
    let rotation = [[c, -s], [s, c]];
    let layout = problem.layout();
    let before = state.unknowns();
    let here = residual(&problem, &state.configuration(&before, &[0.0; 3])).expect("sound");

    let mut unknowns: Vec<f64> = state
        .coordinates
        .chunks(2)
        .flat_map(|x| [c * x[0] - s * x[1] + 0.3, s * x[0] + c * x[1] - 0.1])
        .collect();
    // v = H = I − Rᵀ, the same at every corner.
    let v = [1.0 - c, -s, s, 1.0 - c];
    for _ in 0..layout.gradient_count() / 4 {
        unknowns.extend(v);
    }
    let turn = |t: &[f64]| -> Vec<f64> {
        let t = [[t[0], t[1]], [t[2], t[3]]];
        tensor::rotate(&rotation, &t)
            .into_iter()
            .flatten()
            .collect()
    };
    let multipliers = before[layout.len() - layout.multiplier_count()..].chunks(4);
    unknowns.extend(multipliers.flat_map(turn));
    let stress: Vec<f64> = state.stress.chunks(4).flat_map(turn).collect();
    let at = Configuration {
        unknowns: &unknowns,
        stress: &stress,
        loads: &[0.0; 3],
        start: state.start(),
    };
    let there = residual(&problem, &at).expect("sound");
    assert!(there.mismatch.expect("second gradient") < 1e-14);
    let forces = layout.displacement_count();
    for (before, after) in here
        .vector
        .chunks(2)
        .zip(there.vector.chunks(2))
        .take(forces / 2)
    {
        assert!((c * before[0] - s * before[1] - after[0]).abs() < 1e-11 * here.internal_norm);
        assert!((s * before[0] + c * before[1] - after[1]).abs() < 1e-11 * here.internal_norm);
    }
    let doubled = |balance: &[f64]| -> Vec<[f64; 4]> {
        let rows = &balance[forces..forces + layout.gradient_count()];
        rows.chunks(4).map(turned_back).collect()
    };
    for (before, after) in doubled(&here.vector).iter().zip(doubled(&there.vector)) {
        for (expected, found) in turn(before).iter().zip(after) {
            assert!((expected - found).abs() < 1e-11 * here.internal_norm);
        }
    }

    let third = |flat: &[f64]| -> Tensor3<2> {
        let mut t = [[[0.0; 2]; 2]; 2];
        for (place, value) in t.iter_mut().flatten().flatten().zip(flat) {
            *place = *value;
        }
        t
    };
    let found = double_stresses(&problem, &at).expect("sound");
    let largest = found.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    assert!(largest > 0.1, "there is something to turn");
    let committed = &state
        .second_gradient
        .as_ref()
        .expect("carried")
        .double_stress;
    for (before, after) in committed.chunks(8).zip(found.chunks(8)) {
        let expected = tensor::rotate3(&rotation, &third(before));
        for (expected, found) in expected.iter().flatten().flatten().zip(after) {
            assert!((expected - found).abs() < 1e-12 * largest);
        }
    }
}

/// Residuals of a large step: each is the square of the one before, up to a factor.
#[test]
fn newton_converges_quadratically_with_second_gradient() {
    let problem = sheared([2, 4], 0.05 * YOUNG);
    let mut state = loaded(&problem);
    for step in 2..4 {
        let loads = [-0.1, 0.06, 2.0].map(|load| load * f64::from(step));
        let outcome = elastic_step(&problem, &law(), &state, &loads, 1e-11).expect("converges");
        let found: Vec<f64> = outcome.sweeps.iter().map(|sweep| sweep.residual).collect();
        assert!(found.len() <= 6, "{found:?}");
        for pair in found.windows(2) {
            assert!(pair[1] < 10.0 * pair[0] * pair[0] + 1e-12, "{found:?}");
        }
        let ties: Vec<f64> = outcome.sweeps.iter().filter_map(|s| s.mismatch).collect();
        assert_eq!(ties.len(), found.len());
        assert!(ties[ties.len() - 1] < 1e-11, "{ties:?}");
        state = outcome.state;
    }
}
