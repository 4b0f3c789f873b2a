//! Mesh, element and boundary conditions put together: everything of a load step that does not
//! change from one step to the next.

use std::fmt;
use std::sync::Arc;

use thiserror::Error;

use crate::assembly::Pattern;
use crate::boundary::{BoundaryProblem, Condition, Constraints, SurfaceLoads};
use crate::constitutive::GaussPointId;
use crate::element::{Element, Q8};
use crate::kinematics::{InvertedElement, ReferencePoint, point_geometry, position};
use crate::layout::Layout;
use crate::linear_solver::{FaerLu, LinearError, LinearSolver};
use crate::mesh::{Mesh, MeshProblem};

/// Everything that is wrong with a problem.
#[derive(Error, Clone, PartialEq, Debug, Default)]
pub struct ProblemError {
    /// Faults of the mesh.
    pub mesh: Vec<MeshProblem>,
    /// Faults of the boundary conditions (looked for on a sound mesh only).
    pub boundary: Vec<BoundaryProblem>,
    /// The equations could not be analysed.
    pub linear: Option<LinearError>,
}

impl fmt::Display for ProblemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.mesh.iter().map(ToString::to_string);
        let all = all.chain(self.boundary.iter().map(ToString::to_string));
        let all: Vec<_> = all
            .chain(self.linear.iter().map(ToString::to_string))
            .collect();
        write!(f, "set up the problem: {}", all.join("; "))
    }
}

/// A boundary value problem, ready to be stepped.
#[derive(Debug)]
pub struct Problem<const D: usize> {
    mesh: Mesh<D>,
    element: Arc<dyn Element<D>>,
    reference: Vec<ReferencePoint<D>>,
    layout: Layout<D>,
    initial: Vec<f64>,
    constraints: Constraints,
    loads: SurfaceLoads,
    load_count: usize,
    pattern: Arc<Pattern>,
    solver: Box<dyn LinearSolver>,
}

impl Problem<2> {
    /// Plane strain on Q8 elements with 2×2 Gauss points.
    ///
    /// # Errors
    /// See [`Problem::new`].
    pub fn plane_strain(
        mesh: Mesh<2>,
        conditions: Vec<Condition>,
        load_count: usize,
    ) -> Result<Self, ProblemError> {
        Self::new(mesh, Arc::new(Q8::default()), conditions, load_count)
    }
}

impl<const D: usize> Problem<D> {
    /// Checks and prepares a problem whose conditions refer to loads `0..load_count`.
    ///
    /// # Errors
    /// Every fault of the mesh, or every fault of the conditions, at once.
    pub fn new(
        mesh: Mesh<D>,
        element: Arc<dyn Element<D>>,
        conditions: Vec<Condition>,
        load_count: usize,
    ) -> Result<Self, ProblemError> {
        let faults = mesh.check(element.as_ref());
        if !faults.is_empty() {
            return Err(ProblemError {
                mesh: faults,
                ..ProblemError::default()
            });
        }
        let mut boundary = Vec::new();
        let constraints = Constraints::new(
            &mesh,
            element.as_ref(),
            &conditions,
            load_count,
            &mut boundary,
        );
        if !boundary.is_empty() {
            return Err(ProblemError {
                boundary,
                ..ProblemError::default()
            });
        }
        let layout = Layout::displacement(&mesh);
        let pattern = Arc::new(Pattern::new(&mesh, &layout, &constraints));
        let solver = FaerLu::analyse(Arc::clone(&pattern)).map_err(|error| ProblemError {
            linear: Some(error),
            ..ProblemError::default()
        })?;
        let reference = element
            .quadrature()
            .into_iter()
            .map(|point| {
                let mut shape = vec![0.0; element.node_count()];
                let mut gradients = vec![[0.0; D]; element.node_count()];
                element.shape(&point.xi, &mut shape);
                element.shape_gradients(&point.xi, &mut gradients);
                ReferencePoint {
                    weight: point.weight,
                    shape,
                    gradients,
                }
            })
            .collect();
        Ok(Problem {
            initial: mesh.flat_coordinates(),
            loads: SurfaceLoads::new(&mesh, element.as_ref(), &conditions),
            mesh,
            element,
            reference,
            layout,
            constraints,
            load_count,
            pattern,
            solver: Box::new(solver),
        })
    }

