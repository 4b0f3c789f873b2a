//! R_ai = ∫ T_ij ∂N_a/∂x_j dv − P_ai on the end-of-step configuration, T = σ, or σ − λ where there is a
//! second gradient, which adds rows of its own.

use super::Configuration;
use crate::kinematics::{InvertedElement, point_geometry};
use crate::layout::Field;
use crate::problem::Problem;
use crate::second_gradient::element as second_gradient;
use crate::tensor::{self, Tensor2};

/// Internal minus external nodal forces and the norms they are judged by.
#[derive(Clone, PartialEq, Debug)]
pub struct Residual {
    /// One entry per degree of freedom. On free ones the lack of equilibrium; on prescribed ones
    /// the **reaction**, the force the support exerts on the body.
    pub vector: Vec<f64>,
    /// ‖R‖ over the free forces; a double force of second gradient counts over the size of the
    /// elements at its node, which makes it a force.
    pub free_norm: f64,
    /// ‖R‖ over the prescribed displacements.
    pub reaction_norm: f64,
    /// ‖P‖ over all degrees of freedom.
    pub external_norm: f64,
    /// √Σ‖element forces‖²: the size of the forces before they cancel.
    pub internal_norm: f64,
    /// ‖∫(grad u − v)‖/‖∫grad u‖ over the second-gradient elements, u being the displacement of the
    /// step: how well v is tied to it. `None` in a plain problem.
    pub mismatch: Option<f64>,
}

impl Residual {
    /// ‖R_free‖ / max(‖reactions‖, ‖external‖).
    ///
    /// A body without any support or load force is judged by 10⁻³ of its internal forces, so that a self-stressed body does
    /// not divide by zero; one without stress by the force `least`, below which there is nothing but rounding.
    pub fn ratio(&self, least: f64) -> f64 {
        let scale = self
            .reaction_norm
            .max(self.external_norm)
            .max(1e-3 * self.internal_norm)
            .max(least);
        ratio(self.free_norm, scale)
    }
}

/// ∫ T_ij ∂N_a/∂x_j dv at these node positions, `stress_at(element, Gauss point)` being T: one entry per displacement, and
/// Σ‖element forces‖², their size before they cancel.
///
/// # Errors
/// An element that is inverted at these positions.
///
/// # Panics
/// When `positions` is not one position per node or longer.
pub fn internal_forces<const D: usize>(
    problem: &Problem<D>,
    positions: &[f64],
    stress_at: impl Fn(usize, usize) -> Tensor2<D>,
) -> Result<(Vec<f64>, f64), InvertedElement> {
    let mut vector = vec![0.0; problem.layout().displacement_count()];
    let mut internal = 0.0;
    let reference = problem.reference_points();
    for element in 0..problem.mesh().element_count() {
        let nodes = problem.mesh().element(element);
        let mut forces = vec![[0.0; D]; nodes.len()];
        for (point, data) in reference.iter().enumerate() {
            let geometry =
                point_geometry(data, nodes, positions).ok_or(InvertedElement { element, point })?;
            let sigma = stress_at(element, element * reference.len() + point);
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
    Ok((vector, internal))
}

/// The residual of a configuration.
///
/// # Errors
/// An element that is inverted at these positions (with second gradient, also one that the step turns
/// half round).
///
/// # Panics
/// When an array has not the length the problem gives it.
pub fn residual<const D: usize>(
    problem: &Problem<D>,
    at: &Configuration<'_>,
) -> Result<Residual, InvertedElement> {
    let layout = problem.layout();
    let (mut vector, internal) = internal_forces(problem, at.unknowns, |element, index| {
        let multiplier = second_gradient::multiplier(problem, at.unknowns, element);
        net_stress(at.stress, index, multiplier.as_ref())
    })?;
    vector.resize(layout.len(), 0.0);
    let positions = &at.unknowns[..layout.displacement_count()];
    let external = problem
        .external_loads()
        .forces::<D>(problem.initial(), positions, at.loads);
    for (force, external) in vector.iter_mut().zip(&external) {
        *force -= external;
    }
    let mismatch = if layout.multiplier_count() == 0 {
        None
    } else {
        let tie = second_gradient::add_residual(problem, at, &mut vector)?;
        Some(ratio(tie.mismatch.sqrt(), tie.gradient.sqrt()))
    };
    let constraints = problem.constraints();
    constraints.gather(&mut vector);
    let (mut free, mut held) = (0.0, 0.0);
    for (dof, force) in vector.iter().enumerate() {
        let force = match layout.field(dof) {
            Field::Displacement => *force,
            Field::Gradient => force / problem.gradient_length(dof),
            Field::Multiplier => break,
        };
        match (constraints.equation[dof], layout.field(dof)) {
            (Some(_), _) => free += force * force,
            (None, Field::Displacement) => held += force * force,
            (None, _) => {}
        }
    }
    Ok(Residual {
        vector,
        free_norm: free.sqrt(),
        reaction_norm: held.sqrt(),
        external_norm: tensor::norm(&external),
        internal_norm: internal.sqrt(),
        mismatch,
    })
}

/// T = σ − λ.
pub(super) fn net_stress<const D: usize>(
    stress: &[f64],
    index: usize,
    multiplier: Option<&Tensor2<D>>,
) -> Tensor2<D> {
    let mut sigma = tensor::load2::<D>(stress, index);
    if let Some(lambda) = multiplier {
        for i in 0..D {
            for j in 0..D {
                sigma[i][j] -= lambda[i][j];
            }
        }
    }
    sigma
}

/// part/whole, zero for no part of nothing.
fn ratio(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
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
