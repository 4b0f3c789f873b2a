//! The REV tasks of committed steps, carried out again from what the store holds.
//!
//! Of a body: the committed states of the step before, and what the waves that led to the result asked for. Of an element
//! test: the state and F of the step before, and the loads of the step.

use std::{collections::BTreeMap, sync::Arc};

use solver_dem::{Method, Report, RevState, Settings};
use solver_fem::{Base, GaussPointId, Tensor2};
use store::{FrameId, StepIndex, StepReader};

use super::{
    asked::AskedWave,
    element_test::{TestState, control},
    error::RunError,
    frames::{ASKED, MACRO, decode, point_frame},
    load, model,
    point::{PlaneRev, PointEnd, PointState, PointTask},
    view::{RunView, StepView, View},
    work::DriveJob,
};
use crate::input::problem::Model as InputModel;

/// Why a recorded task cannot be carried out again. Reads after "failed to repeat the REV …: ".
#[derive(Debug, thiserror::Error)]
pub enum RepeatError {
    /// Step 0 has packings; no REV was asked for anything.
    #[error("step 0 is the initial state, in which no REV was asked for anything")]
    Initial,
    /// The version that computed the step did not keep what its waves asked for.
    #[error("the version that computed the step did not record what it asked of its REVs")]
    NotRecorded,
    /// The states that it started from are gone.
    #[error("the step before, from which it started, was pruned")]
    BasePruned,
    /// There is no such Gauss point.
    #[error("the step has {0} Gauss points")]
    NoSuchPoint(usize),
    /// The point is elastic.
    #[error("that point is elastic, it has no grains")]
    Elastic,
    /// What is stored does not read or does not fit together.
    #[error(transparent)]
    Stored(#[from] RunError),
    /// The REV answered when the step was computed and finds no equilibrium now.
    #[error("it answered when the step was computed, and finds no equilibrium now: {0}")]
    NoAnswer(String),
}

impl From<store::ReadError> for RepeatError {
    fn from(error: store::ReadError) -> Self {
        Self::Stored(error.into())
    }
}

impl From<super::frames::DecodeError> for RepeatError {
    fn from(error: super::frames::DecodeError) -> Self {
        Self::Stored(error.into())
    }
}

/// A committed step whose REV tasks can be repeated.
pub struct RecordedStep {
    reader: StepReader,
    /// Committed states of the step before, by Gauss point.
    before: Vec<Arc<PointState>>,
    /// Committed stresses, by Gauss point.
    stresses: Vec<Tensor2<2>>,
    tasks: Tasks,
}

/// How the states of a step came about.
enum Tasks {
    /// By these waves, ascending; each builds on earlier ones only.
    Waves(Vec<AskedWave>),
    /// By one task of an element test.
    Drive(Box<DriveJob>),
}

/// The last question to a REV.
#[derive(Clone, Debug)]
pub enum Question {
    /// For its answer to F.
    Point(PointTask, Settings),
    /// For its answer to mixed control.
    Test(DriveJob),
}

impl Question {
    /// The REV that is deformed; `None` without grains.
    pub fn base(&self) -> Option<&PlaneRev> {
        let base = match self {
            Self::Point(task, _) => &task.base,
            Self::Test(job) => &job.base,
        };
        match &**base {
            PointState::Rev(rev) => Some(rev),
            PointState::Elastic { .. } => None,
        }
    }

    /// How the REV is solved.
    pub fn settings(&self) -> &Settings {
        match self {
            Self::Point(_, settings) => settings,
            Self::Test(job) => &job.settings,
        }
    }

    /// What the solver reaches with other settings; `None` where it finds no equilibrium.
    pub fn ask(&self, settings: &Settings) -> Option<Report> {
        match self {
            Self::Point(task, _) => task.evaluate(settings).ok()?.report,
            Self::Test(job) => {
                let job = DriveJob {
                    settings: *settings,
                    ..job.clone()
                };
                job.carry_out().ok().map(|driven| driven.report)
            }
        }
    }
}

/// A recorded task, carried out again.
pub struct Repeated {
    /// The last question.
    pub question: Question,
    /// Waves that led from the committed state to the answer, the last included.
    pub waves: usize,
    /// F from the base of the last question; from the initial cell in an element test.
    pub gradient: Tensor2<2>,
    /// The state that it started from.
    pub base: PlaneRev,
    /// Its end state.
    pub state: PlaneRev,
    /// Its Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
    /// What the solver reached.
    pub report: Report,
    /// The end state that the step holds.
    pub recorded: RevState<2, 1>,
    /// The stress that the step holds.
    pub recorded_stress: Tensor2<2>,
    /// Whether state and stress are the recorded ones, to the last bit.
    pub agreement: Agreement,
}

/// Whether an answer is the recorded one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// To the last bit.
    SameBits,
    /// Not.
    Differs,
}

