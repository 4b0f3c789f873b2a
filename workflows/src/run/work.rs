//! The tasks of a run: serialisable values, each a pure function of itself.

use std::sync::Arc;

use engine::{Stop, TaskContext, Work};
use serde::{Deserialize, Serialize};
use solver_dem::{
    Control, LossOfConfinement, Method, Quality, Recipe, Report, Settings, drive, prepare, respond,
};
use solver_fem::{Tensor2, Tensor4};
use thiserror::Error;

use super::point::{PlaneRev, PointAnswer, PointError, PointState, PointTask, with_state};

/// A task.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Job {
    /// Makes a packing.
    Prepare(Recipe),
    /// Measures a packing that came from elsewhere, settled under this pressure if one is given.
    Adopt {
        /// The packing.
        rev: PlaneRev,
        /// Isotropic pressure to settle it under, positive in compression.
        pressure: Option<f64>,
    },
    /// Evaluates the Gauss points of an element.
    Element(ElementJob),
    /// Takes the REV of an element test one step further.
    Drive(DriveJob),
}

/// The Gauss points of one element in one wave.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ElementJob {
    /// Number of the element.
    pub element: u32,
    /// Its points, in order.
    pub points: Vec<PointTask>,
    /// How the REVs are solved.
    pub settings: Settings,
}

/// One step of an element test.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DriveJob {
    /// The state it starts from.
    pub base: Arc<PointState>,
    /// Its F from the initial cell.
    pub from: Tensor2<2>,
    /// What is imposed.
    pub control: Control,
    /// How friction is integrated.
    pub method: Method,
    /// How the REV is solved.
    pub settings: Settings,
}

/// What a task gives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Done {
    /// A packing, measured.
    Packing(Box<Packing>),
    /// The answers of an element's Gauss points, in order.
    Element(Vec<PointAnswer>),
    /// One step of an element test.
    Drive(Box<Driven>),
}

/// A packing ready for use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Packing {
    /// The packing.
    pub rev: PlaneRev,
    /// What its preparation reached; `None` where it came from elsewhere and was left as it was.
    pub quality: Option<Quality>,
    /// Its Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
    /// Its elastic tangent ∂σ/∂L.
    pub elastic_tangent: Tensor4<2>,
}

/// The end of one step of an element test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Driven {
    /// Its state.
    pub state: PointState,
    /// F from the initial cell.
    pub gradient: Tensor2<2>,
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
    /// What the solver reached.
    pub report: Report,
}

/// Why a task failed.
#[derive(Clone, Debug, Error, Serialize, Deserialize)]
pub enum JobError {
    /// A packing could not be made.
    #[error("prepare a packing: {0}")]
    Preparation(#[from] solver_dem::PreparationError),
    /// A Gauss point has no answer.
    #[error("{0}")]
    Point(#[from] Box<PointError>),
    /// A REV found no equilibrium.
    #[error("{0}")]
    Equilibrium(#[from] solver_dem::EquilibriumError),
    /// An element test was asked of a material without grains.
    #[error("an element test needs a material with grains")]
    NoGrains,
    /// The run was stopped or the time limit passed.
    #[error("stopped")]
    Stopped,
}

impl Work for Job {
    type Output = Done;
    type Error = JobError;

    fn run(&self, context: &TaskContext) -> Result<Done, JobError> {
        match self {
            Job::Prepare(recipe) => {
                let (rev, quality) = prepare(recipe)?;
                measure(rev, Some(quality)).map(|packing| Done::Packing(Box::new(packing)))
            }
            Job::Adopt { rev, pressure } => {
                let (rev, quality) = match pressure {
                    Some(pressure) => {
                        let (rev, quality) = solver_dem::settle(rev, *pressure)?;
                        (rev, Some(quality))
                    }
                    None => (rev.clone(), None),
                };
                measure(rev, quality).map(|packing| Done::Packing(Box::new(packing)))
            }
            Job::Element(job) => job.run(context).map(Done::Element),
            Job::Drive(job) => job.carry_out().map(|driven| Done::Drive(Box::new(driven))),
        }
    }

    /// A job is a pure function: what it does not solve, it never solves.
    fn repeats(error: &JobError) -> bool {
        !matches!(error, JobError::Stopped)
    }
}

/// Stress and elastic tangent of a packing as it stands.
fn measure(rev: PlaneRev, quality: Option<Quality>) -> Result<Packing, JobError> {
    let unmoved = solver_dem::tensor::identity();
    // Whether a void will do is for the load steps to say.
    let settings = Settings {
        loss_of_confinement: LossOfConfinement::Allow,
        ..Settings::default()
    };
    let response = respond(&rev, None, &unmoved, &settings)?;
    Ok(Packing {
        rev,
        quality,
        stress: response.stress,
        elastic_tangent: response.elastic_tangent,
    })
}

impl ElementJob {
    fn run(&self, context: &TaskContext) -> Result<Vec<PointAnswer>, JobError> {
        let mut answers = Vec::with_capacity(self.points.len());
        for (local, task) in self.points.iter().enumerate() {
            match context.should_stop() {
                Some(Stop::Cancelled | Stop::TimeLimit) => return Err(JobError::Stopped),
                None => {}
            }
            let answer = task.evaluate(&self.settings).map_err(|reason| {
                Box::new(PointError {
                    point: task.point,
                    element: self.element,
                    local: local as u32,
                    gradient: task.gradient,
                    reason,
                })
            })?;
            answers.push(answer);
        }
        Ok(answers)
    }
}

impl DriveJob {
    /// The step; a pure function of the job.
    ///
    /// # Errors
    /// A material without grains, or a REV without equilibrium.
    pub fn carry_out(&self) -> Result<Driven, JobError> {
        let PointState::Rev(rev) = &*self.base else {
            return Err(JobError::NoGrains);
        };
        let response = drive(rev, &self.from, &self.control, self.method, &self.settings)?;
        Ok(Driven {
            state: PointState::Rev(with_state(rev, response.state)),
            gradient: response.gradient,
            stress: response.stress,
            report: response.report,
        })
    }
}
