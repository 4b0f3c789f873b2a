//! Finite elements for the macro scale of a hierarchical FEM×DEM computation.
//!
//! The crate knows meshes, elements, boundary conditions, assembly, sparse solution and the Newton
//! strategy. It knows no file, no thread, no clock and no constitutive law but an elastic one: the
//! load step is a **state machine** ([`newton::StepSolver`]) that asks for waves of constitutive
//! evaluations and is handed the answers, whoever computes them.
//!
//! Conventions: tension positive, plane strain with unit thickness in two dimensions, updated
//! Lagrangian at large strain (equilibrium is written on the end-of-step configuration). The space
//! dimension is the const generic `D`.
//!
//! ```
//! use std::sync::Arc;
//! use solver_fem::boundary::{Condition, Target, Value};
//! use solver_fem::elastic::Elastic;
//! use solver_fem::mesh::{Mesh, Rectangle};
//! use solver_fem::newton::{MacroState, Request, StepSettings, StepSolver};
//! use solver_fem::problem::Problem;
//!
//! let mesh = Mesh::rectangle(&Rectangle { size: [1.0, 2.0], elements: [2, 4] })?;
//! let conditions = vec![
//!     Condition::displacement(Target::boundary("bottom"), 1, Value::Constant(0.0)),
//!     Condition::displacement(Target::node_set("bottom_mid"), 0, Value::Constant(0.0)),
//!     Condition::displacement(Target::boundary("top"), 1, Value::load(0)),
//! ];
//! let problem = Arc::new(Problem::plane_strain(mesh, conditions, 1)?);
//! let law = Elastic::new(100.0, 0.3)?;
//! let points = problem.gauss_point_count();
//! let start = MacroState::initial(
//!     &problem, &vec![[[0.0; 2]; 2]; points], &vec![law.tangent(); points], &[0.0])?;
//! let mut step = StepSolver::begin(&problem, &start, &[0.0], &[-0.01], &StepSettings::smooth(1e-10))?;
//! let mut request = step.next();
//! let outcome = loop {
//!     request = match request {
//!         Request::Evaluate(wave) => {
//!             let responses: Vec<_> = wave.points.iter()
//!                 .map(|(point, f)| law.respond(&start.stress_at(*point), f))
//!                 .collect::<Result<_, _>>()?;
//!             step.advance(&responses)
//!         }
//!         Request::Converged(outcome) => break outcome,
//!         Request::Failed(failure) => return Err(failure.to_string().into()),
//!     };
//! };
//! assert!(outcome.state.reactions.iter().any(|force| force.abs() > 0.1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(missing_docs)]
// Results must not depend on the system's mathematics; see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod assembly;
pub mod boundary;
pub mod constitutive;
pub mod elastic;
pub mod element;
pub mod kinematics;
pub mod layout;
pub mod linear_solver;
pub mod mesh;
pub mod newton;
pub mod post;
pub mod problem;
pub mod second_gradient;
pub mod step_control;
pub mod tensor;

pub use constitutive::{Base, ConstitutiveResponse, GaussPointId, Smoothness, Wave};
pub use tensor::{Tensor2, Tensor4};
