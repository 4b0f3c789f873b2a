//! Body forces: dead ones per initial volume, as a weight is.
//!
//! P_ai = b_i ∫ N_a dV over the initial configuration. The integral is a property of the mesh and is
//! taken once, by the quadrature of the element, so that the forces of all nodes add up to b_i times the
//! volume that the stresses are integrated over, to rounding.

use super::{Condition, Value};
use crate::kinematics::{ReferencePoint, point_geometry};
use crate::mesh::Mesh;

/// The body forces of a problem, ready for assembly.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct BodyForces {
    /// Component and value of each.
    forces: Vec<(usize, Value)>,
    /// ∫ N_a dV of every node, empty where there is no force.
    volumes: Vec<f64>,
}

impl BodyForces {
    /// Collects the body forces of already checked conditions on a sound mesh.
    pub(super) fn new<const D: usize>(
        mesh: &Mesh<D>,
        reference: &[ReferencePoint<D>],
        initial: &[f64],
        conditions: &[Condition],
    ) -> Self {
        let forces: Vec<(usize, Value)> = conditions
            .iter()
            .filter_map(|condition| match condition {
                Condition::BodyForce { component, value } => Some((*component, *value)),
                _ => None,
            })
            .collect();
        let volumes = match forces.is_empty() {
            true => Vec::new(),
            false => nodal_volumes(mesh, reference, initial),
        };
        Self { forces, volumes }
    }

    /// Adds the nodal forces for these load values to `forces`, one per displacement.
    pub(super) fn add<const D: usize>(&self, loads: &[f64], forces: &mut [f64]) {
        for &(component, value) in &self.forces {
            let value = value.at(loads);
            for (node, volume) in self.volumes.iter().enumerate() {
                forces[node * D + component] += value * volume;
            }
        }
    }
}

/// ∫ N_a dV of every node; they may be negative, as at the corners of a Q8.
fn nodal_volumes<const D: usize>(
    mesh: &Mesh<D>,
    reference: &[ReferencePoint<D>],
    initial: &[f64],
) -> Vec<f64> {
    let mut volumes = vec![0.0; mesh.nodes.len()];
    for element in 0..mesh.element_count() {
        let nodes = mesh.element(element);
        // A sound mesh has a positive volume at every point.
        for (point, geometry) in reference
            .iter()
            .filter_map(|point| Some((point, point_geometry(point, nodes, initial)?)))
        {
            for (&node, shape) in nodes.iter().zip(&point.shape) {
                volumes[node] += geometry.volume * shape;
            }
        }
    }
    volumes
}
