//! Mesh, element and boundary conditions put together: everything of a load step that does not
//! change from one step to the next.

use std::fmt;
use std::sync::Arc;

use thiserror::Error;

use crate::assembly::Pattern;
use crate::boundary::{
    BoundaryProblem, Cavity, CavityProblem, Condition, Constraints, ExternalLoads, Given, Tie,
};
use crate::constitutive::GaussPointId;
use crate::element::{Element, Q8};
use crate::kinematics::{InvertedElement, ReferencePoint, point_geometry, position};
use crate::layout::Layout;
use crate::linear_solver::{LinearError, LinearSolver, Method};
use crate::mesh::{Mesh, MeshProblem};
use crate::second_gradient::law::unit_law;
use crate::second_gradient::{CornerPoint, SecondGradient, SideProblem};
use crate::tensor::Tensor3;

/// Everything that is wrong with a problem.
#[derive(Error, Clone, PartialEq, Debug, Default)]
pub struct ProblemError {
    /// Faults of the mesh.
    pub mesh: Vec<MeshProblem>,
    /// Faults of the boundary conditions (looked for on a sound mesh only).
    pub boundary: Vec<BoundaryProblem>,
    /// Faults of the second gradient (looked for on a sound mesh only).
    pub second_gradient: Vec<SideProblem>,
    /// The equations could not be analysed.
    pub linear: Option<LinearError>,
}

impl fmt::Display for ProblemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.mesh.iter().map(ToString::to_string);
        let all = all.chain(self.boundary.iter().map(ToString::to_string));
        let all = all.chain(self.second_gradient.iter().map(ToString::to_string));
        let all: Vec<_> = all
            .chain(self.linear.iter().map(ToString::to_string))
            .collect();
        write!(f, "set up the problem: {}", all.join("; "))
    }
}

/// What makes a problem.
#[derive(Clone, Debug)]
pub struct Setup<const D: usize> {
    /// The mesh in its initial configuration.
    pub mesh: Mesh<D>,
    /// Its reference element.
    pub element: Arc<dyn Element<D>>,
    /// Boundary conditions, which refer to loads `0..load_count`.
    pub conditions: Vec<Condition>,
    /// Number of load values of a step.
    pub load_count: usize,
    /// Where there is a second gradient; nowhere by default.
    pub second_gradient: SecondGradient,
    /// Nodes that move as others do; none by default.
    pub ties: Vec<Tie>,
}

impl<const D: usize> Setup<D> {
    /// A plain problem, to be added to.
    pub fn new(
        mesh: Mesh<D>,
        element: Arc<dyn Element<D>>,
        conditions: Vec<Condition>,
        load_count: usize,
    ) -> Self {
        Setup {
            mesh,
            element,
            conditions,
            load_count,
            second_gradient: SecondGradient::default(),
            ties: Vec::new(),
        }
    }
}

/// A boundary value problem, ready to be stepped.
#[derive(Debug)]
pub struct Problem<const D: usize> {
    mesh: Mesh<D>,
    element: Arc<dyn Element<D>>,
    reference: Vec<ReferencePoint<D>>,
    second_gradient: SecondGradient,
    corners: Vec<CornerPoint<D>>,
    gradient_lengths: Vec<f64>,
    unit_law: Vec<Tensor3<D>>,
    layout: Layout<D>,
    initial: Vec<f64>,
    constraints: Constraints,
    loads: ExternalLoads,
    load_count: usize,
    pattern: Arc<Pattern>,
    solver: Box<dyn LinearSolver>,
}

