//! The field v of second gradient at all nodes, for output.

use crate::problem::Problem;

/// v at every node of the mesh (D² each, flat) from its values at the corners that carry it; NaN at
/// the nodes of plain elements alone.
///
/// # Panics
/// When `gradient` is not D² values per corner that carries v.
pub fn gradient_at_nodes<const D: usize>(problem: &Problem<D>, gradient: &[f64]) -> Vec<f64> {
    let (mesh, layout) = (problem.mesh(), problem.layout());
    assert_eq!(gradient.len(), layout.gradient_count(), "values per corner");
    let mut at_nodes = vec![f64::NAN; mesh.nodes.len() * D * D];
    let positions = problem.element().node_positions();
    let carried = |element: &usize| layout.multiplier_dof(*element).is_some();
    for element in (0..mesh.element_count()).filter(carried) {
        let nodes = mesh.element(element);
        for (&node, xi) in nodes.iter().zip(positions) {
            let Some(corners) = problem.element().corner_field(xi) else {
                continue;
            };
            // Neighbours agree along a side: the field is continuous.
            let value = &mut at_nodes[node * D * D..(node + 1) * D * D];
            value.fill(0.0);
            for (&corner, shape) in nodes.iter().zip(&corners.shape) {
                let Some(first) = layout.gradient_dof(corner) else {
                    continue;
                };
                let from = first - layout.displacement_count();
                for (sum, v) in value.iter_mut().zip(&gradient[from..from + D * D]) {
                    *sum += shape * v;
                }
            }
        }
    }
    at_nodes
}
