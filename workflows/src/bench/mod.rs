//! Measurements on the user's machine. Commands that print figures, never tests of time.

mod cycles;
mod increments;
pub mod macro_scale;
mod memory;
pub mod rev;
mod specimen;
mod statistics;
pub mod store;

use solver_dem::{PreparationError, Recipe, Rev, prepare};

/// The packing on which solvers are compared: σ0 = 1, kn = kt = 1000 σ0, μ = 0.5, Rmax/Rmin = 2.5, dense.
fn standard(grains: u32, cohesion_ratio: f64, seed: u64) -> Result<Rev<2, 1>, PreparationError> {
    let recipe = Recipe {
        grains,
        confining_stress: CONFINING_STRESS,
        cohesion_ratio,
        seed,
        ..Recipe::default()
    };
    prepare(&recipe).map(|(rev, _)| rev)
}

/// σ0 of the standard packing.
const CONFINING_STRESS: f64 = 1.0;
