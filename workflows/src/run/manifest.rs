//! What a run is, written once when it is created.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::{
    input::{Problem, derive::Change},
    machine::Machine,
};

/// The description of a run. The input as resolved decides what is computed; the rest is for the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of femdem-flow.
    pub version: String,
    /// Instruction sets the macro solver's linear algebra may choose from on the first machine.
    pub cpu: Vec<String>,
    /// Processor of the first machine; empty in runs from before it was recorded.
    #[serde(default)]
    pub processor: String,
    /// Versions of the macro solver's linear algebra; empty in runs from before it was recorded.
    #[serde(default)]
    pub linear_algebra: String,
    /// Threads of the first session.
    pub threads: usize,
    /// The input as resolved.
    pub problem: Problem,
    /// What sets the run apart from the one it takes up; `None` for a run from the beginning.
    #[serde(default)]
    pub descent: Option<Descent>,
    /// Materials, by index, whose contact law or elastic constants are no longer those that were dealt out with the
    /// packings at step 0.
    #[serde(default)]
    pub relawed: BTreeSet<usize>,
    /// Names the work that the run was made for, where that may be asked for twice: an entry of the queue, or a command
    /// under supervision. Empty otherwise.
    #[serde(default)]
    pub ticket: String,
}

/// How a run descends from the one whose step it takes up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Descent {
    /// In which sense it goes on.
    pub kind: Kind,
    /// What differs from that run, in the order of the keys.
    pub changes: Vec<Change>,
}

/// In which sense a run goes on from a step of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Another future of the same past.
    Branch,
    /// The same programme once more.
    Rerun,
    /// A new start from the states of the step: materials changed, so that no run with the present settings could have
    /// come to them.
    Seeded,
}

impl Kind {
    /// One word for lists and machines.
    pub fn word(self) -> &'static str {
        match self {
            Self::Branch => "branch",
            Self::Rerun => "rerun",
            Self::Seeded => "seeded",
        }
    }
}

impl Manifest {
    /// The manifest of a new run on this machine.
    pub fn new(problem: Problem, threads: usize) -> Self {
        let machine = Machine::this();
        Self {
            version: machine.version,
            cpu: machine.features,
            processor: machine.processor,
            linear_algebra: machine.linear_algebra,
            threads,
            problem,
            descent: None,
            relawed: BTreeSet::new(),
            ticket: String::new(),
        }
    }

    /// The machine that the run was created on.
    pub fn machine(&self) -> Machine {
        Machine {
            processor: self.processor.clone(),
            features: self.cpu.clone(),
            version: self.version.clone(),
            linear_algebra: self.linear_algebra.clone(),
        }
    }

    /// Its bytes: MessagePack with names, in which every number keeps its bits.
    pub fn to_bytes(&self) -> Vec<u8> {
        rmp_serde::to_vec_named(self).expect("plain values serialise into memory")
    }

    /// The manifest back.
    ///
    /// # Errors
    /// Bytes of another version of the program or of none.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, rmp_serde::decode::Error> {
        rmp_serde::from_slice(bytes)
    }
}
