//! The volume of a cavity: what a boundary encloses on the side where the body is not.
//!
//! V = −(1/D) ∫ (x − c)·n ds, n being the outward normal of the body, by the divergence theorem. A boundary that does not
//! close, as the wall of a quarter cylinder, encloses its volume together with planes of symmetry x_i = const, at most one
//! for each axis. c lies on all of them, so that (x − c)·n = 0 there. Then every end of the boundary has to move within
//! such a plane.

use std::collections::BTreeMap;

use super::facets::{Facet, area_derivative, area_vector, facets_of, tangents};
use super::{Constraints, Value};
use crate::element::{Element, FacetPoint};
use crate::kinematics::position;
use crate::mesh::Mesh;
use thiserror::Error;

/// A boundary has no volume that could be measured.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum CavityProblem {
    /// There is no boundary of that name.
    #[error("there is no boundary `{0}`")]
    Unknown(String),
    /// An end of the boundary can leave the planes of symmetry.
    #[error(
        "`{boundary}` is open: it ends at {at:?} (node {node}), which stays on no plane of symmetry, where one coordinate is held"
    )]
    Open {
        /// The boundary.
        boundary: String,
        /// Where it ends.
        node: usize,
        /// The coordinates of the node.
        at: Vec<f64>,
    },
    /// Its ends are on parallel planes.
    #[error(
        "`{boundary}` ends on parallel planes of symmetry, at {planes:?} along one axis, and encloses nothing with them"
    )]
    Parallel {
        /// The boundary.
        boundary: String,
        /// Where the planes are on their axis.
        planes: [f64; 2],
    },
    /// The boundary lies in a plane of symmetry.
    #[error("`{0}` encloses no volume")]
    Flat(String),
}

/// A boundary whose enclosed volume is measured.
#[derive(Clone, PartialEq, Debug)]
pub struct Cavity<const D: usize> {
    facets: Vec<Facet>,
    points: Vec<FacetPoint>,
    /// −1 where the boundary is seen from inside, as the outer side of a ring.
    sign: f64,
    /// Where the planes of symmetry meet that the boundary ends on; 0 along axes that none is normal to.
    centre: [f64; D],
    initial: f64,
}

impl<const D: usize> Cavity<D> {
    /// The cavity behind a boundary.
    ///
    /// # Errors
    /// It has no volume.
    pub(crate) fn new(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        constraints: &Constraints,
        boundary: &str,
    ) -> Result<Self, CavityProblem> {
        let facets = facets_of(mesh, element, boundary)
            .ok_or_else(|| CavityProblem::Unknown(boundary.to_owned()))?;
        let initial = mesh.flat_coordinates();
        let size = mesh.diameter();
        let ends = ends(&facets, element.corner_count());
        let planes = Planes {
            constraints,
            initial: &initial,
            tolerance: 1e-9 * size,
        };
        let centre = planes.meet(&ends, boundary)?;
        let mut cavity = Cavity {
            facets,
            points: element.facet_quadrature(),
            sign: 1.0,
            centre,
            initial: 1.0,
        };
        let volume = cavity.volume(&initial);
        if volume.abs() <= 1e-9 * libm::pow(size, D as f64) {
            return Err(CavityProblem::Flat(boundary.to_owned()));
        }
        cavity.sign = volume.signum();
        cavity.initial = volume.abs();
        Ok(cavity)
    }

    /// Volume in the initial mesh; area per unit thickness in 2D.
    pub fn initial_volume(&self) -> f64 {
        self.initial
    }

    /// Volume at the given node positions.
    pub fn volume(&self, coordinates: &[f64]) -> f64 {
        let mut sum = 0.0;
        for facet in &self.facets {
            for point in &self.points {
                let area = area_vector::<D>(&tangents(point, &facet.nodes, coordinates));
                sum += point.weight * dot(&self.place(point, facet, coordinates), &area);
            }
        }
        -self.sign * sum / D as f64
    }

    /// V/V0 − 1.
    pub fn expansion(&self, coordinates: &[f64]) -> f64 {
        self.volume(coordinates) / self.initial - 1.0
    }