impl RecordedStep {
    /// Reads what `step` of `run` needs. `dealt` are the states of step 0 under the laws of `run`.
    ///
    /// # Errors
    /// [`RepeatError::Initial`], [`RepeatError::NotRecorded`], [`RepeatError::BasePruned`], or steps that cannot be read.
    pub fn open(
        view: &View,
        run: &RunView,
        step: &StepView,
        dealt: &[Arc<PointState>],
    ) -> Result<Self, RepeatError> {
        let index = step.record.index;
        let Some(previous) = index.0.checked_sub(1) else {
            return Err(RepeatError::Initial);
        };
        let reader = view.store.step(run.id(), index)?;
        let earlier = match view.store.step(run.id(), StepIndex(previous)) {
            Err(store::ReadError::Pruned(_)) => return Err(RepeatError::BasePruned),
            opened => opened?,
        };
        // A step of an ancestor was computed with the ancestor's input and laws.
        let owner = view.read(&step.record.run)?;
        let problem = &owner.manifest.problem;
        let before = if owner.id() == run.id() {
            load::points(&earlier, dealt)?
        } else {
            load::points(&earlier, &load::dealt(&view.store, owner.id())?)?
        };
        let tasks = match &problem.model {
            InputModel::Body(_) => Tasks::Waves(waves(&reader)?),
            InputModel::ElementTest(test) => {
                let id = FrameId::new(MACRO, 0);
                let from: TestState = decode(id, &earlier.frame(id)?)?;
                let base = before.first().ok_or(RepeatError::NoSuchPoint(0))?;
                Tasks::Drive(Box::new(DriveJob {
                    base: Arc::clone(base),
                    from: from.gradient,
                    control: control(test, &step.summary.loads),
                    method: Method::ReturnMapping,
                    settings: model::rev_settings(&problem.solver),
                }))
            }
        };
        Ok(Self {
            stresses: load::stresses(problem, &reader)?,
            reader,
            before,
            tasks,
        })
    }

    /// Carries out the task of a point again, with all waves that led to it.
    ///
    /// # Errors
    /// A point without grains, frames that cannot be read, no answer.
    pub fn repeat(&self, point: GaussPointId) -> Result<Repeated, RepeatError> {
        let missing = RepeatError::NoSuchPoint(self.before.len());
        let committed = self.before.get(point.index()).ok_or(missing)?;
        let (question, end, waves) = match &self.tasks {
            Tasks::Waves(waves) => {
                let (question, end) = follow(waves, point, committed)?;
                (question, end, waves.len())
            }
            Tasks::Drive(job) => {
                let driven = job
                    .carry_out()
                    .map_err(|error| RepeatError::NoAnswer(error.to_string()))?;
                let end = End {
                    state: driven.state,
                    gradient: driven.gradient,
                    stress: driven.stress,
                    report: driven.report,
                };
                (Question::Test((**job).clone()), end, 1)
            }
        };
        let torn = || RunError::State("it lacks a stress".into());
        let recorded_stress = *self.stresses.get(point.index()).ok_or_else(torn)?;
        let bytes = self
            .reader
            .frame(FrameId::new(super::frames::POINT, point.0))?;
        let PointState::Rev(recorded) = super::frames::read_point(point, &bytes, committed)? else {
            return Err(RepeatError::Elastic);
        };
        // Bytes, not values: 0 and −0 are equal, and a NaN is not itself.
        let same = point_frame(point, &end.state).payload == bytes
            && end.stress.map(|row| row.map(f64::to_bits))
                == recorded_stress.map(|row| row.map(f64::to_bits));
        let PointState::Rev(state) = end.state else {
            return Err(RepeatError::Elastic);
        };
        let base = question.base().ok_or(RepeatError::Elastic)?.clone();
        Ok(Repeated {
            question,
            waves,
            gradient: end.gradient,
            base,
            state,
            stress: end.stress,
            report: end.report,
            recorded: recorded.state,
            recorded_stress,
            agreement: if same {
                Agreement::SameBits
            } else {
                Agreement::Differs
            },
        })
    }
}

/// Where a repeated task ended.
struct End {
    state: PointState,
    gradient: Tensor2<2>,
    stress: Tensor2<2>,
    report: Report,
}

/// What the waves asked for that led to a step, ascending.
pub fn waves(reader: &StepReader) -> Result<Vec<AskedWave>, RepeatError> {
    let ids = reader.ids().into_iter().filter(|id| id.kind == ASKED);
    let waves: Vec<AskedWave> = ids
        .map(|id| Ok(decode(id, &reader.frame(id)?)?))
        .collect::<Result<_, RepeatError>>()?;
    if waves.is_empty() {
        return Err(RepeatError::NotRecorded);
    }
    Ok(waves)
}

/// The answers of one point, wave by wave.
fn follow(
    waves: &[AskedWave],
    point: GaussPointId,
    committed: &Arc<PointState>,
) -> Result<(Question, End), RepeatError> {
    let torn = || {
        RepeatError::from(RunError::State(
            "its recorded waves do not fit together".into(),
        ))
    };
    let mut ends: BTreeMap<u32, Arc<PointEnd>> = BTreeMap::new();
    let mut last = None;
    for asked in waves {
        let task = PointTask {
            point,
            base: match asked.base {
                Base::Committed => Arc::clone(committed),
                Base::Wave(wave) => Arc::clone(&ends.get(&wave).ok_or_else(torn)?.state),
            },
            start: match asked.start {
                Some(wave) => Some(Arc::clone(ends.get(&wave).ok_or_else(torn)?)),
                None => None,
            },
            gradient: asked.gradient(point).ok_or_else(torn)?,
        };
        let settings = asked.settings()?;
        let answer = task.evaluate(&settings).map_err(RepeatError::NoAnswer)?;
        ends.insert(asked.wave, Arc::clone(&answer.end));
        last = Some((task, settings, answer));
    }
    let (task, settings, answer) = last.ok_or_else(torn)?;
    let report = answer.report.ok_or(RepeatError::Elastic)?;
    let end = End {
        state: (*answer.end.state).clone(),
        gradient: task.gradient,
        stress: answer.stress,
        report,
    };
    Ok((Question::Point(task, settings), end))
}
