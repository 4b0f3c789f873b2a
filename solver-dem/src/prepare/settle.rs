//! A REV under a prescribed stress: the cell follows, the grains come to rest.

use super::PreparationError;
use crate::{
    Rev,
    dynamics::{Assembly, Friction},
    relax::{CellMotion, Limits, Outcome, Relaxed, relax},
    settings::Settings,
    tensor::{Tensor2, identity},
};

/// Largest strain of the cell per cycle.
const RATE: f64 = 3e-4;
/// Cundall's α, one try after the other. Lightly damped, grains rearrange more and pack denser; what slides to and fro
/// for ever (one loose packing in 24) comes to rest under the damping of a load step.
const DAMPINGS: [f64; 2] = [0.2, 0.7];
/// Cycles of a try. Frictionless packings of 400 grains take 10 000, of 1600 grains 40 000.
const CAP: u32 = 200_000;
/// Residual that is aimed at, and the largest that is accepted after all tries; the latter on the stress error, too.
const AIM: f64 = 1e-6;
const ACCEPTED: f64 = 1e-4;
/// Strain per cycle of a sheared cell: at Δt = 0.3 √(m/k) and κ = 1000 the inertial number is 2e-3.
const SHEAR_RATE: f64 = 2e-5;
const SHORTEST_RAMP: u32 = 200;

/// Brings `rev` to equilibrium under `pressure` (positive in compression), its cell free in all but rotation.
pub(super) fn under_pressure(
    rev: &Rev<2, 1>,
    pressure: &Tensor2<2>,
    phase: &str,
) -> Result<(Rev<2, 1>, Relaxed), PreparationError> {
    let stress = [
        [Some(-pressure[0][0]), Some(-pressure[0][1])],
        [None, Some(-pressure[1][1])],
    ];
    equilibrate(rev, phase, || CellMotion::stress_driven(stress, RATE))
}

/// Shears the cell by `shear` (F_xy) at constant normal `pressure`, and lets it come to rest.
pub(super) fn sheared(
    rev: &Rev<2, 1>,
    pressure: f64,
    shear: f64,
    phase: &str,
) -> Result<(Rev<2, 1>, Relaxed), PreparationError> {
    let stress = [[Some(-pressure), None], [None, Some(-pressure)]];
    let ramp = ((shear.abs() / SHEAR_RATE) as u32).max(SHORTEST_RAMP);
    let to = [[1.0, shear], [0.0, 1.0]];
    equilibrate(rev, phase, || {
        CellMotion::new(identity(), to, stress, ramp, RATE)
    })
}

fn equilibrate(
    rev: &Rev<2, 1>,
    phase: &str,
    motion: impl Fn() -> CellMotion,
) -> Result<(Rev<2, 1>, Relaxed), PreparationError> {
    let settings = Settings {
        tolerance: AIM,
        drift_tolerance: 1e-5,
        ..Settings::default()
    };
    let limits = Limits {
        friction: Friction::Path,
        cap: CAP,
        rebase_after: u32::MAX,
    };
    let mut cycles = 0;
    let mut last = None;
    for damping in DAMPINGS {
        let mut assembly = Assembly::new(
            rev,
            rev.state.cell,
            rev.state.positions.clone(),
            vec![0.0; rev.state.positions.len()],
        )
        .ok_or(PreparationError::TooFewGrains)?;
        assembly.make_brisk(damping);
        let mut relaxed = relax(&mut assembly, &mut motion(), &limits, &settings);
        cycles += relaxed.cycles;
        relaxed.cycles = cycles;
        if relaxed.outcome == Outcome::CellTooSmall {
            return Err(PreparationError::TooFewGrains);
        }
        let good = relaxed.outcome == Outcome::Equilibrium;
        let fair = relaxed.residual <= ACCEPTED && relaxed.stress_error <= ACCEPTED;
        if good || (fair && damping == DAMPINGS[DAMPINGS.len() - 1]) {
            let state = assembly.state();
            let rev = Rev {
                state,
                ..rev.clone()
            };
            return Ok((rev, relaxed));
        }
        last = Some(relaxed);
    }
    let last = last.expect("there is at least one damping to try");
    Err(PreparationError::NotSettled {
        phase: phase.into(),
        cycles,
        residual: last.residual,
        stress_error: last.stress_error,
    })
}
