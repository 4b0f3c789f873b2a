//! A body ready for the macro solver, and how it is solved.

use std::sync::Arc;

use solver_fem::{
    boundary::Target,
    linear_solver::Method,
    newton::{Relaxation, StepSettings, Strategy, TwoPhase},
    problem::Problem,
    step_control::StepControlSettings,
};

use super::error::RunError;
use crate::input::{
    self, Element, Programme, SolverSettings, body,
    problem::{Body, Law, Material},
};
use crate::output::vtu::CellKind;

/// A body ready for the macro solver.
pub struct Model {
    /// The boundary value problem.
    pub problem: Arc<Problem<2>>,
    /// Index of the material of each element.
    pub materials: Vec<usize>,
    /// The kind of its elements.
    pub element: Element,
}

impl Model {
    /// Builds the mesh, its regions and its boundary conditions.
    ///
    /// # Errors
    /// What the mesh or the conditions refuse.
    pub fn new(body: &Body, loads: usize) -> Result<Self, RunError> {
        let (problem, materials) = body::problem(body, loads)?;
        Ok(Self {
            problem: Arc::new(problem),
            materials,
            element: body.mesh.element(),
        })
    }

    /// The same, with the linear solver that the settings ask for.
    ///
    /// # Errors
    /// What the mesh, the conditions or the linear solver refuse.
    pub fn to_solve(body: &Body, loads: usize, solver: &SolverSettings) -> Result<Self, RunError> {
        let (problem, materials) = body::problem(body, loads)?;
        let problem = match solver.linear_solver {
            input::LinearSolver::Multifrontal => problem,
            input::LinearSolver::Faer => problem
                .solved_by(Method::Faer)
                .map_err(|error| RunError::Model(error.to_string()))?,
        };
        Ok(Self {
            problem: Arc::new(problem),
            materials,
            element: body.mesh.element(),
        })
    }

    /// Whether every volume that a programme asks for can be measured.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check(&self, programme: &Programme) -> Result<(), RunError> {
        let mut boundaries = programme.cavities();
        boundaries.try_for_each(|boundary| {
            let cavity = self.problem.cavity(boundary).map(|_| ());
            cavity.map_err(|error| RunError::Model(format!("measure a volume: {error}")))
        })
    }

    /// The boundary of this name, or the node set where there is no such boundary.
    pub fn target(&self, name: &str) -> Target {
        body::target(self.problem.mesh(), name)
    }

    /// The cells that draw its elements.
    pub fn cell_kind(&self) -> CellKind {
        match self.element {
            Element::Q8 | Element::Q8Full => CellKind::QuadraticQuad,
            Element::Q4 => CellKind::Quad,
            Element::T6 | Element::T6Full => CellKind::QuadraticTriangle,
        }
    }
}

/// Whether what a problem asks of its body can be computed, volumes above all.
///
/// # Errors
/// What the mesh or the conditions refuse, and the first volume that cannot be measured.
pub fn check(problem: &input::Problem) -> Result<(), RunError> {
    match &problem.model {
        input::problem::Model::Body(body) => {
            Model::new(body, problem.loads.len())?.check(&problem.programme)
        }
        input::problem::Model::ElementTest(_) => Ok(()),
    }
}

/// How a load step is solved: in two phases where grains answer, by plain Newton where nothing but
/// elastic laws does.
pub fn step_settings(solver: &SolverSettings, materials: &[Material]) -> StepSettings {
    let grains = materials
        .iter()
        .any(|material| matches!(material.law, Law::Rev(_)));
    let strategy = if grains {
        Strategy::TwoPhase(TwoPhase {
            sweeps: solver.iterations as usize,
            relaxation: Relaxation {
                sweeps: solver.relaxation_iterations as usize,
                ..Relaxation::default()
            },
            loose_tolerance: solver.loosest_force_tolerance,
            ..TwoPhase::default()
        })
    } else {
        Strategy::Plain {
            max_sweeps: solver.iterations as usize,
        }
    };
    StepSettings {
        force_tolerance: solver.force_tolerance,
        displacement_tolerance: solver.displacement_tolerance,
        strategy,
        ..StepSettings::default()
    }
}

/// How the step size follows success and failure.
pub fn step_control(solver: &SolverSettings) -> StepControlSettings {
    StepControlSettings {
        floor: solver.smallest_step,
        growth: solver.step_growth,
        damped_work: solver.damped_work,
        ..StepControlSettings::default()
    }
}

/// How a REV is solved in the iterations of a body: it answers also where it gives way or does not come to rest, so that the
/// body can go on to where it does. What a step may end with is another matter, see [`TaskPolicy::voids`](super::attempt::TaskPolicy::voids).
pub fn iterate_settings(solver: &SolverSettings) -> solver_dem::Settings {
    solver_dem::Settings {
        loss_of_confinement: solver_dem::LossOfConfinement::Allow,
        unsettled: solver_dem::Unsettled::Answer,
        ..rev_settings(solver)
    }
}

/// How a REV is solved.
pub fn rev_settings(solver: &SolverSettings) -> solver_dem::Settings {
    solver_dem::Settings {
        tolerance: solver.rev_tolerance,
        loss_of_confinement: match solver.loss_of_confinement {
            input::LossOfConfinement::Fail | input::LossOfConfinement::Isolated => {
                solver_dem::LossOfConfinement::Fail
            }
            input::LossOfConfinement::Allow => solver_dem::LossOfConfinement::Allow,
        },
        ..solver_dem::Settings::default()
    }
}
