//! The cycle loop laid open, so that what it costs can be measured.
//!
//! No clock is read here: whoever measures times [`run_cycles`] and divides by what it says was done.

use crate::{
    Rev,
    dynamics::{Assembly, Friction},
    relax::{CellMotion, Limits, relax},
    respond::check,
    response::EquilibriumError,
    settings::Settings,
    tensor::{Tensor2, apply, identity, rotation_angle},
};

/// What a stretch of the cycle loop did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleWork {
    /// Cycles done.
    pub cycles: u32,
    /// Pairs in contact at the end.
    pub contacts: u32,
    /// Pairs whose distance each cycle looks at: those in contact and near ones.
    pub listed_pairs: u32,
}

impl CycleWork {
    /// Contact updates: pairs in contact times cycles, the measure by which codes are compared.
    pub fn contact_updates(&self) -> f64 {
        f64::from(self.contacts) * f64::from(self.cycles)
    }
}

/// Deforms `base` by `gradient` (F) and runs `cycles` cycles of return mapping, rounded up to the next look at the residual,
/// whatever they reach. All that a solve does per cycle is done: forces, integration, pair list, residual. Only its
/// beginning and its tangents are left out.
///
/// # Errors
/// As [`crate::respond`] for an F that is no motion and a state that is none; [`EquilibriumError::CellTooSmall`] when the
/// grains leave their cell no room.
pub fn run_cycles(
    base: &Rev<2, 1>,
    gradient: &Tensor2<2>,
    cycles: u32,
) -> Result<CycleWork, EquilibriumError> {
    check(base, gradient)?;
    let cell = base.state.cell.deformed(gradient);
    let positions = base.state.positions.iter();
    let positions: Vec<_> = positions.map(|x| apply(gradient, x)).collect();
    let rotations = vec![rotation_angle(gradient); positions.len()];
    let mut assembly = Assembly::new(base, cell, positions, rotations)
        .ok_or_else(|| crate::respond::too_small(base, &cell, 0))?;
    let never_satisfied = Settings {
        tolerance: -1.0,
        ..Settings::default()
    };
    let limits = Limits {
        friction: Friction::ReturnMapping,
        cap: cycles,
        rebase_after: u32::MAX,
    };
    let mut motion = CellMotion::new(identity(), identity(), [[None; 2]; 2], 0, 0.0);
    let relaxed = relax(&mut assembly, &mut motion, &limits, &never_satisfied);
    Ok(CycleWork {
        cycles: relaxed.cycles,
        contacts: assembly.closed().count() as u32,
        listed_pairs: assembly.listed_pairs() as u32,
    })
}
