//! The serialisable memory of a step attempt.

use serde::{Deserialize, Serialize};

use super::{Control, MacroState, Phase, StepFailure, StepOutcome, StepSettings, SweepReport};
use crate::assembly::Configuration;
use crate::constitutive::{Base, ConstitutiveResponse, GaussPointId, Smoothness};
use crate::tensor;

/// An evaluated iterate: positions (with second gradient, all unknowns in the order of the problem's
/// layout) and the constitutive answers there.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub(super) struct Iterate {
    pub wave: u32,
    pub coordinates: Vec<f64>,
    pub loads: Vec<f64>,
    pub stress: Vec<f64>,
    pub tangents: Vec<f64>,
    pub elastic_tangents: Vec<f64>,
    pub rebased: Vec<bool>,
    /// Points without a lasting equilibrium, ascending.
    pub provisional: Vec<GaussPointId>,
    /// Force residual ratio.
    pub residual: f64,
    /// Work of the unbalanced forces from end state to end state on the way here.
    pub released: f64,
    /// The part of it that the overdamped motion did.
    #[serde(default)]
    pub damped: f64,
}

impl Iterate {
    pub fn new<const D: usize>(
        wave: u32,
        (coordinates, loads): (Vec<f64>, Vec<f64>),
        responses: &[ConstitutiveResponse<D>],
    ) -> Self {
        Iterate {
            wave,
            coordinates,
            loads,
            stress: tensor::flatten2(responses.iter().map(|r| &r.stress)),
            tangents: tensor::flatten4(responses.iter().map(|r| &r.tangent)),
            elastic_tangents: tensor::flatten4(responses.iter().map(|r| &r.elastic_tangent)),
            rebased: responses
                .iter()
                .map(|r| r.smooth != Smoothness::Smooth)
                .collect(),
            provisional: (0..)
                .map(GaussPointId)
                .zip(responses)
                .filter(|(_, response)| response.smooth == Smoothness::Provisional)
                .map(|(point, _)| point)
                .collect(),
            residual: f64::INFINITY,
            released: 0.0,
            damped: 0.0,
        }
    }

    /// Whether this one is nearer to an end than `other`: a state that lasts is, whatever its residual.
    pub fn is_better_than(&self, other: &Self) -> bool {
        match (self.provisional.is_empty(), other.provisional.is_empty()) {
            (true, false) => true,
            (false, true) => false,
            _ => self.residual < other.residual,
        }
    }

    /// The iterate within a step from `committed`.
    pub fn configuration<'a, const D: usize>(
        &'a self,
        committed: &'a MacroState<D>,
    ) -> Configuration<'a> {
        Configuration {
            unknowns: &self.coordinates,
            stress: &self.stress,
            loads: &self.loads,
            start: committed.start(),
        }
    }
}

/// Whether a correction is small enough to stop.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Size {
    Negligible,
    Significant,
}

/// The iterate whose constitutive answers are being waited for.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub(super) struct Trial {
    pub wave: u32,
    pub phase: Phase,
    pub base: Base,
    pub start: Option<u32>,
    /// Positions, or all unknowns, as in [`Iterate`].
    pub coordinates: Vec<f64>,
    /// Load values there.
    pub loads: Vec<f64>,
    /// Positions, or all unknowns, of the base; empty for the committed ones.
    pub base_coordinates: Vec<f64>,
    /// Positions, or all unknowns, that the correction left.
    pub from: Vec<f64>,
    /// Load values that it left.
    pub from_loads: Vec<f64>,
    /// Forces out of balance at the base, and the work they had done to get there; empty for the committed base.
    pub unbalanced: Vec<f64>,
    pub released: f64,
    /// Halvings of the correction for points that could not follow it.
    pub halvings: u32,
    /// ‖du‖/‖Δu‖ of the correction that led here.
    pub correction: f64,
    pub size: Size,
    pub safeguarded: usize,
    pub linear_residual: f64,
    /// The part of `released` that the overdamped motion did.
    #[serde(default)]
    pub damped: f64,
}

#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub(super) enum Status<const D: usize> {
    Evaluating,
    Converged(Box<StepOutcome<D>>),
    Failed(Box<StepFailure>),
}

/// Everything a step attempt remembers. Stored when a wave is issued and restored later, it goes on
/// with the same bits.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub struct StepState<const D: usize> {
    pub(super) settings: StepSettings,
    pub(super) committed: MacroState<D>,
    pub(super) control: Option<Control>,
    pub(super) trial: Trial,
    pub(super) best: Option<Iterate>,
    /// Best iterate that was restored last, so that no iterate is restored twice.
    pub(super) restored: Option<u32>,
    pub(super) previous_residual: Option<f64>,
    /// Largest strain of a Newton correction.
    pub(super) reach: f64,
    /// Viscosity of the overdamped motion.
    pub(super) viscosity: f64,
    pub(super) predictor_tangents: Vec<f64>,
    pub(super) sweeps: Vec<SweepReport>,
    pub(super) status: Status<D>,
}
