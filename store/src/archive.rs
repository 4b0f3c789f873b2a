//! One portable file for a run, or for a run with all its branches: to carry it to another store, or to keep it. Laid
//! down to the byte in `docs/design/store.md`.
//!
//! An archive stands on its own: of the ancestors it has the steps that the run takes up. It is written and read as a
//! stream, so that memory does not grow with the run. Reading trusts nothing: all goes into a folder aside, every
//! hash is checked there, and one rename lets it be.

mod arrival;
mod contents;
mod export;
mod import;
mod naming;
mod reader;
mod writer;

use serde::{Deserialize, Serialize};

pub use export::{Exported, Extent};
pub(crate) use import::finish;
pub use import::{Imported, ImportedRun, Taking, check_archive};
pub use naming::Naming;

use crate::id::{RunName, StepIndex};

/// First bytes of an archive.
const MAGIC: [u8; 8] = *b"FDFARCH1";
/// What the magic of any version begins with.
const MAGIC_STEM: &[u8] = b"FDFARCH";
/// First bytes of an entry.
const ENTRY: [u8; 4] = *b"FDE1";
/// First bytes of the end.
const END: [u8; 8] = *b"FDFAEND1";
/// Bytes of the end: magic, number of entries, blake3 of everything before.
const END_LEN: u64 = 8 + 8 + 32;
/// Bytes of an entry before its head: magic, length of the head, length of the content.
const PREFIX_LEN: u64 = 4 + 4 + 8;
/// The longest head: two names and some numbers.
const LONGEST_HEAD: u32 = 4096;
/// The longest content that is held in memory: tables and records, never packs.
const LONGEST_IN_MEMORY: u64 = 1 << 28;

/// What an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    /// The table of contents, the first entry.
    Contents,
    /// `run.rmp` of a run: begins what belongs to it.
    Record,
    /// Its `state.rmp`.
    State,
    /// Its label.
    Label,
    /// Its event log.
    Events,
    /// A sealed step.
    Pack,
    /// A pruned step.
    Stub,
}

/// What stands before the content of an entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Head {
    kind: Kind,
    /// The run it belongs to, by the name it was born with.
    run: RunName,
    /// The step, of a pack and a stub.
    step: Option<StepIndex>,
}
