//! Surface loads: nodal forces of dead tractions and follower pressure, and the stiffness of the
//! latter.
//!
//! Follower pressure, with the tangents t_k = ∂x/∂s_k of the deformed facet:
//! f_ai = −p ∫ N_a n_i ds, n_i ds = det[e_i, t_1, …, t_{D−1}] d^{D−1}s.
//! The determinant is linear in every tangent, so that the exact derivative is
//! ∂(n_i ds)/∂x_bj = Σ_k det[e_i, …, e_j at k, …] ∂N_b/∂s_k; it is not symmetric on open boundaries.

use super::facets::{Facet, area_derivative, area_vector, facets_of, tangents};
use super::{Condition, Value};
use crate::element::{Element, FacetPoint};
use crate::mesh::Mesh;
use crate::tensor;

#[derive(Clone, PartialEq, Debug)]
enum Kind {
    Dead { component: usize },
    Pressure,
}

#[derive(Clone, PartialEq, Debug)]
struct SurfaceLoad {
    kind: Kind,
    value: Value,
    facets: Vec<Facet>,
}

/// The surface loads of a problem, ready for assembly.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct SurfaceLoads {
    loads: Vec<SurfaceLoad>,
    points: Vec<FacetPoint>,
}

impl SurfaceLoads {
    /// Collects the loads of already checked conditions.
    pub(super) fn new<const D: usize>(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        conditions: &[Condition],
    ) -> Self {
        let loads = conditions
            .iter()
            .filter_map(|condition| {
                let (boundary, kind, value) = match condition {
                    Condition::Displacement { .. } | Condition::BodyForce { .. } => return None,
                    Condition::Traction {
                        boundary,
                        component,
                        value,
                    } => (
                        boundary,
                        Kind::Dead {
                            component: *component,
                        },
                        *value,
                    ),
                    Condition::Pressure { boundary, value } => (boundary, Kind::Pressure, *value),
                };
                let facets = facets_of(mesh, element, boundary)?;
                Some(SurfaceLoad {
                    kind,
                    value,
                    facets,
                })
            })
            .collect();
        SurfaceLoads {
            loads,
            points: element.facet_quadrature(),
        }
    }

    /// Adds the nodal forces to `forces`, as [`ExternalLoads::forces`](super::ExternalLoads::forces) tells them.
    pub(super) fn add<const D: usize>(
        &self,
        (initial, coordinates): (&[f64], &[f64]),
        loads: &[f64],
        forces: &mut [f64],
    ) {
        for load in &self.loads {
            let value = load.value.at(loads);
            if value == 0.0 {
                continue;
            }
            for facet in &load.facets {
                for point in &self.points {
                    let traction = match load.kind {
                        Kind::Dead { component } => {
                            let area = area_vector::<D>(&tangents(point, &facet.nodes, initial));
                            let mut traction = [0.0; D];
                            traction[component] = value * tensor::norm(&area);
                            traction
                        }
                        Kind::Pressure => {
                            area_vector::<D>(&tangents(point, &facet.nodes, coordinates))
                                .map(|area| -value * area)
                        }
                    };
                    for (&node, shape) in facet.nodes.iter().zip(&point.shape) {
                        for i in 0..D {
                            forces[node * D + i] += point.weight * shape * traction[i];
                        }
                    }
                }
            }
        }
    }

    /// The derivative of −forces, as [`ExternalLoads::stiffness`](super::ExternalLoads::stiffness) tells it.
    pub(super) fn stiffness<const D: usize>(
        &self,
        coordinates: &[f64],
        loads: &[f64],
        add: &mut impl FnMut(usize, usize, usize, f64),
    ) {
        for load in self.loads.iter().filter(|load| load.kind == Kind::Pressure) {
            let pressure = load.value.at(loads);
            if pressure == 0.0 {
                continue;
            }
            for facet in &load.facets {
                for point in &self.points {
                    let tangents = tangents::<D>(point, &facet.nodes, coordinates);
                    for direction in 0..tangents.len() {
                        let derivative = area_derivative(&tangents, direction);
                        let gradient = &point.gradients[direction];
                        for (&a, shape) in facet.local.iter().zip(&point.shape) {
                            for (&b, slope) in facet.local.iter().zip(gradient) {
                                let factor = pressure * point.weight * shape * slope;
                                for i in 0..D {
                                    for j in 0..D {
                                        add(
                                            facet.element,
                                            a * D + i,
                                            b * D + j,
                                            factor * derivative[i][j],
                                        );
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
