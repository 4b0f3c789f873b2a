//! Why a packing could not be made.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::target::Quantity;

/// Why a packing could not be made.
#[derive(Clone, Debug, Error, PartialEq, Serialize, Deserialize)]
pub enum PreparationError {
    /// The recipe itself is unusable.
    #[error("invalid recipe: {0}")]
    Recipe(String),
    /// A phase did not settle.
    #[error(
        "{phase} did not settle in {cycles} cycles (residual {residual:.2e}, stress error {stress_error:.2e})"
    )]
    NotSettled {
        /// Which phase.
        phase: String,
        /// Cycles done.
        cycles: u32,
        /// Residual reached.
        residual: f64,
        /// Stress error reached.
        stress_error: f64,
    },
    /// The grains flow under the anisotropic stress.
    #[error(
        "the grains flow under a stress ratio of {stress_ratio} at friction {friction}: \
         lower stress_ratio or raise preparation_friction"
    )]
    Flows {
        /// Ratio of the principal pressures.
        stress_ratio: f64,
        /// Friction while compressing.
        friction: f64,
    },
    /// The cell became too small for its grains.
    #[error(
        "the cell is smaller than two cut-off lengths: take more grains, a smaller size ratio or a less elongated cell"
    )]
    TooFewGrains,
    /// The target lies outside of what the means can reach.
    #[error(
        "{quantity} {wanted} is out of reach: {means} it can be brought from {from:.4} to {to:.4} with these grains"
    )]
    OutOfReach {
        /// What was to be reached.
        quantity: Quantity,
        /// Its value.
        wanted: f64,
        /// By what means, as a half-sentence.
        means: String,
        /// The reachable end nearest to the loosest packing.
        from: f64,
        /// The reachable end nearest to the densest packing.
        to: f64,
    },
    /// The target lies within reach, and no trial came close enough.
    #[error(
        "{quantity} {wanted} ± {tolerance} was not reached in {trials} trials; the closest was {closest:.4}: \
         allow a larger tolerance, or take more grains or another seed"
    )]
    Missed {
        /// What was to be reached.
        quantity: Quantity,
        /// Its value.
        wanted: f64,
        /// How close was close enough.
        tolerance: f64,
        /// Packings that were tried.
        trials: u32,
        /// The closest value.
        closest: f64,
    },
}
