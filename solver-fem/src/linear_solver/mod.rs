//! Sparse linear solution behind a trait.
//!
//! The symbolic analysis belongs to the solver and is done once per problem; a factorisation is a
//! value of its own. Two implementations of the same two traits check each other: an element
//! multifrontal LU, which is the default, and faer's supernodal one.

mod checked;
mod faer_lu;
mod multifrontal;
mod scaling;

use std::sync::Arc;

use thiserror::Error;

use crate::assembly::Pattern;
use crate::layout::Field;

use faer_lu::FaerLu;
use multifrontal::Multifrontal;

/// The solvers at hand with their versions: with the processor's features, where it is faer that solves, they decide
/// the last bits of a macro solve.
pub const VERSIONS: &str = "multifrontal 1, faer 0.24.4";

/// A linear solver by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// LU along a dissection of the mesh, the same bits on every processor.
    #[default]
    Multifrontal,
    /// The sparse LU of faer, a general library.
    Faer,
}

impl Method {
    /// Does what depends on the pattern alone. `fields` holds the field of every equation, `centres` the centre of
    /// every element of the pattern.
    ///
    /// # Errors
    /// Lack of memory.
    ///
    /// # Panics
    /// When there is not one field per equation and one centre per element.
    pub fn analyse<const D: usize>(
        self,
        pattern: &Arc<Pattern>,
        fields: Vec<Field>,
        centres: &[[f64; D]],
    ) -> Result<Box<dyn LinearSolver>, LinearError> {
        let pattern = Arc::clone(pattern);
        Ok(match self {
            Method::Multifrontal => Box::new(Multifrontal::analyse(pattern, fields, centres)),
            Method::Faer => Box::new(FaerLu::analyse(pattern, fields)?),
        })
    }
}

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
