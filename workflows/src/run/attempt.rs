//! One attempt at a load step of a body: the Newton machine, the wave that is out, and its journal.

use std::{collections::BTreeMap, sync::Arc};

use engine::{GraphHandle, NodeId, RetryPolicy, TaskSpec};
use serde::{Deserialize, Serialize};
use solver_dem::LossOfConfinement;
use solver_fem::{
    Base, GaussPointId, Wave,
    newton::{StepSolver, StepState},
    problem::Problem,
};
use store::{Digest, FrameId, StepJournal, WaveIndex};

use super::{
    asked::{AskedWave, AskedWaves},
    error::RunError,
    frames::{self, ANSWER, POINT},
    point::{PointAnswer, PointEnd, PointState, PointTask},
    schedule::{Place, Schedule},
    work::{ElementJob, Job},
};
use crate::input;

/// What makes a wave this wave: written before its first answer, enough to go on from it.
#[derive(Serialize, Deserialize)]
struct WaveHeader {
    /// Digest of the committed step that the attempt starts from.
    from: Digest,
    place: Place,
    cuts: u32,
    solver: StepState<2>,
    /// Empty in journals of versions that did not keep it.
    #[serde(default)]
    asked: AskedWaves,
}

/// How element tasks are run.
#[derive(Clone, Copy, Debug)]
pub struct TaskPolicy {
    /// How the REVs are solved.
    pub settings: solver_dem::Settings,
    /// What becomes of REVs that have lost all their contacts.
    pub loss_of_confinement: input::LossOfConfinement,
    /// How often a task is tried.
    pub retry: RetryPolicy,
    /// How long it may take.
    pub time_limit: std::time::Duration,
}

impl TaskPolicy {
    /// Whether a load step may end with the voids among these answers, those of all Gauss points.
    pub fn voids(&self, answers: &[PointAnswer]) -> LossOfConfinement {
        match self.loss_of_confinement {
            input::LossOfConfinement::Fail => LossOfConfinement::Fail,
            input::LossOfConfinement::Allow => LossOfConfinement::Allow,
            input::LossOfConfinement::Isolated => {
                let voids = answers.iter().filter(|answer| answer.is_void()).count();
                if voids <= (answers.len() / 100).max(1) {
                    LossOfConfinement::Allow
                } else {
                    LossOfConfinement::Fail
                }
            }
        }
    }
}

/// The states that an attempt starts from.
#[derive(Clone, Copy)]
pub struct Committed<'a> {
    /// Digest of the committed step.
    pub digest: Digest,
    /// Its Gauss points.
    pub points: &'a [Arc<PointState>],
}

/// One attempt at one load step.
pub struct Attempt {
    /// The Newton machine.
    pub solver: StepSolver<2>,
    /// The journal of the step.
    pub journal: StepJournal,
    /// The wave that is out.
    wave: Wave<2>,
    /// What it and those it builds on asked for.
    pub asked: AskedWaves,
    /// The join at the end of the wave.
    pub join: Option<NodeId>,
    /// End states of earlier waves that are still needed.
    ends: BTreeMap<u32, Vec<Arc<PointEnd>>>,
    /// Answers of the wave so far, by Gauss point.
    answers: Vec<Option<PointAnswer>>,
    /// Points without an answer, and why.
    pub failed: Vec<(GaussPointId, String)>,
    /// Points whose last answer a step may not end with, and why.
    pub lacking: Vec<(GaussPointId, String)>,
    /// Elements by task.
    pub tasks: BTreeMap<NodeId, u32>,
    /// Elements of the wave, and those done.
    pub elements: usize,
    /// Those done.
    pub done: usize,
}

/// What the journal of a step holds.
pub enum Opened {
    /// An attempt that was interrupted.
    TakenUp {
        /// The attempt.
        attempt: Box<Attempt>,
        /// Its place in the programme.
        place: Place,
        /// Attempts at the step that failed before it.
        cuts: u32,
    },
    /// Nothing to go on from.
    Empty(StepJournal),
}

impl Attempt {
    /// A new attempt, before its first wave.
    pub fn new(solver: StepSolver<2>, journal: StepJournal) -> Self {
        Self {
            solver,
            journal,
            wave: Wave {
                index: 0,
                base: Base::Committed,
                start: None,
                points: Vec::new(),
            },
            asked: AskedWaves::default(),
            join: None,
            ends: BTreeMap::new(),
            answers: Vec::new(),
            failed: Vec::new(),
            lacking: Vec::new(),
            tasks: BTreeMap::new(),
            elements: 0,
            done: 0,
        }
    }

