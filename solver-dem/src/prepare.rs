//! Packings from a recipe.

use std::sync::Arc;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    Cell, ContactLaw, Grains, Rev, RevState,
    dynamics::{Assembly, Friction},
    relax::{CellMotion, Limits, Outcome, relax},
    settings::Settings,
    tensor::Vector,
};

/// Solid fraction of the random grains before compression.
const INITIAL_SOLID_FRACTION: f64 = 0.45;
/// Largest strain of the cell per cycle while compressing, and the damping meanwhile: brisk and lightly
/// damped, grains rearrange more and pack denser (e = 0.179–0.184 against 0.179–0.190 at the
/// damping of a load step).
const COMPRESSION_RATE: f64 = 3e-4;
const COMPRESSION_DAMPING: f64 = 0.2;

/// What makes a packing. Lengths come out with the mean diameter a = 1; the response of a REV to a
/// deformation has no length scale of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Number of grains.
    pub grains: u32,
    /// Rmax/Rmin; sizes are spread evenly between.
    pub size_ratio: f64,
    /// σ0: isotropic compression, stress units, > 0.
    pub confining_stress: f64,
    /// κ = kn/σ0 (2D).
    pub stiffness: f64,
    /// kt/kn.
    pub tangential_stiffness: f64,
    /// μ after preparation.
    pub friction: f64,
    /// μ while compressing: 0 gives a dense packing, μ a loose one.
    pub preparation_friction: f64,
    /// f_c/(a σ0), switched on after compression. Part of the literature defines P* as the inverse.
    pub cohesion_ratio: f64,
    /// Same seed, same bits.
    pub seed: u64,
}

/// What a preparation reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Largest unbalanced force over the mean contact force.
    pub residual: f64,
    /// Largest error of a stress component over σ0, shear included.
    pub stress_error: f64,
    /// e.
    pub void_ratio: f64,
    /// z, rattlers included.
    pub coordination: f64,
    /// Grains with fewer than two contacts.
    pub rattlers: u32,
    /// Cycles of both phases.
    pub cycles: u32,
}

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
    /// The cell became too small for its grains.
    #[error(
        "the cell is smaller than two cut-off lengths: take more grains or a smaller size ratio"
    )]
    TooFewGrains,
}

impl Recipe {
    /// The law while compressing: no cohesion, friction of the preparation.
    fn preparation_law(&self) -> ContactLaw {
        let kn = self.stiffness * self.confining_stress;
        ContactLaw {
            normal_stiffness: kn,
            tangential_stiffness: self.tangential_stiffness * kn,
            friction: self.preparation_friction,
            cohesion: 0.0,
        }
    }

    /// The law of the finished packing, f_c = p* a σ0 with a = 1.
    pub fn law(&self) -> ContactLaw {
        ContactLaw {
            friction: self.friction,
            cohesion: self.cohesion_ratio * self.confining_stress,
            ..self.preparation_law()
        }
    }

    fn check(&self) -> Result<(), PreparationError> {
        let ranges = [
            (self.grains >= 16, "at least 16 grains are needed"),
            (
                self.size_ratio >= 1.0 && self.size_ratio <= 20.0,
                "size_ratio must be in [1, 20]",
            ),
            (
                self.confining_stress > 0.0 && self.confining_stress.is_finite(),
                "confining_stress must be > 0",
            ),
            (
                self.stiffness >= 10.0 && self.stiffness.is_finite(),
                "stiffness must be at least 10",
            ),
            (
                self.tangential_stiffness >= 0.0 && self.tangential_stiffness <= 10.0,
                "tangential_stiffness must be in [0, 10]",
            ),
            (
                self.friction >= 0.0 && self.friction.is_finite(),
                "friction must be ≥ 0",
            ),
            (
                self.preparation_friction >= 0.0 && self.preparation_friction.is_finite(),
                "preparation_friction must be ≥ 0",
            ),
            (
                self.cohesion_ratio >= 0.0 && self.cohesion_ratio.is_finite(),
                "cohesion_ratio must be ≥ 0",
            ),
        ];
        match ranges.iter().find(|(fine, _)| !fine) {
            Some((_, problem)) => Err(PreparationError::Recipe((*problem).into())),
            None => Ok(()),
        }
    }
}

/// Makes the packing of `recipe`: random grains without contact, compressed isotropically under
/// stress control, then brought to equilibrium with the final friction and cohesion.
///
/// # Errors
/// [`PreparationError`] when the recipe is out of range or a phase does not settle.
pub fn prepare(recipe: &Recipe) -> Result<(Rev<2, 1>, Quality), PreparationError> {
    recipe.check()?;
    let mut rng = Pcg64::seed_from_u64(recipe.seed);
    let grains = Arc::new(Grains {
        radii: radii(recipe),
    });
    let (cell, positions) = scatter(&grains, &mut rng);
    let rev = Rev {
        grains,
        law: recipe.preparation_law(),
        state: RevState {
            cell,
            positions,
            contacts: Vec::new(),
        },
    };
    let (mut rev, first) = equilibrate(&rev, recipe.confining_stress, "isotropic compression")?;
    rev.law = recipe.law();
    let (rev, last) = equilibrate(
        &rev,
        recipe.confining_stress,
        "equilibration with the final law",
    )?;
    let quality = Quality {
        residual: last.residual,
        stress_error: last.stress_error,
        void_ratio: rev.void_ratio(),
        coordination: rev.coordination(),
        rattlers: rev.rattlers() as u32,
        cycles: first.cycles + last.cycles,
    };
    Ok((rev, quality))
}

