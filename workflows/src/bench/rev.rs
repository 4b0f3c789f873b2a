//! `femdem-flow bench rev`: what a REV costs on this machine.

use engine::thread_cpu_time;
use serde::Serialize;

use super::{
    cycles::{self, CycleCost},
    increments::{Increments, LARGEST_STRAIN, RESIDUAL, STRAIN_INCREMENT, Window},
    standard,
    statistics::Spread,
};
use crate::{
    failure::{Failure, FailureKind},
    machine::Machine,
    progress::Progress,
    report::Report,
    run::text::{Align, Table},
};

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Sizes of REVs whose cycles are timed.
    pub cycle_grains: Vec<u32>,
    /// Sizes of REVs whose increments are timed.
    pub increment_grains: Vec<u32>,
    /// Packings of each kind, seeds 1, 2, …
    pub packings: u32,
    /// Axial strain up to which increments are timed.
    pub strain: f64,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            cycle_grains: vec![100, 400, 1600],
            increment_grains: vec![400, 1600],
            packings: 3,
            strain: LARGEST_STRAIN,
        }
    }
}

impl Plan {
    /// A glance, in seconds: past the peak, one packing of each kind.
    pub fn quick() -> Self {
        Self {
            cycle_grains: vec![100, 400],
            increment_grains: vec![400],
            packings: 1,
            strain: 0.02,
        }
    }
}

/// f_c/(a σ0) of the packings that are compressed.
const COHESION_RATIOS: [f64; 2] = [0.0, 1.0];

/// Increments of one kind of packing.
#[derive(Clone, Debug, Serialize)]
struct IncrementCost {
    grains: u32,
    cohesion_ratio: f64,
    packings: u32,
    /// CPU milliseconds of a preparation.
    preparation_ms: Option<Spread>,
    windows: Vec<Window>,
    failures: usize,
    reasons: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
struct Figures {
    machine: Machine,
    cycles: Vec<CycleCost>,
    strain_increment: f64,
    residual: f64,
    increments: Vec<IncrementCost>,
    /// Of all increments.
    failures: usize,
}

/// Measures on one thread, whatever else the machine does; CPU time, not wall time.
///
/// # Errors
/// A packing that cannot be prepared or deformed.
pub fn measure(plan: &Plan, progress: &dyn Progress) -> Result<Report, Failure> {
    let failed = |grains: u32| {
        Failure::new(
            FailureKind::Run,
            format!("failed to measure a REV of {grains} grains"),
        )
    };
    let mut cycles = Vec::new();
    for &grains in &plan.cycle_grains {
        progress.note(&format!("cycles of {grains} grains"));
        let rev = standard(grains, 0.0, 1).map_err(|error| failed(grains).because(error))?;
        cycles.push(cycles::measure(&rev).map_err(|error| failed(grains).because(error))?);
    }
    let mut increments = Vec::new();
    for &grains in &plan.increment_grains {
        for cohesion_ratio in COHESION_RATIOS {
            let mut measured = Increments::default();
            let mut preparation = Vec::new();
            for seed in 1..=plan.packings {
                progress.note(&format!(
                    "increments of {grains} grains, cohesion ratio {cohesion_ratio}, packing {seed} of {}",
                    plan.packings
                ));
                let begun = thread_cpu_time();
                let rev = standard(grains, cohesion_ratio, u64::from(seed))
                    .map_err(|error| failed(grains).because(error))?;
                let used = thread_cpu_time().saturating_sub(begun);
                preparation.push(1e3 * used.as_secs_f64());
                measured.follow(rev, plan.strain);
            }
            increments.push(IncrementCost {
                grains,
                cohesion_ratio,
                packings: plan.packings,
                preparation_ms: Spread::of(&preparation),
                windows: measured.windows(),
                failures: measured.failures(),
                reasons: measured.reasons,
            });
        }
    }
    let figures = Figures {
        machine: Machine::this(),
        cycles,
        strain_increment: STRAIN_INCREMENT,
        residual: RESIDUAL,
        failures: increments.iter().map(|kind| kind.failures).sum(),
        increments,
    };
    Ok(Report::new(text(&figures), &figures))
}

fn text(figures: &Figures) -> String {
    let machine = &figures.machine;
    let mut text = format!(
        "femdem-flow {} on {} ({}), one thread, CPU time\n\n",
        machine.version,
        machine.processor,
        machine.features.join(" ")
    );
    text.push_str("Cycles of the solver, integration included\n");
    text.push_str(&cycle_table(&figures.cycles).render("  "));
    text.push_str(&format!(
        "\nIncrements of {STRAIN_INCREMENT:.0e} axial strain at constant lateral stress, residual {RESIDUAL:.0e}, both tangents included\n"
    ));
    text.push_str(&increment_table(&figures.increments).render("  "));
    for kind in &figures.increments {
        if let Some(preparation) = kind.preparation_ms {
            text.push_str(&format!(
                "  preparing {} grains, cohesion ratio {}: {:.2} s (median of {})\n",
                kind.grains,
                kind.cohesion_ratio,
                1e-3 * preparation.median,
                kind.packings
            ));
        }
        for reason in &kind.reasons {
            text.push_str(&format!(
                "  no answer, {} grains, cohesion ratio {}, {reason}\n",
                kind.grains, kind.cohesion_ratio
            ));
        }
    }
    text
}

fn cycle_table(cycles: &[CycleCost]) -> Table {
    use Align::Right;
    let mut table = Table::new([
        ("grains", Right),
        ("contacts", Right),
        ("listed pairs", Right),
        ("contact updates/s", Right),
        ("µs/cycle", Right),
        ("ns/listed pair", Right),
    ]);
    for cost in cycles {
        table.row([
            cost.grains.to_string(),
            cost.contacts.to_string(),
            cost.listed_pairs.to_string(),
            format!("{:.2e}", cost.contact_updates_per_cpu_s),
            format!("{:.2}", cost.us_per_cycle),
            format!("{:.2}", cost.ns_per_listed_pair),
        ]);
    }
    table
}

fn increment_table(kinds: &[IncrementCost]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("grains", Right),
        ("cohesion", Right),
        ("strain (%)", Left),
        ("", Left),
        ("increments", Right),
        ("ms median", Right),
        ("p95", Right),
        ("max", Right),
        ("cycles median", Right),
        ("p95", Right),
        ("max", Right),
        ("re-based", Right),
        ("by path", Right),
        ("failures", Right),
    ]);
    for kind in kinds {
        for window in &kind.windows {
            let (ms, cycles) = (window.increment_ms, window.cycles);
            let real = |value: Option<f64>| value.map_or(String::new(), |x| format!("{x:.2}"));
            let whole = |value: Option<f64>| value.map_or(String::new(), |x| format!("{x:.0}"));
            table.row([
                kind.grains.to_string(),
                kind.cohesion_ratio.to_string(),
                format!("{}–{}", 100.0 * window.from, 100.0 * window.to),
                window.name.to_owned(),
                window.increments.to_string(),
                real(ms.map(|ms| ms.median)),
                real(ms.map(|ms| ms.p95)),
                real(ms.map(|ms| ms.max)),
                whole(cycles.map(|cycles| cycles.median)),
                whole(cycles.map(|cycles| cycles.p95)),
                whole(cycles.map(|cycles| cycles.max)),
                window.rebased.to_string(),
                window.by_path.to_string(),
                window.failures.to_string(),
            ]);
        }
    }
    table
}