    /// Takes up the attempt that a journal tells of, at its newest wave that is whole and starts from the committed
    /// step; where there is none, the journal is emptied.
    pub fn open(
        mut journal: StepJournal,
        problem: &Arc<Problem<2>>,
        committed: Committed<'_>,
    ) -> Result<Opened, RunError> {
        // A kill may have torn the header of the newest wave; the wave before it, whole, is still there then.
        for wave in journal.waves()?.into_iter().rev() {
            if let Some(restored) = restore_wave(&mut journal, wave, problem, committed)? {
                let mut attempt = Self::new(restored.solver, journal);
                attempt.ends = restored.ends;
                attempt.asked = restored.asked;
                return Ok(Opened::TakenUp {
                    attempt: Box::new(attempt),
                    place: restored.place,
                    cuts: restored.cuts,
                });
            }
        }
        // Torn, or of another history: whatever it was, computing it again gives the same bits.
        journal.keep(&[])?;
        Ok(Opened::Empty(journal))
    }

    /// Sends a wave out: journalled answers are taken, the rest become tasks, and a join ends it.
    pub fn send(
        &mut self,
        wave: Wave<2>,
        problem: &Problem<2>,
        committed: Committed<'_>,
        schedule: &Schedule,
        policy: &TaskPolicy,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        let live_waves = self.solver.live_waves();
        self.asked
            .add(AskedWave::of(&wave, &policy.settings), &live_waves);
        let header = WaveHeader {
            from: committed.digest,
            place: schedule.place.clone(),
            cuts: schedule.cuts,
            solver: self.solver.state().clone(),
            asked: self.asked.clone(),
        };
        let index = WaveIndex(wave.index);
        self.journal.open_wave(index, &frames::encode(&header))?;
        let mut live: Vec<WaveIndex> = live_waves.into_iter().map(WaveIndex).collect();
        live.push(index);
        self.journal.keep(&live)?;
        self.answers = read_answers(&mut self.journal, index, committed.points)?;
        self.failed.clear();
        self.tasks.clear();

        let per_element = problem.points_per_element();
        self.elements = wave.points.len() / per_element;
        self.done = 0;
        let mut tasks = Vec::new();
        for (element, points) in wave.points.chunks(per_element).enumerate() {
            if points
                .iter()
                .all(|(point, _)| self.answers[point.index()].is_some())
            {
                self.done += 1;
                continue;
            }
            let points = points
                .iter()
                .map(|(point, gradient)| PointTask {
                    point: *point,
                    base: match wave.base {
                        Base::Committed => Arc::clone(&committed.points[point.index()]),
                        Base::Wave(k) => Arc::clone(&self.ends[&k][point.index()].state),
                    },
                    start: wave
                        .start
                        .map(|k| Arc::clone(&self.ends[&k][point.index()])),
                    gradient: *gradient,
                })
                .collect();
            let job = ElementJob {
                element: element as u32,
                points,
                settings: policy.settings,
            };
            let spec = TaskSpec::new(format!("e{element}"), Job::Element(job))
                .retry(policy.retry)
                .time_limit(policy.time_limit);
            let task = graph.add_task(spec)?;
            self.tasks.insert(task, element as u32);
            tasks.push(task);
        }
        self.wave = wave;
        self.join = Some(graph.add_join(format!("assemble wave {}", index.0), tasks)?);
        Ok(())
    }

    /// Number of the wave that is out.
    pub fn wave(&self) -> u32 {
        self.wave.index
    }

    /// Journals the answers of an element.
    pub fn take(&mut self, answers: Vec<PointAnswer>) -> Result<(), RunError> {
        let wave = WaveIndex(self.wave.index);
        for answer in answers {
            self.journal
                .append(wave, &frames::point_frame(answer.point, &answer.end.state))?;
            self.journal.append(wave, &frames::answer_frame(&answer))?;
            let slot = self.answers.get_mut(answer.point.index());
            *slot.ok_or_else(|| RunError::Engine("an answer to no question".into()))? =
                Some(answer);
        }
        self.journal.flush()?;
        self.done += 1;
        Ok(())
    }

    /// The answers of the whole wave in Gauss point order, when all are there; their end states are
    /// kept for the waves to come.
    pub fn collect(&mut self) -> Option<Vec<PointAnswer>> {
        let answers: Vec<PointAnswer> = std::mem::take(&mut self.answers)
            .into_iter()
            .collect::<Option<_>>()?;
        self.ends.insert(
            self.wave.index,
            answers.iter().map(|a| Arc::clone(&a.end)).collect(),
        );
        Some(answers)
    }