/// Brings a packing made elsewhere to equilibrium under the isotropic `pressure` (positive in
/// compression), its contact law as it is.
///
/// # Errors
/// [`PreparationError`] when it does not settle.
pub fn settle(rev: &Rev<2, 1>, pressure: f64) -> Result<(Rev<2, 1>, Quality), PreparationError> {
    let (rev, relaxed) = equilibrate(rev, pressure, "settling of the packing")?;
    let quality = Quality {
        residual: relaxed.residual,
        stress_error: relaxed.stress_error,
        void_ratio: rev.void_ratio(),
        coordination: rev.coordination(),
        rattlers: rev.rattlers() as u32,
        cycles: relaxed.cycles,
    };
    Ok((rev, quality))
}

/// Brings a REV to equilibrium under the isotropic pressure, its cell free in all but rotation.
pub(crate) fn equilibrate(
    rev: &Rev<2, 1>,
    pressure: f64,
    phase: &str,
) -> Result<(Rev<2, 1>, crate::relax::Relaxed), PreparationError> {
    let n = rev.state.positions.len();
    let settings = Settings {
        tolerance: 1e-6,
        drift_tolerance: 1e-5,
        ..Settings::default()
    };
    let mut assembly = Assembly::new(
        rev,
        rev.state.cell,
        rev.state.positions.clone(),
        vec![0.0; n],
    )
    .ok_or(PreparationError::TooFewGrains)?;
    assembly.make_brisk(COMPRESSION_DAMPING);
    let stress = [[Some(-pressure), Some(0.0)], [None, Some(-pressure)]];
    let mut motion = CellMotion::stress_driven(stress, COMPRESSION_RATE);
    let limits = Limits {
        friction: Friction::Path,
        cap: 400_000,
        rebase_after: u32::MAX,
    };
    let relaxed = relax(&mut assembly, &mut motion, &limits, &settings);
    match relaxed.outcome {
        Outcome::Equilibrium => Ok((
            Rev {
                grains: rev.grains.clone(),
                law: rev.law,
                state: assembly.state(),
            },
            relaxed,
        )),
        Outcome::CellTooSmall => Err(PreparationError::TooFewGrains),
        Outcome::Exhausted => Err(PreparationError::NotSettled {
            phase: phase.into(),
            cycles: relaxed.cycles,
            residual: relaxed.residual,
            stress_error: relaxed.stress_error,
        }),
    }
}

/// Radii spread evenly over [Rmin, Rmax] with mean ½, largest first.
fn radii(recipe: &Recipe) -> Vec<f64> {
    let smallest = 1.0 / (1.0 + recipe.size_ratio);
    let largest = recipe.size_ratio * smallest;
    let n = f64::from(recipe.grains);
    (0..recipe.grains)
        .map(|k| largest - (largest - smallest) * (f64::from(k) + 0.5) / n)
        .collect()
}

/// Random sequential placement without overlap in a square cell.
fn scatter(grains: &Grains, rng: &mut Pcg64) -> (Cell<2>, Vec<Vector<2>>) {
    let mut side = (grains.solid_volume::<2>() / INITIAL_SOLID_FRACTION).sqrt();
    loop {
        if let Some(positions) = place(grains, side, rng) {
            return (Cell::rectangular([side; 2]), positions);
        }
        // Rare: the early large grains left no room for a later one.
        side *= 1.02;
    }
}

fn place(grains: &Grains, side: f64, rng: &mut Pcg64) -> Option<Vec<Vector<2>>> {
    let mut placed: Vec<Vector<2>> = Vec::with_capacity(grains.radii.len());
    for (grain, radius) in grains.radii.iter().enumerate() {
        let free = |x: &Vector<2>| {
            placed.iter().zip(&grains.radii[..grain]).all(|(y, other)| {
                let d2: f64 = (0..2)
                    .map(|k| {
                        let d = x[k] - y[k];
                        d - side * (d / side).round()
                    })
                    .map(|d| d * d)
                    .sum();
                d2 > (radius + other) * (radius + other)
            })
        };
        let position = (0..20_000)
            .map(|_| [side * uniform(rng), side * uniform(rng)])
            .find(free)?;
        placed.push(position);
    }
    Some(placed)
}

/// Uniform in [0, 1) from the 53 high bits of a draw.
fn uniform(rng: &mut Pcg64) -> f64 {
    const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
    (rng.next_u64() >> 11) as f64 * UNIT
}