fn analyse<const D: usize>(
    method: Method,
    mesh: &Mesh<D>,
    layout: &Layout<D>,
    constraints: &Constraints,
    pattern: &Arc<Pattern>,
) -> Result<Box<dyn LinearSolver>, LinearError> {
    let fields = constraints.free.iter().map(|&dof| layout.field(dof));
    let centres: Vec<_> = (0..mesh.element_count())
        .map(|element| mesh.element_centre(element))
        .collect();
    method.analyse(pattern, fields.collect(), &centres)
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
    /// A plain problem whose conditions refer to loads `0..load_count`.
    ///
    /// # Errors
    /// See [`Problem::build`].
    pub fn new(
        mesh: Mesh<D>,
        element: Arc<dyn Element<D>>,
        conditions: Vec<Condition>,
        load_count: usize,
    ) -> Result<Self, ProblemError> {
        Self::build(Setup::new(mesh, element, conditions, load_count))
    }

    /// Checks and prepares a problem.
    ///
    /// # Errors
    /// Every fault of the mesh, or every fault of the rest, at once.
    pub fn build(setup: Setup<D>) -> Result<Self, ProblemError> {
        let Setup {
            mesh,
            element,
            conditions,
            load_count,
            second_gradient,
            ties,
        } = setup;
        let faults = mesh.check(element.as_ref());
        if !faults.is_empty() {
            return Err(ProblemError {
                mesh: faults,
                ..ProblemError::default()
            });
        }
        let (corners, faults) = corner_points(element.as_ref(), &second_gradient);
        if !faults.is_empty() {
            return Err(ProblemError {
                second_gradient: faults,
                ..ProblemError::default()
            });
        }
        let corner_count = corners.first().map_or(0, |point| point.shape.len());
        let layout = second_gradient.layout(&mesh, corner_count);
        let mut faults = second_gradient.check(&mesh, &layout, corner_count);
        let held = second_gradient.held(&mesh, element.as_ref(), &layout, &conditions, &mut faults);
        let mut boundary = Vec::new();
        let constraints = Constraints::new(
            &mesh,
            element.as_ref(),
            &layout,
            &Given {
                conditions: &conditions,
                ties: &ties,
                held: &held,
                load_count,
            },
            &mut boundary,
        );
        if !boundary.is_empty() || !faults.is_empty() {
            return Err(ProblemError {
                boundary,
                second_gradient: faults,
                ..ProblemError::default()
            });
        }
        let pattern = Arc::new(Pattern::new(&mesh, &layout, &constraints));
        let solver = analyse(Method::default(), &mesh, &layout, &constraints, &pattern).map_err(
            |error| ProblemError {
                linear: Some(error),
                ..ProblemError::default()
            },
        )?;
        let reference: Vec<ReferencePoint<D>> = element
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
        let initial = mesh.flat_coordinates();
        let loads = ExternalLoads::new(&mesh, element.as_ref(), &reference, &initial, &conditions);
        let mut problem = Problem {
            initial,
            loads,
            unit_law: if corners.is_empty() {
                Vec::new()
            } else {
                unit_law()
            },
            mesh,
            element,
            reference,
            second_gradient,
            corners,
            gradient_lengths: Vec::new(),
            layout,
            constraints,
            load_count,
            pattern,
            solver,
        };
        problem.gradient_lengths = problem.corner_lengths();
        Ok(problem)
    }

    /// The same problem solved by another linear solver than the default one.
    ///
    /// # Errors
    /// Lack of memory.
    pub fn solved_by(mut self, method: Method) -> Result<Self, LinearError> {
        let Problem {
            mesh,
            layout,
            constraints,
            pattern,
            ..
        } = &self;
        self.solver = analyse(method, mesh, layout, constraints, pattern)?;
        Ok(self)
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

    /// Tractions, pressures and body forces.
    pub fn external_loads(&self) -> &ExternalLoads {
        &self.loads
    }

    /// The cavity behind a boundary, of which the volume can be measured.
    ///
    /// # Errors
    /// The boundary encloses no volume, or one that is not determined.
    pub fn cavity(&self, boundary: &str) -> Result<Cavity<D>, CavityProblem> {
        Cavity::new(
            &self.mesh,
            self.element.as_ref(),
            &self.constraints,
            boundary,
        )
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

    /// Shape functions of v at the Gauss points of the reference element; empty in a plain problem.
    pub fn corner_points(&self) -> &[CornerPoint<D>] {
        &self.corners
    }

    /// Where there is a second gradient.
    pub fn second_gradient(&self) -> &SecondGradient {
        &self.second_gradient
    }

    /// The second-gradient modulus of an element (stress × length²), 0 for a plain one.
    pub fn modulus(&self, element: usize) -> f64 {
        self.second_gradient.modulus(&self.mesh, element)
    }

    /// The second-gradient law for modulus 1, see [`unit_law`].
    pub(crate) fn unit_law(&self) -> &[Tensor3<D>] {
        &self.unit_law
    }

    /// Mean size of the second-gradient elements at the node of a degree of freedom of v: what
    /// makes a double force a force.
    ///
    /// # Panics
    /// For a degree of freedom of another field.
    pub fn gradient_length(&self, dof: usize) -> f64 {
        self.gradient_lengths[(dof - self.layout.displacement_count()) / (D * D)]
    }

    /// Volume^(1/D) of the second-gradient elements of every node that carries v, on average.
    fn corner_lengths(&self) -> Vec<f64> {
        let count = self.layout.gradient_count() / (D * D);
        let (mut sums, mut users) = (vec![0.0; count], vec![0.0; count]);
        for element in 0..self.mesh.element_count() {
            if self.layout.multiplier_dof(element).is_none() {
                continue;
            }
            let nodes = self.mesh.element(element);
            let volume: f64 = self
                .reference
                .iter()
                .filter_map(|point| point_geometry(point, nodes, &self.initial))
                .map(|geometry| geometry.volume)
                .sum();
            let size = libm::pow(volume, 1.0 / D as f64);
            for first in nodes
                .iter()
                .filter_map(|&node| self.layout.gradient_dof(node))
            {
                let corner = (first - self.layout.displacement_count()) / (D * D);
                sums[corner] += size;
                users[corner] += 1.0;
            }
        }
        sums.into_iter().zip(users).map(|(s, n)| s / n).collect()
    }

    /// Number of displacement components, prescribed ones included.
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

/// Shape functions of v at every Gauss point; none where no region has a modulus.
fn corner_points<const D: usize>(
    element: &dyn Element<D>,
    second_gradient: &SecondGradient,
) -> (Vec<CornerPoint<D>>, Vec<SideProblem>) {
    if second_gradient.is_plain() {
        return (Vec::new(), Vec::new());
    }
    let points: Option<Vec<_>> = element
        .quadrature()
        .iter()
        .map(|point| element.corner_field(&point.xi))
        .collect();
    match points {
        Some(points) => (points, Vec::new()),
        None => {
            let element = element.name();
            (Vec::new(), vec![SideProblem::Element { element }])
        }
    }
}