    /// Why a load step may not end with these answers of the wave that is out, point by point.
    pub fn lacks(
        &self,
        answers: &[PointAnswer],
        committed: Committed<'_>,
        policy: &TaskPolicy,
    ) -> Vec<(GaussPointId, String)> {
        let voids = policy.voids(answers);
        let lack = |answer: &PointAnswer| {
            let place = answer.point.index();
            let base = match self.wave.base {
                Base::Committed => committed.points.get(place)?,
                Base::Wave(k) => &self.ends.get(&k)?.get(place)?.state,
            };
            let contacts = match &**base {
                PointState::Rev(rev) => rev.state.contacts.len(),
                PointState::Elastic { .. } => 0,
            };
            let (_, gradient) = self.wave.points.get(place)?;
            let tolerance = policy.settings.tolerance;
            let why = answer.lack(voids, contacts, gradient, tolerance)?;
            Some((answer.point, why.to_string()))
        };
        answers.iter().filter_map(lack).collect()
    }

    /// Drops what no later wave needs.
    pub fn forget(&mut self) {
        let live = self.solver.live_waves();
        self.ends.retain(|wave, _| live.contains(wave));
    }

    /// The end states of a wave.
    pub fn states_of(&self, wave: u32) -> Option<Vec<Arc<PointState>>> {
        let ends = self.ends.get(&wave)?;
        Some(ends.iter().map(|end| Arc::clone(&end.state)).collect())
    }
}

/// An attempt as a wave's journal tells of it.
struct RestoredWave {
    solver: StepSolver<2>,
    ends: BTreeMap<u32, Vec<Arc<PointEnd>>>,
    asked: AskedWaves,
    place: Place,
    cuts: u32,
}

/// The attempt when `wave` went out; `None` where the journal is torn or of another history.
fn restore_wave(
    journal: &mut StepJournal,
    wave: WaveIndex,
    problem: &Arc<Problem<2>>,
    committed: Committed<'_>,
) -> Result<Option<RestoredWave>, RunError> {
    let header = journal
        .read_wave(wave)?
        .and_then(|contents| rmp_serde::from_slice::<WaveHeader>(&contents.header).ok());
    let Some(header) = header.filter(|header| header.from == committed.digest) else {
        return Ok(None);
    };
    let Ok(solver) = StepSolver::restore(problem, header.solver) else {
        return Ok(None);
    };
    let mut ends = BTreeMap::new();
    for wave in solver.live_waves() {
        let Some(found) = read_ends(journal, WaveIndex(wave), committed.points)? else {
            return Ok(None);
        };
        ends.insert(wave, found);
    }
    Ok(Some(RestoredWave {
        solver,
        ends,
        asked: header.asked,
        place: header.place,
        cuts: header.cuts,
    }))
}

/// The answers that a wave's journal holds, by Gauss point.
fn read_answers(
    journal: &mut StepJournal,
    wave: WaveIndex,
    dealt: &[Arc<PointState>],
) -> Result<Vec<Option<PointAnswer>>, RunError> {
    let mut answers = vec![None; dealt.len()];
    let Some(contents) = journal.read_wave(wave)? else {
        return Ok(answers);
    };
    let bytes: BTreeMap<FrameId, &[u8]> = contents
        .frames
        .iter()
        .map(|frame| (frame.id, frame.payload.as_slice()))
        .collect();
    for (point, slot) in answers.iter_mut().enumerate() {
        let id = GaussPointId(point as u32);
        let state = bytes.get(&FrameId::new(POINT, id.0));
        let answer = bytes.get(&FrameId::new(ANSWER, id.0));
        if let (Some(state), Some(answer)) = (state, answer) {
            // A frame that passed its checksum and does not decode is no torn write but an error.
            let state = frames::read_point(id, state, &dealt[point])?;
            *slot = Some(frames::read_answer(id, state, answer)?);
        }
    }
    Ok(answers)
}

/// The end states of a whole wave; `None` when one is missing.
fn read_ends(
    journal: &mut StepJournal,
    wave: WaveIndex,
    dealt: &[Arc<PointState>],
) -> Result<Option<Vec<Arc<PointEnd>>>, RunError> {
    let answers: Result<_, RunError> = read_answers(journal, wave, dealt);
    Ok(answers?
        .into_iter()
        .map(|answer| answer.map(|a| a.end))
        .collect())
}
