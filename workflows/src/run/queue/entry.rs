//! What an entry of the queue says: all that is needed to do the work, whatever becomes of the files it was made from.

use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;
use store::{Names, RunName};

use crate::run::control::Asker;

/// An entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Names the work for good: the run that is made of it carries it too, so that it is not made twice.
    pub ticket: String,
    /// Seconds since 1970 at which it was queued.
    pub queued: u64,
    /// Who queued it.
    pub by: Asker,
    /// The run: its name, or the one that is wanted for it.
    pub run: String,
    /// What is to be done.
    pub work: Work,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Work {
    /// Make a run and compute it.
    Create {
        /// The verb that asked for it.
        verb: String,
        /// Run and step that it takes up.
        parent: Option<(String, u32)>,
        /// What it is.
        manifest: ByteBuf,
    },
    /// Compute a run that is there.
    Resume,
}

impl Work {
    /// One word for lists: the verb that was typed.
    pub fn verb(&self) -> &str {
        match self {
            Self::Create { verb, .. } => verb,
            Self::Resume => "resume",
        }
    }
}

impl Entry {
    /// With the name that people call its run by.
    pub fn shown(mut self, names: &Names) -> Self {
        if let (Work::Resume, Ok(id)) = (&self.work, RunName::new(&self.run)) {
            self.run = names.shown(&id).to_string();
        }
        self
    }

    /// Its bytes: MessagePack with names.
    pub fn to_bytes(&self) -> Vec<u8> {
        rmp_serde::to_vec_named(self).expect("plain values serialise into memory")
    }

    /// The entry back.
    ///
    /// # Errors
    /// Bytes of another version of the program.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        rmp_serde::from_slice(bytes)
            .map_err(|error| format!("another version of femdem-flow queued it: {error}"))
    }
}
