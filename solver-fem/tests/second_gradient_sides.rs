//! Second gradient: planes of symmetry, platens and neighbours without it, and what is refused.

mod common;

use common::second_gradient::{YOUNG, build, law, rectangle, setup};
use common::{at_rest, drive, elastic_step, hold, node_at};
use solver_fem::boundary::{Condition, Target, Tie, Value};
use solver_fem::problem::{Problem, ProblemError, Setup};
use solver_fem::second_gradient::{Side, SideProblem};
use solver_fem::tensor::Tensor2;

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
