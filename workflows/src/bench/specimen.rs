//! A load step of full size for the store: states as a run has them, without the run.

use std::sync::Arc;

use engine::thread_cpu_time;
use solver_dem::{Settings, Trust, respond};
use solver_fem::{Base, GaussPointId, Wave, newton::MacroState};
use store::Frame;

use super::standard;
use crate::{
    failure::{Failure, FailureKind},
    run::step_frames::{AskedWave, MACRO, PointAnswer, PointEnd, PointState, content, with_state},
};

/// Packings that the points take turns with: each state is compressed for itself, so that a few serve for all.
const PACKINGS: u64 = 4;
/// Waves of a step whose questions are kept, as before the peak.
pub const WAVES: u32 = 4;

/// What the points of a step bring to the store.
pub struct Specimen {
    /// By Gauss point.
    pub answers: Vec<PointAnswer>,
    /// What is committed beside them.
    pub extra: Vec<Frame>,
    /// Bytes of the bare states: the cell (4 numbers) and the centres (2 a grain) as f64; of each contact the two grains as
    /// u32 and the tangential force as f64. What an array dump of a state would take.
    pub raw_bytes: u64,
    /// CPU seconds of one answer, the median over the packings.
    pub answer_s: f64,
}

impl Specimen {
    /// A step of `points` REVs of `grains` grains.
    ///
    /// # Errors
    /// A packing that cannot be prepared or deformed.
    pub fn new(points: u32, grains: u32) -> Result<Self, Failure> {
        let failed = || {
            let what = format!("failed to make states of {grains} grains");
            Failure::new(FailureKind::Run, what)
        };
        let mut answers = Vec::new();
        let mut costs = Vec::new();
        let mut bare = Vec::new();
        for seed in 1..=PACKINGS {
            let rev = standard(grains, 0.0, seed).map_err(|error| failed().because(error))?;
            let gradient = [[1.0 + 1e-4, 2e-4], [0.0, 1.0 - 5e-4]];
            let begun = thread_cpu_time();
            let answer = respond(&rev, None, &gradient, &Settings::default())
                .map_err(|error| failed().because(error))?;
            costs.push(thread_cpu_time().saturating_sub(begun).as_secs_f64());
            bare.push(8 * (4 + 2 * u64::from(grains)) + 16 * answer.state.contacts.len() as u64);
            answers.push(PointAnswer {
                point: GaussPointId(0),
                end: Arc::new(PointEnd {
                    state: Arc::new(PointState::Rev(with_state(&rev, answer.state))),
                    rotations: answer.rotations,
                    trust: Trust::Guess,
                }),
                stress: answer.stress,
                tangent: answer.tangent,
                elastic_tangent: answer.elastic_tangent,
                report: Some(answer.report),
            });
        }
        costs.sort_by(f64::total_cmp);
        let turn = |point: u32| point as usize % answers.len();
        let all = (0..points).map(|point| PointAnswer {
            point: GaussPointId(point),
            ..answers[turn(point)].clone()
        });
        Ok(Self {
            answers: all.collect(),
            extra: extra(points),
            raw_bytes: (0..points).map(|point| bare[turn(point)]).sum(),
            answer_s: costs[costs.len() / 2],
        })
    }
}

/// Macro state and questions of a mesh of quadratic quadrilaterals with 2×2 points each, of numbers that do not compress.
fn extra(points: u32) -> Vec<Frame> {
    // Three nodes and a little more an element.
    let unknowns = 2 * (3 * points as usize / 4 + points as usize / 10);
    let points = points as usize;
    let noise = |count: usize| {
        (0..count)
            .map(|k| ((k as f64) * 0.754_877_666).fract())
            .collect()
    };
    let state = MacroState::<2> {
        displacement: noise(unknowns),
        coordinates: noise(unknowns),
        stress: noise(4 * points),
        predictor_tangents: noise(16 * points),
        elastic_tangents: noise(16 * points),
        reactions: noise(unknowns),
        loads: vec![0.1],
        ..MacroState::default()
    };
    let mut frames = vec![content(MACRO, 0, &state)];
    for index in 0..WAVES {
        let wave = Wave {
            index,
            base: Base::Committed,
            start: index.checked_sub(1),
            points: (0..points as u32)
                .map(|point| {
                    let shift = 1e-3 * ((f64::from(point) + 0.1) * 0.618_034).fract();
                    (
                        GaussPointId(point),
                        [[1.0 + shift, shift], [0.0, 1.0 - shift]],
                    )
                })
                .collect(),
        };
        frames.push(AskedWave::of(&wave, &Settings::default()).frame());
    }
    frames
}
