//! Gauss point values at nodes, and sums over boundaries.

use std::collections::BTreeSet;

use crate::boundary::Target;
use crate::problem::Problem;

/// Gauss point values (`components` per point, flat) carried to the nodes: extrapolated inside
/// every element, then averaged over the elements of a node. For output only; peaks are smoothed.
///
/// # Panics
/// When `values` is not `components` per Gauss point.
pub fn nodal_average<const D: usize>(
    problem: &Problem<D>,
    values: &[f64],
    components: usize,
) -> Vec<f64> {
    let mesh = problem.mesh();
    let points = problem.points_per_element();
    assert_eq!(
        values.len(),
        problem.gauss_point_count() * components,
        "values per Gauss point"
    );
    let matrix = problem.element().extrapolation();
    let mut sums = vec![0.0; mesh.nodes.len() * components];
    let mut users = vec![0.0; mesh.nodes.len()];
    for element in 0..mesh.element_count() {
        for (a, &node) in mesh.element(element).iter().enumerate() {
            users[node] += 1.0;
            for point in 0..points {
                let weight = matrix[a * points + point];
                for c in 0..components {
                    let value = values[(element * points + point) * components + c];
                    sums[node * components + c] += weight * value;
                }
            }
        }
    }
    for (node, users) in users.into_iter().enumerate() {
        for c in 0..components {
            sums[node * components + c] /= users;
        }
    }
    sums
}

/// Nodes of a boundary or node set, ascending; empty for an unknown name.
fn nodes<const D: usize>(problem: &Problem<D>, target: &Target) -> BTreeSet<usize> {
    let mesh = problem.mesh();
    match target {
        Target::Boundary(name) => mesh
            .boundaries
            .get(name)
            .into_iter()
            .flatten()
            .flat_map(|facet| {
                let nodes = mesh.element(facet.element);
                problem
                    .element()
                    .facet_nodes(facet.local)
                    .iter()
                    .map(|&local| nodes[local])
            })
            .collect(),
        Target::NodeSet(name) => mesh
            .node_sets
            .get(name)
            .into_iter()
            .flatten()
            .copied()
            .collect(),
    }
}

/// Sum of nodal forces (e.g. [`MacroState::reactions`](crate::newton::MacroState)) over a boundary
/// or node set: the force the supports there exert on the body, per unit thickness in 2D.
///
/// # Panics
/// When `forces` is not one entry per degree of freedom.
pub fn boundary_force<const D: usize>(
    problem: &Problem<D>,
    target: &Target,
    forces: &[f64],
) -> [f64; D] {
    assert_eq!(
        forces.len(),
        problem.dof_count(),
        "one force per degree of freedom"
    );
    let mut sum = [0.0; D];
    for node in nodes(problem, target) {
        for i in 0..D {
            sum[i] += forces[node * D + i];
        }
    }
    sum
}

/// Mean over the nodes of a boundary or node set of a nodal vector, zero for an empty one.
///
/// # Panics
/// When `displacement` is not one entry per degree of freedom.
pub fn boundary_mean_displacement<const D: usize>(
    problem: &Problem<D>,
    target: &Target,
    displacement: &[f64],
) -> [f64; D] {
    let count = nodes(problem, target).len().max(1) as f64;
    boundary_force(problem, target, displacement).map(|sum| sum / count)
}
