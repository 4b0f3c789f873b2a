//! R_ai = ∫ σ_ij ∂N_a/∂x_j dv − P_ai on the end-of-step configuration.

use crate::kinematics::{InvertedElement, point_geometry};
use crate::problem::Problem;
use crate::tensor;

/// Internal minus external nodal forces and the norms they are judged by.
#[derive(Clone, PartialEq, Debug)]
pub struct Residual {
    /// One entry per degree of freedom. On free ones the lack of equilibrium; on prescribed ones
    /// the **reaction**, the force the support exerts on the body.
    pub vector: Vec<f64>,
    /// ‖R‖ over the free degrees of freedom.
    pub free_norm: f64,
    /// ‖R‖ over the prescribed ones.
    pub reaction_norm: f64,
    /// ‖P‖ over all degrees of freedom.
    pub external_norm: f64,
    /// √Σ‖element forces‖²: the size of the forces before they cancel.
    pub internal_norm: f64,
}

impl Residual {
    /// ‖R_free‖ / max(‖reactions‖, ‖external‖).
    ///
    /// A body without any support or load force is judged by 10⁻³ of its internal forces, so that
    /// an unloaded or self-stressed body does not divide by zero.
    pub fn ratio(&self) -> f64 {
        let scale = self
            .reaction_norm
            .max(self.external_norm)
            .max(1e-3 * self.internal_norm);
        if self.free_norm == 0.0 {
            0.0
        } else {
            self.free_norm / scale
        }
    }
}

/// The residual for given node positions, Gauss point stresses (flat, D×D each) and load values.
///
/// # Errors
/// An element that is inverted at these positions.
///
/// # Panics
/// When an array has not the length the problem gives it.
pub fn residual<const D: usize>(
    problem: &Problem<D>,
    coordinates: &[f64],
    stress: &[f64],
    loads: &[f64],
) -> Result<Residual, InvertedElement> {
    let mut vector = vec![0.0; coordinates.len()];
    let mut internal = 0.0;
    let reference = problem.reference_points();
    for element in 0..problem.mesh().element_count() {
        let nodes = problem.mesh().element(element);
        let mut forces = vec![[0.0; D]; nodes.len()];
        for (point, data) in reference.iter().enumerate() {
            let geometry = point_geometry(data, nodes, coordinates)
                .ok_or(InvertedElement { element, point })?;
            let sigma = tensor::load2::<D>(stress, element * reference.len() + point);
            for (force, gradient) in forces.iter_mut().zip(&geometry.gradients) {
                for i in 0..D {
                    for j in 0..D {
                        force[i] += geometry.volume * sigma[i][j] * gradient[j];
                    }
                }
            }
        }
        for (&node, force) in nodes.iter().zip(&forces) {
            for i in 0..D {
                vector[node * D + i] += force[i];
                internal += force[i] * force[i];
            }
        }
    }
    let external = problem
        .surface_loads()
        .forces::<D>(problem.initial(), coordinates, loads);
    let (mut free, mut held) = (0.0, 0.0);
    for (dof, force) in external.iter().enumerate() {
        vector[dof] -= force;
        let square = vector[dof] * vector[dof];
        match problem.constraints().equation[dof] {
            Some(_) => free += square,
            None => held += square,
        }
    }
    Ok(Residual {
        vector,
        free_norm: free.sqrt(),
        reaction_norm: held.sqrt(),
        external_norm: tensor::norm(&external),
        internal_norm: internal.sqrt(),
    })
}

/// How much of the squared residual an element carries.
#[derive(serde::Serialize, serde::Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct ElementShare {
    /// The element.
    pub element: usize,
    /// Share of the whole, between 0 and 1; the shares of all elements add up to 1.
    pub share: f64,
}

/// The elements that carry most of the residual, largest first, at most `count`.
///
/// The squared force of a node is split evenly among its elements: a Gauss point that runs away
/// disturbs all nodes of its element and only some of its neighbours'.
pub fn element_shares<const D: usize>(
    problem: &Problem<D>,
    residual: &[f64],
    count: usize,
) -> Vec<ElementShare> {
    let mesh = problem.mesh();
    let mut users = vec![0u32; mesh.nodes.len()];
    for &node in &mesh.connectivity {
        users[node] += 1;
    }
    let square = |node: usize| -> f64 {
        (node * D..(node + 1) * D)
            .filter(|&dof| problem.constraints().equation[dof].is_some())
            .map(|dof| residual[dof] * residual[dof])
            .sum()
    };
    let total: f64 = (0..mesh.nodes.len()).map(square).sum();
    if total == 0.0 || !total.is_finite() {
        return Vec::new();
    }
    let mut shares: Vec<ElementShare> = (0..mesh.element_count())
        .map(|element| {
            let nodes = mesh.element(element).iter();
            let sum: f64 = nodes
                .map(|&node| square(node) / f64::from(users[node]))
                .sum();
            ElementShare {
                element,
                share: sum / total,
            }
        })
        .collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.element.cmp(&b.element)));
    shares.truncate(count);
    shares
}
