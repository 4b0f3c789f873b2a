//! `femdem-flow bench store`: what committing, opening and branching cost on this machine and disk.

use std::path::Path;
use std::time::{Duration, Instant};

use engine::process_cpu_time;
use serde::Serialize;
use store::{
    Encoding, Frame, FrameId, NewRun, Role, RunName, Seal, StepAddress, StepIndex, Store, WaveIndex,
};

use super::{
    specimen::{Specimen, WAVES},
    statistics::Spread,
};
use crate::{
    failure::{Failure, FailureKind},
    machine::Machine,
    progress::Progress,
    report::Report,
    run::{
        step_frames::{POINT, answer_frame, point_frame},
        text,
    },
};

/// What to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// REVs of a step.
    pub points: u32,
    /// Grains of a REV.
    pub grains: u32,
    /// Commits that are timed.
    pub commits: u32,
    /// Steps of the store that is opened.
    pub steps: u32,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            points: 512,
            grains: 400,
            commits: 10,
            steps: 1000,
        }
    }
}

impl Plan {
    /// A glance, in seconds.
    pub fn quick() -> Self {
        Self {
            commits: 3,
            steps: 100,
            ..Self::default()
        }
    }
}

/// Elements hand the answers of their four points to the journal together.
const POINTS_PER_ELEMENT: usize = 4;
/// Times the store is opened and a branch is made.
const OPENINGS: u32 = 5;
/// Threads of the step that the share of the store is estimated for.
const THREADS: f64 = 2.0;

/// A duration by the wall clock and by the CPU time of all threads of the process, milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
struct Cost {
    wall_ms: Spread,
    cpu_ms: Spread,
}

#[derive(Clone, Debug, Serialize)]
struct Figures {
    machine: Machine,
    folder: String,
    points: u32,
    grains: u32,
    /// Bytes of the bare states: cell and centres as f64, of each contact two u32 and an f64.
    raw_bytes: u64,
    /// Bytes of the sealed states alone.
    state_bytes: u64,
    /// Bytes of the whole pack: states, macro state, questions of the waves, index.
    pack_bytes: u64,
    /// Pack over bare states.
    disk_ratio: f64,
    /// Encoding and journalling the answers of one wave.
    journal: Cost,
    /// Sealing the step, until it survives a power cut.
    commit: Cost,
    /// Bare states a second of wall time, MB.
    commit_mb_per_s: f64,
    /// Steps of the store that is opened.
    steps: u32,
    open: Cost,
    branch: Cost,
    /// CPU seconds of one answer of a REV.
    answer_s: f64,
    /// Waves of the step that the share is estimated for.
    waves: u32,
    /// CPU time of the store over the CPU time of the REV tasks.
    overhead_cpu: f64,
    /// Wall time for which the next step waits for the commit, over that of the step on two threads.
    overhead_wall: f64,
}

/// Measures in a folder beside the store at `place`, which is removed again.
///
/// # Errors
/// A packing that cannot be prepared; a disk that cannot be written.
pub fn measure(plan: &Plan, place: &Path, progress: &dyn Progress) -> Result<Report, Failure> {
    progress.note(&format!(
        "states of {} REVs of {} grains",
        plan.points, plan.grains
    ));
    let specimen = Specimen::new(plan.points, plan.grains)?;
    let beside = place.ancestors().skip(1).find(|folder| folder.is_dir());
    let beside = beside.unwrap_or(Path::new("."));
    let folder = tempfile::Builder::new()
        .prefix(".femdem-flow-bench-")
        .tempdir_in(beside)
        .map_err(failed)?;
    let store = Store::open(folder.path()).map_err(failed)?;
    progress.note(&format!("{} commits", plan.commits));
    let committed = commits(&store, plan, &specimen)?;
    progress.note(&format!("a store of {} steps", plan.steps));
    let run = fill(&store, plan)?;
    drop(store);
    let (open, branch) = openings(folder.path(), &run, plan)?;
    let pack_bytes = committed.pack_bytes;
    let waves = f64::from(WAVES);
    let step_cpu_s = waves * f64::from(plan.points) * specimen.answer_s;
    let store_cpu_s =
        1e-3 * (waves * committed.journal.cpu_ms.median + committed.commit.cpu_ms.median);
    let figures = Figures {
        machine: Machine::this(),
        folder: beside.display().to_string(),
        points: plan.points,
        grains: plan.grains,
        raw_bytes: specimen.raw_bytes,
        state_bytes: committed.state_bytes,
        pack_bytes,
        disk_ratio: pack_bytes as f64 / specimen.raw_bytes as f64,
        commit_mb_per_s: 1e-3 * specimen.raw_bytes as f64 / committed.commit.wall_ms.median,
        journal: committed.journal,
        commit: committed.commit,
        steps: plan.steps,
        open,
        branch,
        answer_s: specimen.answer_s,
        waves: WAVES,
        overhead_cpu: store_cpu_s / step_cpu_s,
        overhead_wall: 1e-3 * committed.commit.wall_ms.median * THREADS / step_cpu_s,
    };
    Ok(Report::new(in_words(&figures), &figures))
}

fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Failure {
    Failure::new(FailureKind::Store, "failed to measure the store")
        .because(error)
        .hint("`--store DIR` names a store; what is measured lies beside it for that time")
}

struct Committed {
    journal: Cost,
    commit: Cost,
    pack_bytes: u64,
    state_bytes: u64,
}

