//! Packings from a recipe.
//!
//! Random grains that do not touch are compressed to four times σ0 and unloaded to σ0 with the friction of
//! the preparation, then brought to equilibrium with the final friction and cohesion, and turned. What was tried, and
//! what void ratios and strengths come out, is in docs/packings.md.

mod densify;
mod error;
mod quality;
mod recipe;
mod scatter;
mod settle;
mod sizes;
mod target;

use std::sync::Arc;

use rand_core::SeedableRng;
use rand_pcg::Pcg64;

use crate::{
    Grains, Rev, RevState,
    tensor::{Tensor2, apply, identity, product, rotation},
};
pub use error::PreparationError;
pub use quality::Quality;
use recipe::isotropic;
pub use recipe::{AnisotropicStress, Recipe};
pub use sizes::{Fraction, Sizes, SizesError};
pub use target::{Means, Quantity, Target};

/// Grains are first pressed to this multiple of σ0. The detour makes frictionless packings denser (void ratio 0.1789
/// instead of 0.1804, mean of 24 seeds), frictional ones less dependent on how the grains met, and both
/// settle in half the cycles.
const OVERPRESSURE: f64 = 4.0;

/// The phases under an anisotropic stress.
const ANISOTROPIC: &str = "compression under the anisotropic stress";
/// Largest change of a component of F − 1 in such a phase, beyond which grains flow rather than bear.
const LARGEST_DISTORTION: f64 = 0.2;

/// A packing with its quality.
#[derive(Clone, Debug)]
struct Prepared {
    rev: Rev<2, 1>,
    quality: Quality,
}

/// Makes the packing of `recipe`.
///
/// # Errors
/// [`PreparationError`] when the recipe is out of range, a phase does not settle, or its target is not reached.
pub fn prepare(recipe: &Recipe) -> Result<(Rev<2, 1>, Quality), PreparationError> {
    recipe.check()?;
    let batch = Batch::scatter(recipe);
    let mut prepared = match &recipe.target {
        Some(target) => target.search(&batch)?,
        None => batch.with_friction(recipe.preparation_friction)?,
    };
    turn(&mut prepared, recipe.orientation);
    Ok((prepared.rev, prepared.quality))
}

/// Brings a packing made elsewhere to equilibrium under the isotropic `pressure` (positive in
/// compression), its contact law as it is.
///
/// # Errors
/// [`PreparationError`] when it does not settle.
pub fn settle(rev: &Rev<2, 1>, pressure: f64) -> Result<(Rev<2, 1>, Quality), PreparationError> {
    let (rev, relaxed) =
        settle::under_pressure(rev, &isotropic(pressure), "settling of the packing")?;
    let quality = Quality::of(&rev, &relaxed);
    Ok((rev, quality))
}

/// The scattered grains of a recipe, from which packings of different density are made.
struct Batch<'a> {
    recipe: &'a Recipe,
    scattered: Rev<2, 1>,
}

impl<'a> Batch<'a> {
    fn scatter(recipe: &'a Recipe) -> Self {
        let mut rng = Pcg64::seed_from_u64(recipe.seed);
        let grains = Arc::new(Grains {
            radii: recipe.sizes.radii(recipe.grains),
        });
        let (cell, positions) = scatter::scatter(&grains, recipe.aspect_ratio, &mut rng);
        let scattered = Rev {
            grains,
            law: recipe.preparation_law(recipe.preparation_friction),
            state: RevState {
                cell,
                positions,
                contacts: Vec::new(),
            },
        };
        Self { recipe, scattered }
    }

    /// The finished packing that `friction` while compressing gives.
    fn with_friction(&self, friction: f64) -> Result<Prepared, PreparationError> {
        let (rev, cycles) = self.compressed(friction)?;
        let mut prepared = self.finished(&rev)?;
        prepared.quality.cycles += cycles;
        prepared.quality.preparation_friction = Some(friction);
        Ok(prepared)
    }

    /// The grains after compression with `friction`, and the cycles it took.
    fn compressed(&self, friction: f64) -> Result<(Rev<2, 1>, u32), PreparationError> {
        let mut rev = Rev {
            law: self.recipe.preparation_law(friction),
            ..self.scattered.clone()
        };
        let mut cycles = 0;
        let (sigma0, high) = (
            self.recipe.confining_stress,
            OVERPRESSURE * self.recipe.confining_stress,
        );
        // A gas does not bear a deviator: it is pressed together first.
        let mut phases = vec![(isotropic(high), "compression")];
        if let Some(anisotropy) = self.recipe.anisotropy {
            phases.push((anisotropy.pressure(high), ANISOTROPIC));
            phases.push((anisotropy.pressure(sigma0), ANISOTROPIC));
        } else {
            phases.push((isotropic(sigma0), "unloading to the confining stress"));
        }
        for (pressure, phase) in &phases {
            let (next, relaxed) = settle::under_pressure(&rev, pressure, phase)
                .map_err(|error| self.explained(error, phase, friction))?;
            if *phase == ANISOTROPIC && distortion(&rev, &next) > LARGEST_DISTORTION {
                return Err(self.flows(friction));
            }
            rev = next;
            cycles += relaxed.cycles;
        }
        Ok((rev, cycles))
    }

    /// What does not settle under an anisotropic stress flows, until its cell is a needle or its cycles are spent.
    fn explained(&self, error: PreparationError, phase: &str, friction: f64) -> PreparationError {
        match error {
            PreparationError::NotSettled { .. } | PreparationError::TooFewGrains
                if phase == ANISOTROPIC =>
            {
                self.flows(friction)
            }
            error => error,
        }
    }

    fn flows(&self, friction: f64) -> PreparationError {
        PreparationError::Flows {
            stress_ratio: self.recipe.anisotropy.map_or(1.0, |a| a.stress_ratio),
            friction,
        }
    }

    /// A compressed packing at rest under σ0 with its final law.
    fn finished(&self, compressed: &Rev<2, 1>) -> Result<Prepared, PreparationError> {
        let rev = Rev {
            law: self.recipe.law(),
            ..compressed.clone()
        };
        let pressure = isotropic(self.recipe.confining_stress);
        let (rev, relaxed) =
            settle::under_pressure(&rev, &pressure, "equilibration with the final law")?;
        let quality = Quality::of(&rev, &relaxed);
        Ok(Prepared { rev, quality })
    }
}

/// The largest component of F − 1 from one state to the next. Where the lattice was reduced in between, it is
/// large, too: that takes a shear of ½.
fn distortion(from: &Rev<2, 1>, to: &Rev<2, 1>) -> f64 {
    let Some(back) = from.state.cell.inverse() else {
        return f64::INFINITY;
    };
    let gradient = product(&to.state.cell.h, &back);
    let unit: Tensor2<2> = identity();
    let mut largest: f64 = 0.0;
    for k in 0..2 {
        for l in 0..2 {
            largest = largest.max((gradient[k][l] - unit[k][l]).abs());
        }
    }
    largest
}

/// Turns a packing with its cell as a rigid body, counter-clockwise. Tangential forces turn along by themselves.
fn turn(prepared: &mut Prepared, angle: f64) {
    if angle == 0.0 {
        return;
    }
    let rotation = rotation(angle);
    let state = &mut prepared.rev.state;
    state.cell = state.cell.deformed(&rotation);
    for position in &mut state.positions {
        *position = apply(&rotation, position);
    }
    prepared.quality.direction = quality::statistics(&prepared.rev)
        .contact_anisotropy
        .direction;
}
