//! What can go wrong, by operation. Messages are fragments that read after "failed to …".

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::frame::FrameId;
use crate::id::{RunName, StepAddress, StepIndex, WaveIndex};

/// The operating system refused a file operation.
#[derive(Debug, Error)]
#[error("{action} `{}`: {source}", path.display())]
pub struct IoFailure {
    /// What was tried: "read", "write", "rename", …
    pub action: &'static str,
    /// On which path.
    pub path: PathBuf,
    /// What the operating system answered.
    pub source: io::Error,
}

impl IoFailure {
    pub(crate) fn of(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self {
            action,
            path,
            source,
        }
    }

    pub(crate) fn is_missing(&self) -> bool {
        self.source.kind() == io::ErrorKind::NotFound
    }
}

/// A file's bytes are not the ones that were written.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("read `{}`, which is damaged: {what}; {remedy}", path.display())]
pub struct Damage {
    /// The damaged file.
    pub path: PathBuf,
    /// What does not fit.
    pub what: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl Damage {
    pub(crate) fn new(path: &Path, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            path: path.to_owned(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }
}

/// Opening or creating a store failed.
#[derive(Debug, Error)]
pub enum OpenError {
    /// Another process (or another `Store` of this one) owns the store.
    #[error("open the store `{}`: {} has it open", dir.display(), holder_text(*pid, host.as_deref()))]
    Held {
        /// The store.
        dir: PathBuf,
        /// The owner's process id, where `LOCK` could be read.
        pid: Option<u32>,
        /// The owner's host name, where `LOCK` could be read.
        host: Option<String>,
    },
    /// The folder has other things in it and is no store.
    #[error("open `{}` as a store: it has no FORMAT file but is not empty; name another folder, \
             or, if this was a store, put the line `{}` back into its FORMAT file", dir.display(), crate::format::LINE.trim_end())]
    NotAStore {
        /// The folder.
        dir: PathBuf,
    },
    /// There is no store there (only for read-only opening, which creates nothing).
    #[error("find a store in `{}`", dir.display())]
    Missing {
        /// The folder.
        dir: PathBuf,
    },
    /// A store of a format that this version does not know.
    #[error("open the store `{}`: its format is {found}, femdem-flow {version} knows formats {oldest} to {known}; \
             use the femdem-flow version that wrote it, or a later one", dir.display(),
             version = env!("CARGO_PKG_VERSION"), oldest = crate::format::OLDEST, known = crate::format::VERSION)]
    UnknownFormat {
        /// The folder.
        dir: PathBuf,
        /// The format's number as found.
        found: u64,
    },
    /// A damaged file that cannot be repaired from the others.
    #[error(transparent)]
    Damaged(#[from] Damage),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

fn holder_text(pid: Option<u32>, host: Option<&str>) -> String {
    match (pid, host) {
        (Some(pid), Some(host)) => format!("process {pid} on {host}"),
        (Some(pid), None) => format!("process {pid}"),
        _ => "another process".to_owned(),
    }
}

/// Queueing something failed.
#[derive(Debug, Error)]
pub enum QueueError {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
    /// It cannot be stored.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// Reading something committed failed.
#[derive(Debug, Error)]
pub enum ReadError {
    /// No such run.
    #[error("find the run `{0}`")]
    NoSuchRun(RunName),
    /// No such step in the run or its ancestors.
    #[error("find the step {0}")]
    NoSuchStep(StepAddress),
    /// The step was committed, but its pack is gone.
    #[error("read the step {step}: its pack `{}` is gone; restore it from a copy, \
             or set the run back to the step before", path.display())]
    PackMissing {
        /// The step.
        step: StepAddress,
        /// Where the pack should be.
        path: PathBuf,
    },
    /// The step was committed, and its pack was removed on purpose.
    #[error("read the step {0}: it was pruned, only its figures are left")]
    Pruned(StepAddress),
    /// No such frame in the pack.
    #[error("find {frame} in `{}`", path.display())]
    NoSuchFrame {
        /// The pack.
        path: PathBuf,
        /// The frame asked for.
        frame: FrameId,
    },
    /// The bytes are not the ones that were written.
    #[error(transparent)]
    Damaged(#[from] Damage),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Creating a run or recording its state failed.
#[derive(Debug, Error)]
pub enum RunError {
    /// The step to branch from cannot be used.
    #[error("branch from {parent}: could not {source}")]
    Parent {
        /// The step that was to be the parent.
        parent: StepAddress,
        /// Why it cannot be read.
        source: ReadError,
    },
    /// The run's record is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Giving a run another name failed.
#[derive(Debug, Error)]
pub enum RenameError {
    /// Another run answers to the name: it is called so, or it was born with it.
    #[error("give the name `{name}`, which belongs to the run `{by}`")]
    Taken {
        /// The name that was asked for.
        name: RunName,
        /// The run that has it, as people call it.
        by: RunName,
    },
    /// The store's format has no labels yet.
    #[error("give a name in a store of format {found}, which has none to give")]
    EarlierFormat {
        /// The format's number.
        found: u64,
    },
    /// There is no store.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such run.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Working with the journal of the running step failed.
#[derive(Debug, Error)]
pub enum JournalError {
    /// The run has a journal open already.
    #[error("open the journal of `{0}`, which is open already")]
    Busy(RunName),
    /// The step was committed before.
    #[error("open the journal of {0}, which is committed already")]
    Committed(StepAddress),
    /// Steps are consecutive; this one leaves a gap.
    #[error("open the journal of {step}: the next step of this run is {expected}")]
    OutOfOrder {
        /// The step asked for.
        step: StepAddress,
        /// The step that comes next.
        expected: StepIndex,
    },
    /// The step to continue from is damaged.
    #[error("continue from {step}: {what}; set the run back to the step before, which is sound")]
    PredecessorDamaged {
        /// The step before.
        step: StepAddress,
        /// What is wrong with it.
        what: String,
    },
    /// A frame went to a wave that is not open.
    #[error("append to wave {0}, which is not open")]
    WaveNotOpen(WaveIndex),
    /// The frame cannot be stored.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The run's record is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// A frame that cannot be stored.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FrameError {
    /// The kinds above [`FrameId::LAST_KIND`] are the store's own.
    #[error("store {0}: its kind is reserved")]
    ReservedKind(FrameId),
    /// The payload is longer than [`crate::MAX_PAYLOAD`].
    #[error("store {id} of {len} bytes: a frame holds at most {max} bytes", max = crate::MAX_PAYLOAD)]
    TooLong {
        /// The frame.
        id: FrameId,
        /// Its length in bytes.
        len: usize,
    },
    /// Two frames of a pack have one id.
    #[error("store {0} twice in one step")]
    Duplicate(FrameId),
}

/// Writing a pack failed.
#[derive(Debug, Error)]
pub(crate) enum PackError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Io(#[from] IoFailure),
}

impl From<PackError> for CommitError {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Frame(error) => Self::Frame(error),
            PackError::Io(error) => Self::Io(error),
        }
    }
}

impl From<PackError> for CacheError {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Frame(error) => Self::Frame(error),
            PackError::Io(error) => Self::Io(error),
        }
    }
}

/// Committing a step failed; unless said otherwise the step did not happen and its journal is as before.
#[derive(Debug, Error)]
pub enum CommitError {
    /// The wave to commit was never journalled.
    #[error("commit wave {0}, which has no journal")]
    NoSuchWave(WaveIndex),
    /// The journal on disk no longer has what was written to it.
    #[error(
        "commit wave {wave}: its journal `{}` lost frames since they were written ({lost} of them); \
             resume the run to compute them again", path.display()
    )]
    FramesLost {
        /// The wave.
        wave: WaveIndex,
        /// Its journal file.
        path: PathBuf,
        /// How many frames are gone.
        lost: usize,
    },
    /// A frame cannot be stored.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The journal cannot be written or read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Why a run cannot lose steps now. Runs are named as people call them.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum InUse {
    /// Another run takes up a step that would go.
    #[error("`{child}` takes up {parent}")]
    Branch {
        /// The other run.
        child: RunName,
        /// The step.
        parent: StepAddress,
    },
    /// A step of it is being computed.
    #[error("the journal of `{0}` is open")]
    Journal(RunName),
}

/// Setting a run back failed.
#[derive(Debug, Error)]
pub enum SetBackError {
    /// Something needs what would go.
    #[error("set the run back: {0}")]
    InUse(#[from] InUse),
    /// The step belongs to an ancestor, or the run has no such step.
    #[error("set the run back to before {0}, which is no step of its own")]
    NotOwnStep(StepAddress),
    /// The run's record is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Deleting a run failed; it is whole or gone.
#[derive(Debug, Error)]
pub enum DeleteError {
    /// Something needs the run.
    #[error("delete the run: {0}")]
    InUse(#[from] InUse),
    /// A run's record is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Pruning a run failed; each of its steps is whole or pruned.
#[derive(Debug, Error)]
pub enum PruneError {
    /// Something needs the run as it is.
    #[error("prune the run: {0}")]
    InUse(#[from] InUse),
    /// A run's record is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Writing an archive failed; there is no file then.
#[derive(Debug, Error)]
pub enum ArchiveError {
    /// The file is there already.
    #[error("write `{}`, which exists already", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// A step cannot be taken along.
    #[error("read the step {step}: {what}")]
    Lost {
        /// The step, its run as people call it.
        step: StepAddress,
        /// What is wrong with it.
        what: String,
    },
    /// Something in the store is missing or damaged.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Taking an archive in failed; the store is as it was.
#[derive(Debug, Error)]
pub enum ImportError {
    /// The file is something else.
    #[error("find an archive of runs in `{}`", path.display())]
    NotAnArchive {
        /// The file.
        path: PathBuf,
    },
    /// An archive of a later format.
    #[error("read `{}`: it is an archive of a later format than femdem-flow {} knows", path.display(), env!("CARGO_PKG_VERSION"))]
    LaterFormat {
        /// The file.
        path: PathBuf,
    },
    /// A run of the store answers to a name that one of the archive has.
    #[error("give a run the name `{name}`, which belongs to the run `{by}` of the store")]
    Taken {
        /// The name.
        name: RunName,
        /// The run of the store, as people call it.
        by: RunName,
    },
    /// Too little disk space is free.
    #[error("take an archive in: the disk of `{}` has {free} bytes free, {needed} are needed", dir.display())]
    Full {
        /// The store.
        dir: PathBuf,
        /// Free bytes for this user.
        free: u64,
        /// Bytes needed.
        needed: u64,
    },
    /// The archive's bytes are not the ones that were written.
    #[error(transparent)]
    Damaged(#[from] Damage),
    /// A pack of it cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A frame cannot be stored.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

impl From<PackError> for ImportError {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Frame(error) => Self::Frame(error),
            PackError::Io(error) => Self::Io(error),
        }
    }
}

/// Checking a store failed (what is wrong *in* the store is a finding, not an error).
#[derive(Debug, Error)]
pub enum CheckError {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Rebuilding the database failed; the packs are untouched.
#[derive(Debug, Error)]
pub enum RebuildError {
    /// The database could not be written.
    #[error("write the database: {0}")]
    Database(String),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Reading or writing the cache failed.
#[derive(Debug, Error)]
pub enum CacheError {
    /// The payload cannot be stored.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}

/// Too little disk space is free.
#[derive(Debug, Error)]
pub enum SpaceError {
    /// The next step might not fit.
    #[error(
        "start a step: the disk of `{}` has {free} bytes free, {needed} are needed; \
             free some space and resume", dir.display()
    )]
    Full {
        /// The store.
        dir: PathBuf,
        /// Free bytes for this user.
        free: u64,
        /// Bytes needed to start.
        needed: u64,
    },
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] IoFailure),
}
