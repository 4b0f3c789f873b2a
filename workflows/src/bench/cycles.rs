//! What a cycle of the REV solver costs.

use engine::thread_cpu_time;
use serde::Serialize;
use solver_dem::{EquilibriumError, Rev, measure::run_cycles};

use super::statistics::Spread;

/// The first increment of a biaxial compression: F that takes the packing from its isotropic state.
const LOADING: [[f64; 2]; 2] = [[1.0 + 4e-4, 0.0], [0.0, 1.0 - 1e-3]];
/// Cycles at a stretch: setting up is then below a per cent of them.
const STRETCH: u32 = 2000;
/// How often a stretch is repeated; the median counts, as other processes disturb single ones.
const REPETITIONS: usize = 15;

/// Speed of the cycle loop for one size of REV.
#[derive(Clone, Debug, Serialize)]
pub struct CycleCost {
    /// Grains.
    pub grains: u32,
    /// Pairs in contact.
    pub contacts: u32,
    /// Pairs whose distance each cycle looks at.
    pub listed_pairs: u32,
    /// Pairs in contact × cycles over the CPU seconds of the cycle loop, integration included.
    pub contact_updates_per_cpu_s: f64,
    /// CPU microseconds of a cycle.
    pub us_per_cycle: f64,
    /// CPU nanoseconds of a cycle over the listed pairs.
    pub ns_per_listed_pair: f64,
}

/// Measures the cycle loop on a packing under its first load.
///
/// # Errors
/// A packing that cannot be deformed.
pub fn measure(rev: &Rev<2, 1>) -> Result<CycleCost, EquilibriumError> {
    // The first stretch warms caches and is not counted.
    let mut work = run_cycles(rev, &LOADING, STRETCH)?;
    let mut seconds = Vec::with_capacity(REPETITIONS);
    for _ in 0..REPETITIONS {
        let begun = thread_cpu_time();
        work = run_cycles(rev, &LOADING, STRETCH)?;
        let used = thread_cpu_time().saturating_sub(begun);
        seconds.push(used.as_secs_f64());
    }
    let median = Spread::of(&seconds).map_or(f64::NAN, |spread| spread.median);
    let per_cycle = median / f64::from(work.cycles);
    Ok(CycleCost {
        grains: rev.grains.radii.len() as u32,
        contacts: work.contacts,
        listed_pairs: work.listed_pairs,
        contact_updates_per_cpu_s: work.contact_updates() / median,
        us_per_cycle: 1e6 * per_cycle,
        ns_per_listed_pair: 1e9 * per_cycle / f64::from(work.listed_pairs),
    })
}
