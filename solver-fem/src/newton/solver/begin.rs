//! The beginning of a step attempt: from a committed state, or from a stored attempt.

use std::sync::Arc;

use thiserror::Error;

use super::StepSolver;
use crate::boundary::CavityProblem;
use crate::constitutive::Base;
use crate::newton::correction::predict;
use crate::newton::macro_state::StateError;
use crate::newton::state::{Size, Status, StepState, Trial};
use crate::newton::{Control, MacroState, Phase, Relaxation, StepSettings};
use crate::problem::Problem;

/// A step cannot be begun: the inputs do not fit together.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum BeginError {
    /// The committed state does not fit the problem.
    #[error("begin the step: {0}")]
    State(#[from] StateError),
    /// The cavity whose volume should be followed has none.
    #[error("begin the step: {0}")]
    Cavity(#[from] CavityProblem),
    /// The load that should adapt does not exist.
    #[error("begin the step: there is no load {load} to adapt")]
    Control {
        /// The load.
        load: usize,
    },
    /// The wrong number of load values, or one that is not finite.
    #[error("begin the step: {found} finite load values were given, the problem has {expected}")]
    Loads {
        /// Number of loads of the problem.
        expected: usize,
        /// Number of finite values given.
        found: usize,
    },
}

/// A stored step attempt does not belong to the problem.
#[derive(Error, Clone, PartialEq, Debug)]
#[error("restore the step: {what} does not fit the problem")]
pub struct RestoreError {
    what: &'static str,
}

impl<const D: usize> StepSolver<D> {
    /// Begins a step from the committed state, loads going from `values_n` to `values_next`.
    ///
    /// Prescribed displacements move by the change of their value over the step, external loads
    /// take their new value. A predictor that cannot be computed is not an error of this function
    /// but a first request [`Request::Failed`](super::Request::Failed): a shorter step may succeed.
    ///
    /// # Errors
    /// A state or load values that do not fit the problem.
    pub fn begin(
        problem: &Arc<Problem<D>>,
        committed: &MacroState<D>,
        values_n: &[f64],
        values_next: &[f64],
        settings: &StepSettings,
    ) -> Result<Self, BeginError> {
        Self::begin_controlled(problem, committed, (values_n, values_next, None), settings)
    }

    /// Begins a step as [`begin`](Self::begin) does, in which the load that `control` names adapts to what is followed; its
    /// next value is where the search begins.
    ///
    /// # Errors
    /// Also a control that does not fit the problem.
    pub fn begin_controlled(
        problem: &Arc<Problem<D>>,
        committed: &MacroState<D>,
        (values_n, values_next, control): (&[f64], &[f64], Option<&Control>),
        settings: &StepSettings,
    ) -> Result<Self, BeginError> {
        committed.check(problem)?;
        if let Some(control) = control {
            control.check(problem)?;
            if control.load >= problem.load_count() {
                return Err(BeginError::Control { load: control.load });
            }
        }
        for values in [values_n, values_next] {
            let found = values.iter().filter(|value| value.is_finite()).count();
            let expected = problem.load_count();
            if values.len() != expected || found != expected {
                return Err(BeginError::Loads { expected, found });
            }
        }
        let mut prescribed = vec![0.0; problem.layout().len()];
        for given in &problem.constraints().prescribed {
            prescribed[given.dof] = given.value.at(values_next) - given.value.at(values_n);
        }
        let mut solver = StepSolver {
            problem: Arc::clone(problem),
            state: StepState {
                settings: *settings,
                committed: committed.clone(),
                control: control.cloned(),
                trial: Trial {
                    wave: 0,
                    phase: Phase::Pure,
                    base: Base::Committed,
                    start: None,
                    coordinates: committed.unknowns(),
                    loads: values_next.to_vec(),
                    base_coordinates: Vec::new(),
                    from: committed.unknowns(),
                    from_loads: values_next.to_vec(),
                    unbalanced: Vec::new(),
                    released: 0.0,
                    halvings: 0,
                    correction: 1.0,
                    size: Size::Significant,
                    safeguarded: 0,
                    linear_residual: 0.0,
                    damped: 0.0,
                },
                best: None,
                restored: None,
                previous_residual: None,
                reach: f64::INFINITY,
                viscosity: Relaxation::FIRST_VISCOSITY,
                predictor_tangents: committed.predictor_tangents.clone(),
                sweeps: Vec::new(),
                status: Status::Evaluating,
            },
        };
        let loads = (values_next, control);
        match predict(problem, committed, loads, &prescribed, settings) {
            Ok((correction, reach)) => {
                solver.state.reach = reach;
                solver.adopt(correction);
            }
            Err(reason) => solver.fail(reason),
        }
        Ok(solver)
    }

    /// Goes on with a stored attempt.
    ///
    /// # Errors
    /// A state that was not stored for this problem.
    pub fn restore(problem: &Arc<Problem<D>>, state: StepState<D>) -> Result<Self, RestoreError> {
        state.committed.check(problem).map_err(|_| RestoreError {
            what: "the committed state",
        })?;
        let (dofs, points) = (problem.layout().len(), problem.gauss_point_count());
        let trial = &state.trial;
        let base_fits = match trial.base {
            Base::Committed => trial.base_coordinates.is_empty(),
            Base::Wave(_) => trial.base_coordinates.len() == dofs,
        };
        let best_fits = state.best.as_ref().is_none_or(|best| {
            best.coordinates.len() == dofs
                && best.stress.len() == points * D * D
                && best.tangents.len() == points * D * D * D * D
                && best.elastic_tangents.len() == best.tangents.len()
                && best.rebased.len() == points
        });
        for (fits, what) in [
            (
                [&trial.loads, &trial.from_loads]
                    .iter()
                    .all(|loads| loads.len() == problem.load_count()),
                "the list of loads",
            ),
            (
                trial.coordinates.len() == dofs
                    && trial.from.len() == dofs
                    && [0, dofs].contains(&trial.unbalanced.len())
                    && base_fits,
                "the pending wave",
            ),
            (best_fits, "the best iterate"),
            (
                state.predictor_tangents.len() == points * D * D * D * D,
                "the list of predictor tangents",
            ),
        ] {
            if !fits {
                return Err(RestoreError { what });
            }
        }
        Ok(StepSolver {
            problem: Arc::clone(problem),
            state,
        })
    }
}
