//! The store of femdem-flow: runs, sealed snapshots of their committed steps, the journal of the step that
//! is running, and a cache. Bytes in, bytes out, all checked; what they mean is the caller's business.
//!
//! One rule: a step is either wholly committed or it never happened. A step's bulk is one sealed *pack*, a
//! file that describes and checks itself; a [sled](https://docs.rs/sled/0.34.7) database beside the packs
//! indexes them and can always be rebuilt from them. Where the two differ, the files are right. The layout
//! and every format are laid down to the byte in `docs/design/store.md`.
//!
//! ```
//! use store::{Frame, FrameId, NewRun, RunName, Seal, StepIndex, Store, WaveIndex};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let dir = tempfile::tempdir()?;
//! let store = Store::open(dir.path())?;
//! let name = RunName::new("hollow")?;
//! let run = store.create_run(NewRun { name, created: 0, parent: None, manifest: b"input".to_vec() })?;
//!
//! let mut journal = store.journal(&run.name, StepIndex(1))?;
//! let wave = WaveIndex(0);
//! journal.open_wave(wave, b"what makes this wave this wave")?;
//! journal.append(wave, &Frame::content(FrameId::new(1, 0), vec![1, 2, 3]))?;
//! journal.flush()?; // A kill from here on loses nothing of it.
//! let seal = Seal { final_wave: Some(wave), extra: vec![], summary: b"3 iterations".to_vec() };
//! let committed = journal.commit(seal, |_| true)?;
//!
//! let step = store.step(&run.name, StepIndex(1))?;
//! assert_eq!(step.frame(FrameId::new(1, 0))?, [1, 2, 3]);
//! assert_eq!(step.digest(), committed.digest);
//! # Ok(())
//! # }
//! ```

mod archive;
mod cache;
mod check;
mod checkpoint;
mod codec;
mod database;
mod error;
mod files;
mod format;
mod frame;
mod id;
mod journal;
mod label;
mod layout;
mod lock;
mod open;
mod pack;
mod part;
mod peek;
mod prune;
mod queue;
mod read_only;
mod record;
mod run;
mod set_back;
mod source;
mod space;
mod step;
mod store;

pub use archive::{Exported, Extent, Imported, ImportedRun, Naming, Taking, check_archive};
pub use check::{CheckReport, Depth, Finding, Severity};
pub use error::{
    ArchiveError, CacheError, CheckError, CommitError, Damage, DeleteError, FrameError,
    ImportError, InUse, IoFailure, JournalError, OpenError, PruneError, QueueError, ReadError,
    RebuildError, RenameError, RunError, SetBackError, SpaceError,
};
pub use format::VERSION as FORMAT_VERSION;
pub use frame::{Encoding, Frame, FrameId, Role};
pub use id::{Digest, RunName, RunNameError, StepAddress, StepIndex, WaveIndex};
pub use journal::{Committed, Seal, StepJournal, WaveContents, WaveOpening};
pub use label::{Names, rename_run};
pub use peek::FrameCount;
pub use queue::{EntryId, EntryState, Queue, QueueEntry};
pub use read_only::ReadOnlyStore;
pub use run::{NewRun, RunRecord, RunState};
pub use space::{StoreInfo, free_space_at};
pub use step::{FrameInfo, StepHealth, StepReader, StepRecord};
pub use store::{RebuildReport, Store};

/// The longest payload of a frame, in bytes.
pub const MAX_PAYLOAD: usize = 1 << 30;

/// Name of the thread on which the database runs. sled reports damage by panicking; such a panic is caught
/// and ends as a rebuild, so a program's panic hook may keep quiet about this thread.
pub const DATABASE_THREAD: &str = database::THREAD;
