//! Surface loads: nodal forces of dead tractions and follower pressure, and the stiffness of the
//! latter.
//!
//! Follower pressure, with the tangents t_k = ∂x/∂s_k of the deformed facet:
//! f_ai = −p ∫ N_a n_i ds, n_i ds = det[e_i, t_1, …, t_{D−1}] d^{D−1}s.
//! The determinant is linear in every tangent, so that the exact derivative is
//! ∂(n_i ds)/∂x_bj = Σ_k det[e_i, …, e_j at k, …] ∂N_b/∂s_k; it is not symmetric on open boundaries.

use super::{Condition, Value};
use crate::element::{Element, FacetPoint};
use crate::kinematics::position;
use crate::mesh::Mesh;
use crate::tensor::{self, Tensor2};

#[derive(Clone, PartialEq, Debug)]
enum Kind {
    Dead { component: usize },
    Pressure,
}

#[derive(Clone, PartialEq, Debug)]
struct LoadedFacet {
    element: usize,
    /// Local nodes within the element, and the same nodes in the mesh.
    local: &'static [usize],
    nodes: Vec<usize>,
}

#[derive(Clone, PartialEq, Debug)]
struct SurfaceLoad {
    kind: Kind,
    value: Value,
    facets: Vec<LoadedFacet>,
}

/// The surface loads of a problem, ready for assembly.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SurfaceLoads {
    loads: Vec<SurfaceLoad>,
    points: Vec<FacetPoint>,
}

/// det[e_i, t_1, …, t_{D−1}] for every i: the outward normal times the area of the facet.
fn area_vector<const D: usize>(tangents: &[[f64; D]]) -> [f64; D] {
    let mut result = [0.0; D];
    for (i, component) in result.iter_mut().enumerate() {
        let mut rows = tensor::zero::<D>();
        rows[0][i] = 1.0;
        rows[1..].copy_from_slice(tangents);
        *component = tensor::determinant(&rows);
    }
    result
}

/// t_k = x_a ∂N_a/∂s_k.
fn tangents<const D: usize>(
    point: &FacetPoint,
    nodes: &[usize],
    coordinates: &[f64],
) -> Vec<[f64; D]> {
    point
        .gradients
        .iter()
        .map(|gradient| {
            let mut tangent = [0.0; D];
            for (&node, derivative) in nodes.iter().zip(gradient) {
                let x = position::<D>(coordinates, node);
                for i in 0..D {
                    tangent[i] += x[i] * derivative;
                }
            }
            tangent
        })
        .collect()
}

impl SurfaceLoads {
    /// Collects the loads of already checked conditions.
    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        conditions: &[Condition],
    ) -> Self {
        let loads = conditions
            .iter()
            .filter_map(|condition| {
                let (boundary, kind, value) = match condition {
                    Condition::Displacement { .. } => return None,
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
                let facets = mesh.boundaries.get(boundary)?.iter();
                let facets = facets
                    .map(|facet| {
                        let local = element.facet_nodes(facet.local);
                        let nodes = mesh.element(facet.element);
                        let nodes = local.iter().map(|&a| nodes[a]).collect();
                        LoadedFacet {
                            element: facet.element,
                            local,
                            nodes,
                        }
                    })
                    .collect();
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

    /// External nodal forces, one per degree of freedom. Dead tractions integrate over `initial`,
    /// pressures over `coordinates`.
    pub fn forces<const D: usize>(
        &self,
        initial: &[f64],
        coordinates: &[f64],
        loads: &[f64],
    ) -> Vec<f64> {
        let mut forces = vec![0.0; coordinates.len()];
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
        forces
    }

    /// Hands the derivative of **−forces** (internal minus external is what is linearised) to
    /// `add(element, row, column, value)`, rows and columns being local degrees of freedom.
    pub(crate) fn stiffness<const D: usize>(
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

/// det[e_i, …, e_j at `direction`, …] for every i, j.
fn area_derivative<const D: usize>(tangents: &[[f64; D]], direction: usize) -> Tensor2<D> {
    let mut result = tensor::zero::<D>();
    for j in 0..D {
        let mut varied = tangents.to_vec();
        varied[direction] = [0.0; D];
        varied[direction][j] = 1.0;
        let column = area_vector(&varied);
        for i in 0..D {
            result[i][j] = column[i];
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_points_outward_in_two_and_three_dimensions() {
        // Bottom edge of a counter-clockwise element runs along +x: outward is −y.
        assert_eq!(area_vector(&[[2.0, 0.0]]), [0.0, -2.0]);
        assert_eq!(
            area_vector(&[[1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]),
            [0.0, 0.0, 3.0]
        );
    }
}
