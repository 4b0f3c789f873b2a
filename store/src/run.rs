//! Runs: what is fixed when one is created (`run.rmp`) and the little that changes (`state.rmp`).

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Damage, IoFailure, ReadError};
use crate::files;
use crate::id::{RunName, StepAddress, StepIndex};
use crate::layout::{self, Layout};
use crate::record;

const RUN_FILE: &str = "run.rmp";
/// The record is too small to save space on and too precious to have once.
const RUN_COPY: &str = "run.copy.rmp";
const RUN_REMEDY: &str = "restore the run's `run.rmp` from a copy; its packs are not affected";
const STATE_REMEDY: &str = "open the store for writing (any `resume` does), which writes it anew";

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RunState {
    /// Created, no step begun.
    Prepared,
    /// A process works on it, or was killed while it did: whoever can open the store for writing knows
    /// that it is the latter.
    Running,
    /// Stopped in order before its end; can be resumed.
    Interrupted,
    /// Came to the end of its programme.
    Completed,
    /// Stopped because a step cannot be solved.
    Failed,
}

/// What a run is created from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewRun {
    /// The name wanted; where it is taken, the run gets it with `-2`, `-3`, … behind.
    pub name: RunName,
    /// When it was created, in the caller's own count: the store has no clock.
    pub created: u64,
    /// The step it branches off, `None` for a run from the beginning.
    pub parent: Option<StepAddress>,
    /// The caller's description of the run: the input as resolved, the version, … Never changed.
    pub manifest: Vec<u8>,
}

/// A run as it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunRecord {
    /// The name it was born with, by which the store knows it.
    pub name: RunName,
    /// The name that people gave it since.
    pub label: Option<RunName>,
    /// When it was created, as the caller counted.
    pub created: u64,
    /// The step it branches off.
    pub parent: Option<StepAddress>,
    /// The caller's description of the run.
    pub manifest: Vec<u8>,
    /// How far it has come.
    pub state: RunState,
    /// The caller's words on the state: why it failed, where it stopped.
    pub note: String,
    /// The last step committed in the run, or else the parent's step.
    pub last_step: Option<StepIndex>,
}

impl RunRecord {
    /// What people call the run.
    pub fn shown(&self) -> &RunName {
        self.label.as_ref().unwrap_or(&self.name)
    }
}

/// `run.rmp`, fixed at creation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RunFile {
    pub(crate) name: RunName,
    pub(crate) created: u64,
    pub(crate) parent: Option<StepAddress>,
    #[serde(with = "serde_bytes")]
    pub(crate) manifest: Vec<u8>,
}

/// `state.rmp`, replaced whenever the state changes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct StateFile {
    pub(crate) state: RunState,
    pub(crate) note: String,
    /// The last own step when this was written: shows a lost tail even where the database is lost too.
    pub(crate) last_own: Option<StepIndex>,
}

/// Makes the folder of a run under a name of its own and moves it into place, so that a run either exists
/// with its record or does not exist.
pub(crate) fn create(layout: &Layout, run: &RunFile) -> Result<(), IoFailure> {
    let dir = layout.new_run(&run.name);
    if dir.exists() {
        fs::remove_dir_all(&dir).map_err(IoFailure::of("remove", &dir))?;
    }
    files::create_folder(&dir)?;
    write_records(&dir, run)?;
    let state = StateFile {
        state: RunState::Prepared,
        note: String::new(),
        last_own: None,
    };
    record::write(&dir.join(layout::STATE), &state)?;
    files::rename_durably(&dir, &layout.run(&run.name))
}

/// Writes a run's two records into its folder.
pub(crate) fn write_records(dir: &Path, run: &RunFile) -> Result<(), IoFailure> {
    record::write(&dir.join(RUN_FILE), run)?;
    record::write(&dir.join(RUN_COPY), run)
}

/// Reads `run.rmp`, or its copy where that is damaged.
pub(crate) fn read(layout: &Layout, run: &RunName) -> Result<RunFile, ReadError> {
    let dir = layout.run(run);
    if !dir.is_dir() {
        return Err(ReadError::NoSuchRun(run.clone()));
    }
    read_one(layout, run, RUN_FILE).or_else(|error| {
        // The first error names the file that matters.
        read_one(layout, run, RUN_COPY).map_err(|_| error)
    })
}

fn read_one(layout: &Layout, run: &RunName, name: &str) -> Result<RunFile, ReadError> {
    let path = layout.run(run).join(name);
    let file: RunFile = match record::read(&path, RUN_REMEDY) {
        Err(ReadError::Io(error)) if error.is_missing() => {
            return Err(Damage::new(&path, "it is missing", RUN_REMEDY).into());
        }
        other => other?,
    };
    if file.name != *run {
        let what = format!("it is the record of `{}`", file.name);
        return Err(Damage::new(&path, what, RUN_REMEDY).into());
    }
    Ok(file)
}

/// The damaged ones of a run's two records.
pub(crate) fn damaged_records(layout: &Layout, run: &RunName) -> Vec<ReadError> {
    [RUN_FILE, RUN_COPY]
        .into_iter()
        .filter_map(|name| read_one(layout, run, name).err())
        .collect()
}

/// Writes the sound one of a run's two records over the damaged one; `false` where both are sound.
pub(crate) fn repair_records(layout: &Layout, run: &RunName) -> Result<bool, ReadError> {
    if damaged_records(layout, run).is_empty() {
        return Ok(false);
    }
    let sound = read(layout, run)?;
    for name in [RUN_FILE, RUN_COPY] {
        record::write(&layout.run(run).join(name), &sound)?;
    }
    Ok(true)
}

/// Reads `state.rmp`.
pub(crate) fn read_state(layout: &Layout, run: &RunName) -> Result<StateFile, ReadError> {
    record::read(&layout.state(run), STATE_REMEDY)
}

/// Replaces `state.rmp`.
pub(crate) fn write_state(
    layout: &Layout,
    run: &RunName,
    state: &StateFile,
) -> Result<(), IoFailure> {
    record::write(&layout.state(run), state)
}

/// What to say where `state.rmp` is lost: the run can be resumed, whatever it was doing.
pub(crate) fn lost_state(last_own: Option<StepIndex>) -> StateFile {
    StateFile {
        state: RunState::Interrupted,
        note: "the record of its state was damaged".to_owned(),
        last_own,
    }
}
