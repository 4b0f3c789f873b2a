//! What an increment of strain costs a Gauss point, before, at and after the peak.

use engine::thread_cpu_time;
use serde::Serialize;
use solver_dem::{
    Component, Control, Method, Rev, Settings, Tangents, drive, respond,
    tensor::{Tensor2, identity},
};

use super::{CONFINING_STRESS, statistics::Spread};

/// Axial strain of an increment.
pub const STRAIN_INCREMENT: f64 = 5e-4;
/// Largest unbalanced force over the mean contact force that is accepted.
pub const RESIDUAL: f64 = 1e-6;

/// A part of the way to which figures belong.
struct Section {
    name: &'static str,
    /// Axial strain at its begin and end.
    from: f64,
    to: f64,
}

/// Dense packings of these grains peak at about 1 %.
const SECTIONS: [Section; 3] = [
    Section {
        name: "before the peak",
        from: 0.0,
        to: 0.005,
    },
    Section {
        name: "at the peak",
        from: 0.005,
        to: 0.015,
    },
    Section {
        name: "after the peak",
        from: 0.015,
        to: 0.05,
    },
];

/// The largest strain for which there is a window.
pub const LARGEST_STRAIN: f64 = SECTIONS[SECTIONS.len() - 1].to;

/// Figures of the increments that end in one part of the way.
#[derive(Clone, Debug, Serialize)]
pub struct Window {
    /// Its name.
    pub name: &'static str,
    /// Axial strain at its begin.
    pub from: f64,
    /// Axial strain at its end.
    pub to: f64,
    /// Increments asked for.
    pub increments: usize,
    /// CPU milliseconds of an answer: equilibrium, stress and both tangents.
    pub increment_ms: Option<Spread>,
    /// Cycles of an answer.
    pub cycles: Option<Spread>,
    /// Answers whose friction history was re-based.
    pub rebased: usize,
    /// Answers found by the path solver.
    pub by_path: usize,
    /// Increments without an answer.
    pub failures: usize,
}

/// What the increments of one window took.
#[derive(Clone, Debug, Default)]
struct Tally {
    ms: Vec<f64>,
    cycles: Vec<f64>,
    rebased: usize,
    by_path: usize,
    failures: usize,
}

/// The increments of all packings of one kind.
#[derive(Clone, Debug, Default)]
pub struct Increments {
    tallies: [Tally; SECTIONS.len()],
    /// Why increments had no answer, in the order met.
    pub reasons: Vec<String>,
}

impl Increments {
    /// Compresses a packing up to `strain` under constant lateral stress and times every increment.
    ///
    /// A Gauss point is asked with F. The F that keeps the lateral stress is found by [`drive`], untimed; then
    /// [`respond`] is timed on it, from the same base, without a start, and its end state is the next base.
    pub fn follow(&mut self, mut rev: Rev<2, 1>, strain: f64) {
        let settings = Settings {
            tolerance: RESIDUAL,
            ..Settings::default()
        };
        let count = (strain.min(LARGEST_STRAIN) / STRAIN_INCREMENT).round() as u32;
        let mut lateral = 1.0;
        for k in 1..=count {
            let [before, now] = [k - 1, k].map(|k| 1.0 - f64::from(k) * STRAIN_INCREMENT);
            let driven = lateral_stress_held(&rev, now / before);
            if let Ok(driven) = &driven {
                lateral = driven.gradient[0][0];
            }
            // Where stress control finds no way, the lateral strain rate of the increment before serves.
            let gradient: Tensor2<2> = [[lateral, 0.0], [0.0, now / before]];
            let begun = thread_cpu_time();
            let answer = respond(&rev, None, &gradient, &settings);
            let used = thread_cpu_time().saturating_sub(begun);
            let tally = &mut self.tallies[section_of(1.0 - now)];
            match answer {
                Ok(answer) => {
                    tally.ms.push(1e3 * used.as_secs_f64());
                    tally.cycles.push(f64::from(answer.report.cycles));
                    match answer.report.method {
                        Method::ReturnMapping => {}
                        Method::Rebased => tally.rebased += 1,
                        Method::Path | Method::Unsettled => tally.by_path += 1,
                    }
                    rev.state = answer.state;
                }
                Err(error) => {
                    tally.failures += 1;
                    let at = 100.0 * (1.0 - now);
                    self.reasons.push(format!("at {at:.2} %: {error}"));
                    match driven {
                        Ok(driven) => rev.state = driven.state,
                        // Nothing leads on.
                        Err(_) => return,
                    }
                }
            }
        }
    }

    /// The figures by window; windows that no increment ended in are left out.
    pub fn windows(&self) -> Vec<Window> {
        let windows = SECTIONS
            .iter()
            .zip(&self.tallies)
            .map(|(section, tally)| Window {
                name: section.name,
                from: section.from,
                to: section.to,
                increments: tally.ms.len() + tally.failures,
                increment_ms: Spread::of(&tally.ms),
                cycles: Spread::of(&tally.cycles),
                rebased: tally.rebased,
                by_path: tally.by_path,
                failures: tally.failures,
            });
        windows.filter(|window| window.increments > 0).collect()
    }

    /// Increments without an answer.
    pub fn failures(&self) -> usize {
        self.tallies.iter().map(|tally| tally.failures).sum()
    }
}

/// The increment that shortens a REV by the factor `stretch` while the lateral stress stays.
fn lateral_stress_held(
    rev: &Rev<2, 1>,
    stretch: f64,
) -> Result<solver_dem::Response, solver_dem::EquilibriumError> {
    let control = Control {
        components: [
            [
                Component::Stress(-CONFINING_STRESS),
                Component::Gradient(0.0),
            ],
            [Component::Gradient(0.0), Component::Gradient(stretch)],
        ],
    };
    let settings = Settings {
        tangents: Tangents::Algorithmic,
        ..Settings::default()
    };
    drive(rev, &identity(), &control, Method::ReturnMapping, &settings)
}

/// The window of an increment that ends at `strain`.
fn section_of(strain: f64) -> usize {
    // Half an increment of slack, so that rounding moves none into the next window.
    let end = strain - 0.5 * STRAIN_INCREMENT;
    let found = SECTIONS.iter().position(|section| end < section.to);
    found.unwrap_or(SECTIONS.len() - 1)
}
