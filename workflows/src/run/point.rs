//! What sits at a Gauss point, and what it answers.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use solver_dem::{
    EquilibriumError, LossOfConfinement, Method, Report, Rev, RevState, Start, Started, Trust,
    respond,
};
use solver_fem::{
    ConstitutiveResponse, GaussPointId, Smoothness, Tensor2, Tensor4, elastic::Elastic,
};
use thiserror::Error;

/// A REV in two dimensions.
pub type PlaneRev = Rev<2, 1>;

/// The state of a Gauss point: all that its next answer depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum PointState {
    /// A packing of grains.
    Rev(PlaneRev),
    /// An elastic point and its Cauchy stress, tension positive.
    Elastic {
        /// Its law.
        law: Elastic,
        /// Its stress.
        stress: Tensor2<2>,
    },
}

impl PointState {
    /// Whether it is grains of which none touches another.
    pub fn is_void(&self) -> bool {
        matches!(self, PointState::Rev(rev) if rev.state.contacts.is_empty())
    }
}

/// Where an earlier wave left a point: the start of a pure sweep, or the base of a path sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointEnd {
    /// Its state.
    pub state: Arc<PointState>,
    /// Rotations of the grains since the base of that wave, radians; empty without grains.
    pub rotations: Vec<f64>,
    /// What it is good for as a start.
    pub trust: Trust,
}

/// One evaluation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PointTask {
    /// Whose.
    pub point: GaussPointId,
    /// From where.
    pub base: Arc<PointState>,
    /// A configuration near the answer.
    pub start: Option<Arc<PointEnd>>,
    /// F from the base.
    pub gradient: Tensor2<2>,
}

/// Its answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointAnswer {
    /// Whose.
    pub point: GaussPointId,
    /// Where it ended.
    pub end: Arc<PointEnd>,
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
    /// ∂σ/∂L over the increment.
    pub tangent: Tensor4<2>,
    /// ∂σ/∂L of the end state, elastic.
    pub elastic_tangent: Tensor4<2>,
    /// What the REV solver reached; `None` without grains.
    pub report: Option<Report>,
}

/// A Gauss point has no answer.
#[derive(Clone, Debug, Error, Serialize, Deserialize)]
#[error("e{element}.{local} under F = {gradient:?}: {reason}")]
pub struct PointError {
    /// Whose.
    pub point: GaussPointId,
    /// Its element.
    pub element: u32,
    /// Its number in the element.
    pub local: u32,
    /// F from its base.
    pub gradient: Tensor2<2>,
    /// Why.
    pub reason: String,
}

impl PointTask {
    /// The answer; a pure function of the task.
    ///
    /// # Errors
    /// The reason in words; the caller adds whose it is.
    pub fn evaluate(&self, settings: &solver_dem::Settings) -> Result<PointAnswer, String> {
        match &*self.base {
            PointState::Rev(rev) => self.evaluate_rev(rev, settings),
            PointState::Elastic { law, stress } => {
                let response = law
                    .respond(stress, &self.gradient)
                    .map_err(|error| error.to_string())?;
                let state = PointState::Elastic {
                    law: *law,
                    stress: response.stress,
                };
                Ok(PointAnswer {
                    point: self.point,
                    end: Arc::new(PointEnd {
                        state: Arc::new(state),
                        rotations: Vec::new(),
                        trust: Trust::Guess,
                    }),
                    stress: response.stress,
                    tangent: response.tangent,
                    elastic_tangent: response.elastic_tangent,
                    report: None,
                })
            }
        }
    }

    fn evaluate_rev(
        &self,
        rev: &PlaneRev,
        settings: &solver_dem::Settings,
    ) -> Result<PointAnswer, String> {
        let start = self.start.as_deref().and_then(|end| match &*end.state {
            PointState::Rev(state) => Some(Start {
                state: &state.state,
                rotations: &end.rotations,
                trust: end.trust,
            }),
            PointState::Elastic { .. } => None,
        });
        let started = if start.is_some() {
            Started::Warm
        } else {
            Started::Cold
        };
        let response =
            respond(rev, start, &self.gradient, settings).map_err(|error| error.to_string())?;
        let state = PointState::Rev(with_state(rev, response.state));
        Ok(PointAnswer {
            point: self.point,
            end: Arc::new(PointEnd {
                state: Arc::new(state),
                rotations: response.rotations,
                trust: Trust::in_answer(&response.report, started),
            }),
            stress: response.stress,
            tangent: response.tangent,
            elastic_tangent: response.elastic_tangent,
            report: Some(response.report),
        })
    }
}

/// The same grains in another state.
pub fn with_state(rev: &PlaneRev, state: RevState<2, 1>) -> PlaneRev {
    Rev {
        grains: Arc::clone(&rev.grains),
        law: rev.law,
        state,
    }
}

impl PointAnswer {
    /// Whether no grain touches another.
    pub fn is_void(&self) -> bool {
        self.report
            .as_ref()
            .is_some_and(|report| report.contacts == 0)
    }

    /// Why a load step may not end with this answer, where it may not; `contacts` and `gradient` are those of the base and
    /// from the base.
    pub fn lack(
        &self,
        voids: LossOfConfinement,
        contacts: usize,
        gradient: &Tensor2<2>,
        tolerance: f64,
    ) -> Option<EquilibriumError> {
        let report = self.report.as_ref()?;
        match (report.method, report.contacts, voids) {
            (Method::Unsettled, ..) => Some(EquilibriumError::NotReached {
                cycles: report.cycles,
                residual: report.residual,
                tolerance,
                drift: report.drift,
                stress_error: report.stress_error,
            }),
            (_, 0, LossOfConfinement::Fail) => Some(EquilibriumError::ConfinementLost {
                volume_change: solver_dem::tensor::invert(gradient).0,
                contacts,
                cycles: report.cycles,
            }),
            _ => None,
        }
    }

    /// The answer in the form the macro solver takes.
    pub fn response(&self, voids: LossOfConfinement) -> ConstitutiveResponse<2> {
        let smooth = match &self.report {
            Some(report) if report.contacts == 0 && voids == LossOfConfinement::Fail => {
                Smoothness::Provisional
            }
            Some(report) => match report.method {
                Method::ReturnMapping => Smoothness::Smooth,
                Method::Rebased | Method::Path => Smoothness::Rebased,
                Method::Unsettled => Smoothness::Provisional,
            },
            None => Smoothness::Smooth,
        };
        ConstitutiveResponse {
            stress: self.stress,
            tangent: self.tangent,
            elastic_tangent: self.elastic_tangent,
            smooth,
        }
    }
}
