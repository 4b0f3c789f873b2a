//! A body that is unloaded completely has no force left that its residual could be compared with: noise over noise would
//! never converge, and the step was cut to the floor.

mod common;

use std::sync::Arc;

use common::{at_rest, elastic_step};
use solver_fem::boundary::{Condition, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Annulus, AnnulusExtent, Mesh};
use solver_fem::problem::Problem;

#[test]
fn an_elastic_ring_unloads_to_nothing_and_stays_there() {
    unload(6, [0.0, 0.0]);
    unload(40, [0.0, 0.0]);
}

/// Rounding goes with the size of the coordinates: those of a site in metres, say.
#[test]
fn so_does_one_far_from_the_origin() {
    for far in [1e3, 1e4, 1e6] {
        unload(6, [far, -far]);
    }
}

fn unload(elements: usize, middle: [f64; 2]) {
    let mesh = Mesh::annulus(&Annulus {
        inner_radius: 1.0,
        outer_radius: 3.0,
        circumferential: elements,
        radial: elements,
        growth: 1.02,
        extent: AnnulusExtent::Quarter,
    });
    let mut mesh = mesh.expect("sound");
    for node in &mut mesh.nodes {
        for (x, by) in node.iter_mut().zip(middle) {
            *x += by;
        }
    }
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
        Condition::pressure("outer", Value::load(1)),
    ];
    let problem = Arc::new(Problem::plane_strain(mesh, conditions, 2).expect("sound"));
    for young in [1e-3, 100.0, 1e9] {
        let law = Elastic::new(young, 0.3).expect("stable");
        let mut state = at_rest(&problem, &law, &[0.0, 0.0]);
        // Nothing, something, nothing; uniform and not.
        for [inner, outer] in [
            [0.0, 0.0],
            [0.02, 0.02],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.01, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
        ] {
            let loads = [inner * young, outer * young];
            let outcome = elastic_step(&problem, &law, &state, &loads, 1e-3);
            let outcome = outcome.unwrap_or_else(|failure| {
                panic!("{elements} {middle:?} {young} {loads:?}: {failure}")
            });
            assert!(
                outcome.sweeps.len() <= 6,
                "{young} {loads:?}: {:?}",
                outcome.sweeps
            );
            state = outcome.state;
        }
        let largest = state.stress.iter().fold(0.0_f64, |max, s| max.max(s.abs()));
        // A law in rates leaves the second order of the strain behind.
        assert!(largest < 1e-3 * young, "{largest:e}");
    }
}
