//! From the input's words to the macro solver's problem.

use std::sync::Arc;

use solver_fem::{
    boundary::{Condition, Target, Value},
    linear_solver::Method,
    mesh::{Annulus, AnnulusExtent, Mesh, Rectangle},
    newton::{Relaxation, StepSettings, Strategy, TwoPhase},
    problem::{Problem, Setup},
    second_gradient::SecondGradient,
    step_control::StepControlSettings,
};

use super::error::RunError;
use crate::input::{
    self, Element, Programme, Sector, SolverSettings,
    problem::{Amount, Body, ConditionKind, Law, Material, Selection},
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
        let (problem, materials) = parts(body, loads)?;
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
        let (problem, materials) = parts(body, loads)?;
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

    /// The cells that draw its elements.
    pub fn cell_kind(&self) -> CellKind {
        match self.element {
            Element::Q8 | Element::Q8Full => CellKind::QuadraticQuad,
            Element::Q4 => CellKind::Quad,
            Element::T6 | Element::T6Full => CellKind::QuadraticTriangle,
        }
    }
}

/// A mesh and what its elements are made of.
pub struct Divided {
    /// The mesh with its regions.
    pub mesh: Mesh<2>,
    /// Index of the material of each element.
    pub materials: Vec<usize>,
    /// Index of the region that gave each element its material; `None` outside of all regions.
    pub regions: Vec<Option<usize>>,
}

/// The mesh of a body and its regions; where those overlap, the later one holds.
///
/// # Errors
/// What the mesh refuses.
pub fn divided(body: &Body) -> Result<Divided, RunError> {
    let mut mesh = mesh(&body.mesh)?;
    let mut materials = vec![body.material; mesh.element_count()];
    let mut regions = vec![None; mesh.element_count()];
    for (index, region) in body.regions.iter().enumerate() {
        let elements = match &region.selection {
            Selection::Elements(elements) => elements.iter().map(|&e| e as usize).collect(),
            Selection::Box(within) => mesh.elements_in_box(within.from, within.to),
        };
        mesh.assign_region(&region.name, &elements)
            .map_err(|error| RunError::Model(error.to_string()))?;
        for element in elements {
            materials[element] = region.material;
            regions[element] = Some(index);
        }
    }
    Ok(Divided {
        mesh,
        materials,
        regions,
    })
}

fn parts(body: &Body, loads: usize) -> Result<(Problem<2>, Vec<usize>), RunError> {
    let Divided {
        mesh, materials, ..
    } = divided(body)?;
    let mut conditions = conditions(body, &mesh);
    conditions.extend(body_force(body));
    let element = body.mesh.element().plane().element();
    let second_gradient = second_gradient(body, &mesh);
    let setup = Setup {
        second_gradient,
        ..Setup::new(mesh, element, conditions, loads)
    };
    let problem = Problem::build(setup).map_err(|error| RunError::Model(error.to_string()))?;
    Ok((problem, materials))
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

/// The modulus of every region of the mesh.
fn second_gradient(body: &Body, mesh: &Mesh<2>) -> SecondGradient {
    let Some(spec) = &body.second_gradient else {
        return SecondGradient::default();
    };
    let of_region = |name: &String| spec.regions.get(name).copied().unwrap_or(spec.modulus);
    SecondGradient {
        moduli: mesh.region_names.iter().map(of_region).collect(),
        sides: spec.sides.clone(),
    }
}

fn mesh(mesh: &input::Mesh) -> Result<Mesh<2>, RunError> {
    let (grid, per_row) = match mesh {
        input::Mesh::Rectangle(rectangle) => {
            let elements = rectangle.elements.map(|n| n as usize);
            let size = rectangle.size;
            (Mesh::rectangle(&Rectangle { size, elements }), elements[0])
        }
        input::Mesh::Annulus(annulus) => {
            let [circumferential, radial] = annulus.elements.map(|n| n as usize);
            let ring = Annulus {
                inner_radius: annulus.inner_radius,
                outer_radius: annulus.outer_radius,
                circumferential,
                radial,
                growth: annulus.growth,
                extent: match annulus.sector {
                    Sector::Quarter => AnnulusExtent::Quarter,
                    Sector::Half => AnnulusExtent::Half,
                    Sector::Full => AnnulusExtent::Full,
                },
            };
            (Mesh::annulus(&ring), radial)
        }
        input::Mesh::Imported(imported) => return Ok(imported.mesh()),
    };
    let grid = grid.map_err(|error| RunError::Model(error.to_string()))?;
    Ok(match mesh.element() {
        Element::Q8 | Element::Q8Full => grid,
        Element::Q4 => grid.into_linear(),
        Element::T6 | Element::T6Full => grid.into_triangles(per_row),
    })
}

fn conditions(body: &Body, mesh: &Mesh<2>) -> Vec<Condition> {
    let mut conditions = Vec::new();
    for condition in &body.conditions {
        let on = &condition.on;
        match condition.kind {
            ConditionKind::Displacement { component, value } => {
                let target = if mesh.boundaries.contains_key(on) {
                    Target::boundary(on)
                } else {
                    Target::node_set(on)
                };
                conditions.push(Condition::displacement(target, component, amount(value)));
            }
            ConditionKind::Pressure(value) => {
                conditions.push(Condition::Pressure {
                    boundary: on.clone(),
                    value: amount(value),
                });
            }
            ConditionKind::Traction(values) => {
                for (component, value) in values.into_iter().enumerate() {
                    // Along a held component a zero is how the input says that nothing acts.
                    if value == Amount::Constant(0.0) {
                        continue;
                    }
                    conditions.push(Condition::Traction {
                        boundary: on.clone(),
                        component,
                        value: amount(value),
                    });
                }
            }
        }
    }
    conditions
}

/// The components of a body force that are not 0 throughout.
fn body_force(body: &Body) -> impl Iterator<Item = Condition> {
    let components = body.body_force.into_iter().flatten().enumerate();
    components
        .filter(|(_, value)| *value != Amount::Constant(0.0))
        .map(|(component, value)| Condition::body_force(component, amount(value)))
}

fn amount(amount: Amount) -> Value {
    match amount {
        Amount::Constant(value) => Value::Constant(value),
        Amount::Load(index) => Value::load(index),
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
