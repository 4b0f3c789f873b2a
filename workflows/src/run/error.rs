//! Why a run cannot be begun or go on.

use thiserror::Error;

use super::frames::DecodeError;

/// Why a run cannot be begun or go on. Reads after "failed to run …".
#[derive(Debug, Error)]
pub enum RunError {
    /// The input does not make a problem after all.
    #[error("{0}")]
    Model(String),
    /// Its body does not.
    #[error(transparent)]
    Body(#[from] crate::input::body::BodyError),
    /// A packing file is of no use.
    #[error("read the packing {path}: {reason}")]
    Packing {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
    /// Packings could not be made.
    #[error("prepare {failed} of {of} packings: {reason}")]
    Preparation {
        /// How many.
        failed: usize,
        /// Of how many.
        of: usize,
        /// The first reason.
        reason: String,
    },
    /// The store's run was written by something else.
    #[error("read the run: {0}")]
    Manifest(String),
    /// A stored frame does not decode.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// The macro solver refuses a stored state.
    #[error("continue the macro state: {0}")]
    State(String),
    /// The store could not be read.
    #[error(transparent)]
    Read(#[from] store::ReadError),
    /// A run could not be created or its state recorded.
    #[error(transparent)]
    Run(#[from] store::RunError),
    /// The journal could not be written.
    #[error(transparent)]
    Journal(#[from] store::JournalError),
    /// A step could not be committed.
    #[error(transparent)]
    Commit(#[from] store::CommitError),
    /// The disk is too full to begin a step.
    #[error(transparent)]
    Space(#[from] store::SpaceError),
    /// A file beside the store could not be written.
    #[error("write {path}: {error}")]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The machine failed a task, not the physics.
    #[error("finish the task {label} in {attempts} attempt(s): it {cause}")]
    Task {
        /// Its name.
        label: String,
        /// How often it was tried.
        attempts: u32,
        /// What happened to it.
        cause: String,
    },
    /// The engine gave up.
    #[error("{0}")]
    Engine(String),
}

impl From<engine::NodeError> for RunError {
    fn from(error: engine::NodeError) -> Self {
        Self::Engine(error.to_string())
    }
}