    /// The same problem solved by another linear solver (made for [`Problem::pattern`]).
    pub fn with_linear_solver(mut self, solver: Box<dyn LinearSolver>) -> Self {
        self.solver = solver;
        self
    }

    /// The mesh in its initial configuration.
    pub fn mesh(&self) -> &Mesh<D> {
        &self.mesh
    }

    /// The reference element.
    pub fn element(&self) -> &dyn Element<D> {
        self.element.as_ref()
    }

    /// Initial coordinates, node after node.
    pub fn initial(&self) -> &[f64] {
        &self.initial
    }

    /// Which unknowns there are and where each stands.
    pub fn layout(&self) -> &Layout<D> {
        &self.layout
    }

    /// Prescribed and free degrees of freedom.
    pub fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    /// Tractions and pressures.
    pub fn surface_loads(&self) -> &SurfaceLoads {
        &self.loads
    }

    /// Number of load values a step must be given.
    pub fn load_count(&self) -> usize {
        self.load_count
    }

    /// Sparsity pattern of the free equations.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The linear solver, symbolic part done.
    pub fn solver(&self) -> &dyn LinearSolver {
        self.solver.as_ref()
    }

    /// Shape functions at the Gauss points of the reference element.
    pub fn reference_points(&self) -> &[ReferencePoint<D>] {
        &self.reference
    }

    /// Number of Gauss points of one element.
    pub fn points_per_element(&self) -> usize {
        self.reference.len()
    }

    /// Number of Gauss points of the mesh.
    pub fn gauss_point_count(&self) -> usize {
        self.mesh.element_count() * self.reference.len()
    }

    /// Number of degrees of freedom, prescribed ones included.
    pub fn dof_count(&self) -> usize {
        self.initial.len()
    }

    /// Every Gauss point, in the order of all per-point arrays.
    pub fn gauss_points(&self) -> impl Iterator<Item = GaussPointId> + use<D> {
        (0..self.gauss_point_count() as u32).map(GaussPointId)
    }

    /// Element and local number of a Gauss point.
    pub fn locate(&self, point: GaussPointId) -> (usize, usize) {
        (
            point.index() / self.reference.len(),
            point.index() % self.reference.len(),
        )
    }

    /// Region (index into the mesh's region names) a Gauss point lies in.
    pub fn region_of(&self, point: GaussPointId) -> usize {
        self.mesh.regions[self.locate(point).0]
    }

    /// Position of every Gauss point for given node coordinates.
    ///
    /// # Panics
    /// When `coordinates` is not one position per node.
    pub fn gauss_point_positions(&self, coordinates: &[f64]) -> Vec<[f64; D]> {
        assert_eq!(coordinates.len(), self.dof_count(), "one position per node");
        self.gauss_points()
            .map(|point| {
                let (element, local) = self.locate(point);
                let mut x = [0.0; D];
                for (&node, shape) in self
                    .mesh
                    .element(element)
                    .iter()
                    .zip(&self.reference[local].shape)
                {
                    let node = position::<D>(coordinates, node);
                    for i in 0..D {
                        x[i] += shape * node[i];
                    }
                }
                x
            })
            .collect()
    }

    /// Volume (area × unit thickness in 2D) every Gauss point stands for.
    ///
    /// # Errors
    /// An element that is inverted at these positions.
    pub fn gauss_point_volumes(&self, coordinates: &[f64]) -> Result<Vec<f64>, InvertedElement> {
        self.gauss_points()
            .map(|point| {
                let (element, local) = self.locate(point);
                point_geometry(
                    &self.reference[local],
                    self.mesh.element(element),
                    coordinates,
                )
                .map(|geometry| geometry.volume)
                .ok_or(InvertedElement {
                    element,
                    point: local,
                })
            })
            .collect()
    }
}
