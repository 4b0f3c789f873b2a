//! Second gradient: the equations and what they must never do, whatever the material.

mod common;

use std::sync::Arc;

use common::{at_rest, drive, elastic_answers, elastic_step, hold, node_at};
use nalgebra::DMatrix;
use solver_fem::assembly::{Configuration, Start, element_tangent, residual, tangent};
use solver_fem::boundary::{Condition, Target, Tie, Value};
use solver_fem::elastic::Elastic;
use solver_fem::element::{PlaneElement, Q8};
use solver_fem::layout::Field;
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::newton::{MacroState, Request, StepSettings, StepSolver};
use solver_fem::problem::{Problem, ProblemError, Setup};
use solver_fem::second_gradient::{SecondGradient, Side, SideProblem, double_stresses};
use solver_fem::tensor::{self, Tensor2, Tensor3};

const YOUNG: f64 = 100.0;

fn law() -> Elastic {
    Elastic::new(YOUNG, 0.3).expect("stable")
}

fn rectangle(size: [f64; 2], elements: [usize; 2]) -> Mesh<2> {
    Mesh::rectangle(&Rectangle { size, elements }).expect("sound")
}

fn setup(mesh: Mesh<2>, conditions: Vec<Condition>, loads: usize, modulus: f64) -> Setup<2> {
    let second_gradient = SecondGradient::uniform(&mesh, modulus);
    Setup {
        second_gradient,
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, loads)
    }
}

fn build(setup: Setup<2>) -> Arc<Problem<2>> {
    Arc::new(Problem::build(setup).expect("sound"))
}

