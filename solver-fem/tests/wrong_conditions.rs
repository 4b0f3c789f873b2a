//! Boundary conditions that cannot be meant: all faults at once, by name, before any computation.

use solver_fem::boundary::{BoundaryProblem, Condition, Target, Value};
use solver_fem::mesh::{Mesh, Rectangle};
use solver_fem::problem::Problem;

fn faults(conditions: Vec<Condition>) -> Vec<BoundaryProblem> {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [2, 4],
    })
    .expect("sound");
    Problem::plane_strain(mesh, conditions, 1)
        .err()
        .map(|e| e.boundary)
        .unwrap_or_default()
}

fn on(boundary: &str, component: usize, value: Value) -> Condition {
    Condition::displacement(Target::boundary(boundary), component, value)
}

const ZERO: Value = Value::Constant(0.0);

#[test]
fn a_body_that_can_slide_away_is_refused_with_the_motion() {
    let sliding = faults(vec![on("bottom", 1, ZERO), on("top", 1, Value::load(0))]);
    assert_eq!(
        sliding,
        vec![BoundaryProblem::RigidMotion {
            motion: "translation in x".into()
        }]
    );
    assert_eq!(
        faults(vec![]).len(),
        3,
        "three rigid motions of a free body"
    );
    let turning = faults(Condition::pin::<2>("bottom_mid"));
    assert_eq!(turning.len(), 1);
    assert!(turning[0].to_string().contains("rotation"));
    let pinned = vec![
        on("bottom", 1, ZERO),
        on("top", 1, Value::load(0)),
        Condition::displacement(Target::node_set("bottom_mid"), 0, ZERO),
    ];
    assert_eq!(faults(pinned), vec![]);
}

#[test]
fn a_component_prescribed_twice_differently_is_refused_once_per_pair() {
    let twice = faults(vec![
        on("bottom", 0, ZERO),
        on("bottom", 1, ZERO),
        on("left", 0, Value::load(0)),
        on("left", 1, ZERO),
    ]);
    assert!(
        matches!(
            twice[..],
            [BoundaryProblem::Conflict {
                first: 0,
                second: 2,
                component: 0,
                ..
            }]
        ),
        "the same value twice is fine, and so is a shared corner: {twice:?}"
    );
}

#[test]
fn every_unknown_name_and_number_is_reported_at_once() {
    let all = faults(vec![
        on("botom", 0, ZERO),
        on("bottom", 2, ZERO),
        Condition::displacement(Target::node_set("middle"), 0, ZERO),
        Condition::pressure("top", Value::load(4)),
        Condition::pressure("top", Value::Constant(f64::NAN)),
    ]);
    assert_eq!(all.len(), 5, "{all:?}");
    assert!(
        all[0]
            .to_string()
            .contains("`bottom`, `left`, `right`, `top`")
    );
}

#[test]
fn a_load_that_can_do_nothing_is_refused() {
    let held = faults(vec![
        on("bottom", 0, ZERO),
        on("bottom", 1, ZERO),
        Condition::pressure("bottom", Value::load(0)),
    ]);
    assert!(matches!(
        held[..],
        [BoundaryProblem::LoadOnHeldBoundary { condition: 2, .. }]
    ));
    let smooth = faults(vec![
        on("left", 0, ZERO),
        on("bottom", 1, ZERO),
        Condition::pressure("left", Value::load(0)),
    ]);
    assert_eq!(smooth, vec![], "a smooth wall under pressure may slide");
}
