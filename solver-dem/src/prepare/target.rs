//! What a packing must reach, and the search for it.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Batch, PreparationError, Prepared, densify};

/// Between these values of friction the search looks: above 1 hardly anything slides any more.
const FRICTIONS: [f64; 2] = [0.0, 1.0];
/// Packings that the search makes at most.
const TRIALS: u32 = 30;

/// What the finished packing must reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Which figure.
    pub quantity: Quantity,
    /// Its value.
    pub value: f64,
    /// How far from it is close enough, > 0.
    pub tolerance: f64,
    /// What is varied.
    pub by: Means,
}

/// A figure of a packing that a target can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// e.
    VoidRatio,
    /// z, rattlers included.
    Coordination,
}

/// How a target is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Means {
    /// By the friction while compressing.
    Friction,
    /// By cycles of simple shear, 0 → γ → −γ → 0 at constant pressure, of the packing that
    /// `preparation_friction` gives.
    ShearCycles {
        /// γ, in (0, 0.2].
        amplitude: f64,
        /// Friction during the cycles, ≥ 0.
        friction: f64,
    },
    /// By cycles of isotropic compression, σ0 → kσ0 → σ0, of the same packing.
    CompressionCycles {
        /// k, in (1, 100].
        ratio: f64,
        /// Friction during the cycles, ≥ 0.
        friction: f64,
    },
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::VoidRatio => "void ratio",
            Self::Coordination => "coordination",
        })
    }
}

impl Target {
    pub(super) fn check(&self) -> Result<(), PreparationError> {
        let fine = |value: f64| value > 0.0 && value.is_finite();
        let problem = if !fine(self.value) {
            "the target must be a positive number"
        } else if !fine(self.tolerance) {
            "the tolerance of the target must be a positive number"
        } else {
            let friction = match self.by {
                Means::Friction => 0.0,
                Means::ShearCycles { friction, .. } | Means::CompressionCycles { friction, .. } => {
                    friction
                }
            };
            match self.by {
                Means::ShearCycles { amplitude, .. } if !(amplitude > 0.0 && amplitude <= 0.2) => {
                    "the amplitude of shear cycles must be in (0, 0.2]"
                }
                Means::CompressionCycles { ratio, .. } if !(ratio > 1.0 && ratio <= 100.0) => {
                    "the ratio of compression cycles must be in (1, 100]"
                }
                _ if !(friction >= 0.0 && friction.is_finite()) => {
                    "the friction during cycles must be ≥ 0"
                }
                _ => return Ok(()),
            }
        };
        Err(PreparationError::Recipe(problem.into()))
    }

    /// What the packing has of it.
    pub(super) fn of(&self, prepared: &Prepared) -> f64 {
        match self.quantity {
            Quantity::VoidRatio => prepared.quality.void_ratio,
            Quantity::Coordination => prepared.quality.coordination,
        }
    }

    /// How much too loose the packing is, in units of the tolerance: below −1 too dense, above 1 too loose.
    pub(super) fn looseness(&self, prepared: &Prepared) -> f64 {
        let excess = self.of(prepared) - self.value;
        match self.quantity {
            Quantity::VoidRatio => excess / self.tolerance,
            Quantity::Coordination => -excess / self.tolerance,
        }
    }

    /// The packing of `batch` that has it.
    pub(super) fn search(&self, batch: &Batch<'_>) -> Result<Prepared, PreparationError> {
        match self.by {
            Means::Friction => self.by_friction(batch),
            Means::ShearCycles { friction, .. } | Means::CompressionCycles { friction, .. } => {
                densify::by_cycles(self, friction, batch)
            }
        }
    }

    /// Bisection. Packings scatter as much between two values of friction that nearly agree as between two seeds, so that
    /// the void ratio is no continuous function of friction: a trial that lands within the tolerance ends the search, and
    /// the halving only leads to where such trials are frequent.
    fn by_friction(&self, batch: &Batch<'_>) -> Result<Prepared, PreparationError> {
        let [mut low, mut high] = FRICTIONS;
        let (densest, loosest) = (batch.with_friction(low)?, batch.with_friction(high)?);
        let mut cycles = densest.quality.cycles + loosest.quality.cycles;
        let ends = [&densest, &loosest].map(|end| (self.of(end), self.looseness(end)));
        if ends[0].1 > 1.0 || ends[1].1 < -1.0 {
            return Err(PreparationError::OutOfReach {
                quantity: self.quantity,
                wanted: self.value,
                means: format!(
                    "by friction between {} and {} while compressing",
                    FRICTIONS[0], FRICTIONS[1]
                ),
                from: ends[1].0,
                to: ends[0].0,
            });
        }
        let mut closest = if ends[0].1.abs() <= ends[1].1.abs() {
            densest
        } else {
            loosest
        };
        let mut trials = 2;
        while self.looseness(&closest).abs() > 1.0 {
            if trials == TRIALS {
                return Err(self.missed(trials, &closest));
            }
            trials += 1;
            let friction = 0.5 * (low + high);
            let trial = batch.with_friction(friction)?;
            cycles += trial.quality.cycles;
            let looseness = self.looseness(&trial);
            if looseness > 0.0 {
                high = friction;
            } else {
                low = friction;
            }
            if looseness.abs() < self.looseness(&closest).abs() {
                closest = trial;
            }
        }
        closest.quality.cycles = cycles;
        Ok(closest)
    }

    pub(super) fn missed(&self, trials: u32, closest: &Prepared) -> PreparationError {
        PreparationError::Missed {
            quantity: self.quantity,
            wanted: self.value,
            tolerance: self.tolerance,
            trials,
            closest: self.of(closest),
        }
    }
}