/// Clamped below, pushed down and aside above: no symmetry, nothing uniform.
fn sheared(elements: [usize; 2], modulus: f64) -> Arc<Problem<2>> {
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

fn turned_back(values: &[f64]) -> [f64; 4] {
    [values[0], values[1], values[2], values[3]]
}

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

fn loaded(problem: &Arc<Problem<2>>) -> MacroState<2> {
    let start = at_rest(problem, &law(), &[0.0; 3]);
    let loads = [-0.1, 0.06, 2.0];
    let outcome = elastic_step(problem, &law(), &start, &loads, 1e-11);
    outcome.expect("converges").state
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

/// Where the plane of symmetry of a full model is cut, v must know it.
#[test]
fn half_a_model_behind_its_plane_of_symmetry_is_the_full_one() {
    let conditions = |more: Option<Condition>| -> Vec<Condition> {
        let mut all = vec![
            hold("bottom", 0),
            hold("bottom", 1),
            hold("top", 0),
            drive("top", 1, 0),
        ];
        all.extend(more);
        all
    };
    let modulus = 0.02 * YOUNG;
    let solve = |setup: Setup<2>| {
        let problem = build(setup);
        let start = at_rest(&problem, &law(), &[0.0]);
        let outcome = elastic_step(&problem, &law(), &start, &[-0.2], 1e-12);
        (problem, outcome.expect("converges").state)
    };
    let (full, whole) = solve(setup(
        rectangle([2.0, 1.0], [8, 4]),
        conditions(None),
        1,
        modulus,
    ));
    let half = |side: Side| {
        let cut = Some(Condition::symmetry("right", 0));
        let mut setup = setup(rectangle([1.0, 1.0], [4, 4]), conditions(cut), 1, modulus);
        setup.second_gradient.sides.insert("right".into(), side);
        let (problem, state) = solve(setup);
        let mut worst: f64 = 0.0;
        for (node, &[x, y]) in problem.mesh().nodes.iter().enumerate() {
            let same = whole.displacement_of(node_at(&full, x, y));
            for (a, b) in state.displacement_of(node).iter().zip(same) {
                worst = worst.max((a - b).abs());
            }
        }
        worst / 0.2
    };
    let symmetric = half(Side::Symmetry);
    assert!(symmetric < 1e-12, "{symmetric:e}");
    let platen = half(Side::Platen);
    assert!(
        platen > 1e-5,
        "a platen is no plane of symmetry: {platen:e}"
    );
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

fn wrong(change: impl FnOnce(&mut Setup<2>)) -> ProblemError {
    let conditions = vec![hold("bottom", 0), hold("bottom", 1), drive("top", 1, 0)];
    let mut setup = setup(rectangle([1.0, 2.0], [2, 4]), conditions, 1, 1.0);
    change(&mut setup);
    Problem::build(setup).err().unwrap_or_default()
}

#[test]
fn what_cannot_be_meant_is_refused_in_words() {
    let alone = wrong(|setup| {
        setup.mesh.assign_region("weak", &[3]).expect("exists");
        setup.second_gradient.moduli = vec![0.0, 1.0];
    });
    assert_eq!(
        alone.second_gradient,
        vec![SideProblem::Alone { element: 3 }]
    );
    assert!(alone.to_string().contains("needs a neighbour"));

    let negative = wrong(|setup| setup.second_gradient.moduli[0] = -1.0);
    assert!(matches!(
        negative.second_gradient[..],
        [SideProblem::Modulus { .. }]
    ));

    let unknown = wrong(|setup| {
        setup
            .second_gradient
            .sides
            .insert("botom".into(), Side::Free);
    });
    assert!(
        unknown
            .to_string()
            .contains("`bottom`, `left`, `right`, `top`")
    );

    let loose = wrong(|setup| {
        setup
            .second_gradient
            .sides
            .insert("left".into(), Side::Symmetry);
    });
    assert!(matches!(
        loose.second_gradient[..],
        [SideProblem::SymmetryMoves { .. }]
    ));

    let beyond = wrong(|setup| {
        let side = Side::Held(vec![[0, 2]]);
        setup.second_gradient.sides.insert("left".into(), side);
    });
    assert!(matches!(
        beyond.second_gradient[..],
        [SideProblem::UnknownComponent { .. }]
    ));

    let inclined = wrong(|setup| {
        for node in &mut setup.mesh.nodes {
            node[1] += 0.1 * node[0];
        }
    });
    assert!(
        matches!(
            inclined.second_gradient[..],
            [SideProblem::Inclined { .. }, SideProblem::Inclined { .. }]
        ),
        "{inclined}"
    );
    let freed = wrong(|setup| {
        for node in &mut setup.mesh.nodes {
            node[1] += 0.1 * node[0];
        }
        for boundary in ["bottom", "top"] {
            setup
                .second_gradient
                .sides
                .insert(boundary.into(), Side::Free);
        }
    });
    assert_eq!(freed, ProblemError::default());

    let circle = wrong(|setup| {
        setup.ties = vec![Tie { node: 3, to: 4 }, Tie { node: 4, to: 3 }];
    });
    assert_eq!(circle.boundary.len(), 1, "{circle}");
}

/// Everything held on u_y and v_2j leaves λ_2j without an equation; it must not be solved for.
#[test]
fn a_multiplier_with_nothing_to_tie_is_no_unknown() {
    let mut mesh = rectangle([1.0, 1.0], [2, 2]);
    let all = (0..mesh.nodes.len()).collect();
    mesh.node_sets.insert("all".into(), all);
    let conditions = vec![
        hold("left", 0),
        drive("right", 0, 0),
        Condition::displacement(Target::node_set("all"), 1, Value::Constant(0.0)),
    ];
    let mut setup = setup(mesh, conditions, 1, 1.0);
    for boundary in ["left", "right", "bottom", "top"] {
        let side = Side::Held(vec![[1, 0], [1, 1]]);
        setup.second_gradient.sides.insert(boundary.into(), side);
    }
    // The middle corner of a 2×2 mesh is on no boundary, so that every element keeps a free v_2j.
    let problem = build(setup.clone());
    assert!(problem.constraints().free.len() > 4 * 4);
    setup.mesh = rectangle([1.0, 1.0], [2, 1]);
    let all = (0..setup.mesh.nodes.len()).collect();
    setup.mesh.node_sets.insert("all".into(), all);
    let problem = build(setup);
    let layout = problem.layout();
    for element in 0..2 {
        let first = layout.multiplier_dof(element).expect("carried");
        let equations = &problem.constraints().equation[first..first + 4];
        assert!(equations[0].is_some() && equations[1].is_some());
        assert_eq!(equations[2..], [None, None]);
    }
    let start = at_rest(&problem, &law(), &[0.0]);
    elastic_step(&problem, &law(), &start, &[0.01], 1e-10).expect("regular");
}

/// A step stored between two waves and restored goes on with the same bits, second gradient
/// included; and a plain state is stored as it always was.
#[test]
fn a_stored_step_goes_on_with_the_same_bits() {
    let problem = sheared([2, 4], 0.05 * YOUNG);
    let state = loaded(&problem);
    let loads = [-0.2, 0.12, 4.0];
    let settings = StepSettings::smooth(1e-10);
    let begin = || StepSolver::begin(&problem, &state, &state.loads, &loads, &settings);
    let finish = |mut step: StepSolver<2>, stored: bool| loop {
        let Request::Evaluate(wave) = step.next() else {
            let Request::Converged(outcome) = step.next() else {
                panic!("does not converge")
            };
            return outcome.state;
        };
        if stored {
            let bytes = rmp_serde::to_vec(step.state()).expect("plain values");
            let back = rmp_serde::from_slice(&bytes).expect("the same type");
            step = StepSolver::restore(&problem, back).expect("fits");
        }
        step.advance(&elastic_answers(&law(), &state, &wave.points));
    };
    let straight = finish(begin().expect("fits"), false);
    let resumed = finish(begin().expect("fits"), true);
    let bytes = |state: &MacroState<2>| rmp_serde::to_vec(state).expect("plain values");
    assert_eq!(bytes(&straight), bytes(&resumed));
    let back: MacroState<2> = rmp_serde::from_slice(&bytes(&straight)).expect("the same type");
    assert_eq!(back, straight);
    assert_eq!(back.check(&problem), Ok(()));

    let mut plain = straight.clone();
    plain.second_gradient = None;
    assert_eq!(bytes(&straight)[0], 0x98, "an array of eight");
    assert_eq!(
        bytes(&plain)[0],
        0x97,
        "seven, as before there was a second gradient"
    );
    let back: MacroState<2> = rmp_serde::from_slice(&bytes(&plain)).expect("the same type");
    assert_eq!(back, plain);
    let error = plain.check(&problem).expect_err("refused");
    assert!(error.to_string().contains("the state none"));
}

/// Two regions with different moduli, and one without: all beside each other.
#[test]
fn regions_with_and_without_second_gradient_stand_side_by_side() {
    let mut mesh = rectangle([1.0, 2.0], [2, 4]);
    mesh.assign_region("soft", &[2, 3]).expect("exist");
    mesh.assign_region("plain", &[6, 7]).expect("exist");
    let conditions = vec![hold("bottom", 0), hold("bottom", 1), drive("top", 0, 0)];
    let mut setup = setup(mesh, conditions, 1, 0.0);
    setup.second_gradient.moduli = vec![2.0, 0.5, 0.0];
    let problem = build(setup);
    let layout = problem.layout();
    assert_eq!(layout.multiplier_count(), 4 * 6);
    assert_eq!(layout.gradient_count(), 4 * 3 * 4);
    let start = at_rest(&problem, &law(), &[0.0]);
    let outcome = elastic_step(&problem, &law(), &start, &[0.1], 1e-10).expect("converges");
    let fields = outcome.state.second_gradient.expect("carried");
    assert!(fields.double_stress[8 * 4 * 6..].iter().all(|&x| x == 0.0));
    let here: Tensor2<2> = [[fields.increment[0], fields.increment[1]], [0.0; 2]];
    assert!(here[0][1].abs() > 1e-3, "v follows the shear");
    // Between two corners v is their mean; nodes of plain elements alone have none.
    let at_nodes = solver_fem::post::gradient_at_nodes(&problem, &fields.gradient);
    let at = |x: f64, y: f64| at_nodes[4 * node_at(&problem, x, y) + 1];
    assert!((at(0.25, 0.5) - 0.5 * (at(0.0, 0.5) + at(0.5, 0.5))).abs() < 1e-15);
    assert!(at(0.5, 1.75).is_nan() && at(0.5, 1.5).is_finite());
    assert_eq!(fields.mismatch.len(), 6);
    assert!(
        fields
            .mismatch
            .iter()
            .all(|&mismatch| mismatch > 0.0 && mismatch < 0.5)
    );
}
