//! Sparse linear solution behind a trait.
//!
//! The symbolic analysis belongs to the solver and is done once per problem; a factorisation is a
//! value of its own. faer's supernodal LU is the first backend; an element multifrontal one, which
//! the second-gradient saddle point will want, is another implementation of the same two traits.

mod faer_lu;

use thiserror::Error;

pub use faer_lu::{BACKEND, FaerLu};

/// A factorised matrix.
pub trait Factorisation {
    /// Solves A·x = b with one step of iterative refinement.
    ///
    /// # Errors
    /// A solution that is not finite.
    fn solve(&self, rhs: &[f64]) -> Result<Solution, LinearError>;
}

/// A solver that knows the pattern.
pub trait LinearSolver: std::fmt::Debug + Send + Sync {
    /// Factorises the matrix with these values on the pattern.
    ///
    /// # Errors
    /// Values that are not finite, or a singular matrix.
    fn factorise<'a>(
        &'a self,
        values: &'a [f64],
    ) -> Result<Box<dyn Factorisation + 'a>, LinearError>;
}

/// What a solve gives.
#[derive(Clone, PartialEq, Debug)]
pub struct Solution {
    /// The unknowns.
    pub x: Vec<f64>,
    /// ‖b − A·x‖/‖b‖ after refinement, 0 for b = 0.
    pub relative_residual: f64,
}

/// A linear system could not be solved.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum LinearError {
    /// The matrix is singular to working precision.
    #[error(
        "factorise the stiffness: it is singular at equation {equation} (amplification {amplification:.1e})"
    )]
    Singular {
        /// The equation that moves most in the motion without stiffness.
        equation: usize,
        /// Estimate of the condition number; infinite for an exact zero pivot.
        amplification: f64,
    },
    /// A value of the matrix or of the right-hand side is NaN or infinite.
    #[error("solve for the correction: a coefficient is not a finite number")]
    NonFinite,
    /// The library gave up, for lack of memory for example.
    #[error("factorise the stiffness: {0}")]
    Backend(String),
}
