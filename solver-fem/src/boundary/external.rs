//! All external forces of a problem: those on its surface and those on its volume.

use super::Condition;
use super::body_force::BodyForces;
use super::loads::SurfaceLoads;
use crate::element::Element;
use crate::kinematics::ReferencePoint;
use crate::mesh::Mesh;

/// The external loads of a problem, ready for assembly.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ExternalLoads {
    surface: SurfaceLoads,
    body: BodyForces,
}

impl ExternalLoads {
    /// Collects the loads of already checked conditions on a sound mesh; `reference` are the Gauss points of the
    /// element, `initial` the coordinates of the nodes.
    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        reference: &[ReferencePoint<D>],
        initial: &[f64],
        conditions: &[Condition],
    ) -> Self {
        Self {
            surface: SurfaceLoads::new(mesh, element, conditions),
            body: BodyForces::new(mesh, reference, initial, conditions),
        }
    }

    /// External nodal forces, one per displacement: linear in every load. Dead loads integrate over
    /// `initial`, pressures over `coordinates`.
    pub fn forces<const D: usize>(
        &self,
        initial: &[f64],
        coordinates: &[f64],
        loads: &[f64],
    ) -> Vec<f64> {
        let mut forces = vec![0.0; coordinates.len()];
        self.surface
            .add::<D>((initial, coordinates), loads, &mut forces);
        self.body.add::<D>(loads, &mut forces);
        forces
    }

    /// Hands the derivative of **−forces** (internal minus external is what is linearised) to
    /// `add(element, row, column, value)`, rows and columns being local degrees of freedom. Dead loads have none.
    pub(crate) fn stiffness<const D: usize>(
        &self,
        coordinates: &[f64],
        loads: &[f64],
        add: &mut impl FnMut(usize, usize, usize, f64),
    ) {
        self.surface.stiffness::<D>(coordinates, loads, add);
    }
}
