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
    let mesh = Mesh::annulus(&Annulus {
        inner_radius: 1.0,
        outer_radius: 3.0,
        circumferential: 6,
        radial: 6,
        growth: 1.2,
        extent: AnnulusExtent::Quarter,
    });
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
        Condition::pressure("outer", Value::load(1)),
    ];
    let problem =
        Arc::new(Problem::plane_strain(mesh.expect("sound"), conditions, 2).expect("sound"));
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
            let outcome = outcome.unwrap_or_else(|failure| panic!("{young} {loads:?}: {failure}"));
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