fn commits(store: &Store, plan: &Plan, specimen: &Specimen) -> Result<Committed, Failure> {
    let run = create(store, "full", None)?;
    let wave = WaveIndex(0);
    let (mut journalled, mut sealed) = (Times::default(), Times::default());
    let mut pack_bytes = 0;
    for step in 0..plan.commits {
        let mut journal = store.journal(&run, StepIndex(step)).map_err(failed)?;
        journal.open_wave(wave, b"measured").map_err(failed)?;
        journalled
            .time(|| {
                for element in specimen.answers.chunks(POINTS_PER_ELEMENT) {
                    for answer in element {
                        journal.append(wave, &point_frame(answer.point, &answer.end.state))?;
                        journal.append(wave, &answer_frame(answer))?;
                    }
                    journal.flush()?;
                }
                Ok::<(), store::JournalError>(())
            })
            .map_err(failed)?;
        let seal = Seal {
            final_wave: Some(wave),
            extra: specimen.extra.clone(),
            summary: vec![0; 1000],
        };
        let committed = sealed
            .time(|| journal.commit(seal, |id| id.kind == POINT))
            .map_err(failed)?;
        pack_bytes = committed.bytes;
    }
    let last = StepIndex(plan.commits.saturating_sub(1));
    let frames = store.step(&run, last).map_err(failed)?.frames();
    let states = frames.iter().filter(|frame| frame.id.kind == POINT);
    Ok(Committed {
        journal: journalled.cost(),
        commit: sealed.cost(),
        pack_bytes,
        state_bytes: states.map(|frame| frame.stored).sum(),
    })
}

/// A run of many steps: as many frames as a step of full size, but short ones, which opening does not read.
fn fill(store: &Store, plan: &Plan) -> Result<RunName, Failure> {
    let run = create(store, "long", None)?;
    let frames: Vec<Frame> = (0..plan.points)
        .map(|point| Frame {
            id: FrameId::new(POINT, point),
            role: Role::Content,
            encoding: Encoding::Raw,
            payload: point.to_le_bytes().repeat(8),
        })
        .collect();
    for step in 0..plan.steps {
        let seal = Seal {
            final_wave: None,
            extra: frames.clone(),
            summary: vec![0; 1000],
        };
        let journal = store.journal(&run, StepIndex(step)).map_err(failed)?;
        journal.commit(seal, |_| true).map_err(failed)?;
    }
    Ok(run)
}

fn openings(folder: &Path, run: &RunName, plan: &Plan) -> Result<(Cost, Cost), Failure> {
    let (mut opened, mut branched) = (Times::default(), Times::default());
    for branch in 0..OPENINGS {
        let store = opened.time(|| Store::open(folder)).map_err(failed)?;
        let parent = StepAddress {
            run: run.clone(),
            step: StepIndex(plan.steps / 2),
        };
        let name = format!("branch-{branch}");
        branched.time(|| create(&store, &name, Some(parent)))?;
    }
    Ok((opened.cost(), branched.cost()))
}

fn create(store: &Store, name: &str, parent: Option<StepAddress>) -> Result<RunName, Failure> {
    let run = NewRun {
        name: RunName::new(name).map_err(failed)?,
        created: 0,
        parent,
        manifest: vec![0; 4000],
    };
    Ok(store.create_run(run).map_err(failed)?.name)
}

/// Repetitions of one thing, milliseconds.
#[derive(Default)]
struct Times {
    wall: Vec<f64>,
    cpu: Vec<f64>,
}

impl Times {
    fn time<T>(&mut self, what: impl FnOnce() -> T) -> T {
        let (wall, cpu) = (Instant::now(), process_cpu_time());
        let result = what();
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        self.cpu.push(ms(process_cpu_time().saturating_sub(cpu)));
        self.wall.push(ms(wall.elapsed()));
        result
    }

    fn cost(&self) -> Cost {
        Cost {
            wall_ms: Spread::of(&self.wall).unwrap_or_default(),
            cpu_ms: Spread::of(&self.cpu).unwrap_or_default(),
        }
    }
}

fn in_words(figures: &Figures) -> String {
    let machine = &figures.machine;
    let cost = |cost: &Cost| {
        format!(
            "{:.1} ms of CPU time, {:.1} ms of wall time (largest {:.1})",
            cost.cpu_ms.median, cost.wall_ms.median, cost.wall_ms.max
        )
    };
    let rows = [
        ("journal", format!("a wave in {}", cost(&figures.journal))),
        (
            "commit",
            format!(
                "a step in {}, {:.0} MB/s",
                cost(&figures.commit),
                figures.commit_mb_per_s
            ),
        ),
        (
            "disk",
            format!(
                "{} a step, {:.2} of the bare states ({}); the states alone {:.2}",
                text::bytes(figures.pack_bytes),
                figures.disk_ratio,
                text::bytes(figures.raw_bytes),
                figures.state_bytes as f64 / figures.raw_bytes as f64
            ),
        ),
        (
            "open",
            format!(
                "a store of {} steps in {}",
                figures.steps,
                cost(&figures.open)
            ),
        ),
        ("branch", format!("made in {}", cost(&figures.branch))),
        (
            "share",
            format!(
                "{:.2} % of the CPU time of a step of {} iterations at {:.1} ms an answer; the next step waits {:.2} % of its wall time on two threads for the commit",
                100.0 * figures.overhead_cpu,
                figures.waves,
                1e3 * figures.answer_s,
                100.0 * figures.overhead_wall
            ),
        ),
    ];
    let mut out = format!(
        "femdem-flow {} on {}, {} REVs of {} grains, in {}\n",
        machine.version, machine.processor, figures.points, figures.grains, figures.folder
    );
    for (what, row) in rows {
        out.push_str(&format!("  {what:<8} {row}\n"));
    }
    out.push_str(
        "Medians. Bare states: cell and centres as f64, of each contact two u32 and an f64.\n",
    );
    out
}