    /// The exact derivative of [`expansion`](Self::expansion) with respect to the node positions:
    /// ∂((x − c)·n ds)/∂x_ai = N_a n_i ds + Σ_k (x − c)_j ∂(n_j ds)/∂t_ki ∂N_a/∂s_k.
    pub fn expansion_gradient(&self, coordinates: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; coordinates.len()];
        let scale = -self.sign / (D as f64 * self.initial);
        for facet in &self.facets {
            for point in &self.points {
                let tangents = tangents::<D>(point, &facet.nodes, coordinates);
                let area = area_vector(&tangents);
                let x = self.place(point, facet, coordinates);
                let weight = scale * point.weight;
                for (&node, shape) in facet.nodes.iter().zip(&point.shape) {
                    for i in 0..D {
                        gradient[node * D + i] += weight * shape * area[i];
                    }
                }
                for (direction, slopes) in point.gradients.iter().enumerate() {
                    let derivative = area_derivative(&tangents, direction);
                    for (&node, slope) in facet.nodes.iter().zip(slopes) {
                        for i in 0..D {
                            let moved: f64 = (0..D).map(|j| x[j] * derivative[j][i]).sum();
                            gradient[node * D + i] += weight * slope * moved;
                        }
                    }
                }
            }
        }
        gradient
    }

    /// x − c, x = N_a x_a.
    fn place(&self, point: &FacetPoint, facet: &Facet, coordinates: &[f64]) -> [f64; D] {
        let mut x = [0.0; D];
        for (&node, shape) in facet.nodes.iter().zip(&point.shape) {
            let node = position::<D>(coordinates, node);
            for i in 0..D {
                x[i] += shape * node[i];
            }
        }
        for i in 0..D {
            x[i] -= self.centre[i];
        }
        x
    }
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The corners at which a boundary ends: those that a single facet has. On surfaces in three dimensions the rim would have
/// to be told by its sides.
fn ends(facets: &[Facet], corner_count: usize) -> Vec<usize> {
    let mut users: BTreeMap<usize, usize> = BTreeMap::new();
    for facet in facets {
        let nodes = facet.local.iter().zip(&facet.nodes);
        for (_, &node) in nodes.filter(|(local, _)| **local < corner_count) {
            *users.entry(node).or_default() += 1;
        }
    }
    let ends = users.into_iter().filter(|(_, users)| *users == 1);
    ends.map(|(node, _)| node).collect()
}

/// The planes x_i = const that nodes stay on.
struct Planes<'a> {
    constraints: &'a Constraints,
    initial: &'a [f64],
    /// Coordinates that differ less are the same.
    tolerance: f64,
}

impl Planes<'_> {
    /// The axes along which a node is held.
    fn normals<const D: usize>(&self, node: usize) -> impl Iterator<Item = usize> {
        let prescribed = &self.constraints.prescribed;
        (0..D).filter(move |i| {
            prescribed
                .binary_search_by_key(&(node * D + i), |prescribed| prescribed.dof)
                .is_ok_and(|at| matches!(prescribed[at].value, Value::Constant(_)))
        })
    }

    /// A coordinate; those that are 0 but for rounding are 0.
    fn coordinate<const D: usize>(&self, node: usize, axis: usize) -> f64 {
        let x = self.initial[node * D + axis];
        if x.abs() <= self.tolerance { 0.0 } else { x }
    }

    /// Where the planes meet that the `ends` of `boundary` stay on. Coordinate planes come first; an end that is held along
    /// several axes takes a plane that another end needs, where there is one.
    fn meet<const D: usize>(
        &self,
        ends: &[usize],
        boundary: &str,
    ) -> Result<[f64; D], CavityProblem> {
        let on_coordinate_plane = |&node: &usize| {
            let mut normals = self.normals::<D>(node);
            normals.any(|i| self.coordinate::<D>(node, i) == 0.0)
        };
        if ends.iter().all(on_coordinate_plane) {
            return Ok([0.0; D]);
        }
        let mut planes: [Option<f64>; D] = [None; D];
        let (certain, choosing): (Vec<usize>, Vec<usize>) = ends
            .iter()
            .partition(|&&node| self.normals::<D>(node).count() < 2);
        for node in certain.into_iter().chain(choosing) {
            let normals: Vec<usize> = self.normals::<D>(node).collect();
            let at = |axis: usize| self.coordinate::<D>(node, axis);
            let same = |axis: usize| planes[axis].map(|x| (x - at(axis)).abs() <= self.tolerance);
            if normals.iter().any(|&axis| same(axis) == Some(true)) {
                continue;
            }
            match (
                normals.iter().find(|&&axis| same(axis).is_none()),
                normals.first(),
            ) {
                (Some(&free), _) => planes[free] = Some(at(free)),
                (None, Some(&taken)) => {
                    return Err(CavityProblem::Parallel {
                        boundary: boundary.to_owned(),
                        planes: [planes[taken].unwrap_or_default(), at(taken)],
                    });
                }
                (None, None) => {
                    return Err(CavityProblem::Open {
                        boundary: boundary.to_owned(),
                        node,
                        at: position::<D>(self.initial, node).to_vec(),
                    });
                }
            }
        }
        Ok(planes.map(Option::unwrap_or_default))
    }
}
