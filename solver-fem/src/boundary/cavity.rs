//! The volume of a cavity: what a boundary encloses on the side where the body is not.
//!
//! V = −(1/D) ∫ x·n ds, n being the outward normal of the body, by the divergence theorem. A boundary that does not
//! close, as the wall of a quarter cylinder, encloses its volume together with planes of symmetry through the origin, on
//! which x·n = 0. Then every end of it has to move within such a plane.

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
        "`{boundary}` is open: it ends at node {node}, which does not stay on a plane of symmetry through the origin (one coordinate 0 and held); lay the middle of the cavity at the origin"
    )]
    Open {
        /// The boundary.
        boundary: String,
        /// Where it ends.
        node: usize,
    },
    /// The boundary is a plane through the origin.
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
        if let Some(node) =
            open_end::<D>(&facets, element.corner_count(), constraints, &initial, size)
        {
            let boundary = boundary.to_owned();
            return Err(CavityProblem::Open { boundary, node });
        }
        let mut cavity = Cavity {
            facets,
            points: element.facet_quadrature(),
            sign: 1.0,
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
                sum += point.weight * dot(&place(point, facet, coordinates), &area);
            }
        }
        -self.sign * sum / D as f64
    }

    /// V/V0 − 1.
    pub fn expansion(&self, coordinates: &[f64]) -> f64 {
        self.volume(coordinates) / self.initial - 1.0
    }

    /// The exact derivative of [`expansion`](Self::expansion) with respect to the node positions:
    /// ∂(x·n ds)/∂x_ai = N_a n_i ds + Σ_k x_j ∂(n_j ds)/∂t_ki ∂N_a/∂s_k.
    pub fn expansion_gradient(&self, coordinates: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; coordinates.len()];
        let scale = -self.sign / (D as f64 * self.initial);
        for facet in &self.facets {
            for point in &self.points {
                let tangents = tangents::<D>(point, &facet.nodes, coordinates);
                let area = area_vector(&tangents);
                let x: [f64; D] = place(point, facet, coordinates);
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
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// x = N_a x_a.
fn place<const D: usize>(point: &FacetPoint, facet: &Facet, coordinates: &[f64]) -> [f64; D] {
    let mut x = [0.0; D];
    for (&node, shape) in facet.nodes.iter().zip(&point.shape) {
        let node = position::<D>(coordinates, node);
        for i in 0..D {
            x[i] += shape * node[i];
        }
    }
    x
}

/// The first node at which a boundary ends without being held on a plane through the origin. It ends at the corners that
/// a single facet has; on surfaces in three dimensions the rim would have to be told by its sides.
fn open_end<const D: usize>(
    facets: &[Facet],
    corner_count: usize,
    constraints: &Constraints,
    initial: &[f64],
    size: f64,
) -> Option<usize> {
    let mut users: BTreeMap<usize, usize> = BTreeMap::new();
    for facet in facets {
        let nodes = facet.local.iter().zip(&facet.nodes);
        for (_, &node) in nodes.filter(|(local, _)| **local < corner_count) {
            *users.entry(node).or_default() += 1;
        }
    }
    let stays = |node: &usize| {
        (0..D).any(|i| {
            let dof = node * D + i;
            let held = constraints
                .prescribed
                .binary_search_by_key(&dof, |prescribed| prescribed.dof)
                .is_ok_and(|at| matches!(constraints.prescribed[at].value, Value::Constant(_)));
            held && initial[dof].abs() <= 1e-9 * size
        })
    };
    let ends = users.into_iter().filter(|(_, users)| *users == 1);
    ends.map(|(node, _)| node).find(|node| !stays(node))
}
