//! One load step as a state machine: predictor, Newton sweeps in two phases, outcome.
//!
//! [`StepSolver`] never calls a constitutive law. It says which evaluations it wants
//! ([`Request::Evaluate`]), is handed the answers, and can be stored and restored at any wave.
//! `docs/design/coupling.md` tells why the strategy is what it is.

mod control;
mod correction;
mod linearised;
mod macro_state;
mod plan;
mod relaxation;
mod report;
mod safeguard;
mod settings;
mod solver;
mod state;

pub use control::{Control, Path};
pub use macro_state::{MacroState, StateError};
pub use relaxation::Relaxation;
pub use report::{Acceptance, FailureReason, Phase, StepFailure, StepOutcome, SweepReport};
pub use safeguard::{Safeguard, Safeguarded, safeguard};
pub use settings::{StepSettings, Strategy, TwoPhase};
pub use solver::{BeginError, Request, RestoreError, StepSolver};
pub use state::StepState;
