//! Looking at a store while another process owns it: files only, no lock, no database.

use std::path::{Path, PathBuf};

use crate::cache;
use crate::check::{self, CheckReport, Depth};
use crate::error::{CheckError, IoFailure, JournalError, OpenError, ReadError};
use crate::format::{self, Found};
use crate::id::{Digest, RunName, StepIndex, WaveIndex};
use crate::journal::{self, WaveContents};
use crate::label::Names;
use crate::layout::Layout;
use crate::run::RunRecord;
use crate::source::Source;
use crate::space::{self, StoreInfo};
use crate::step::{self, StepReader, StepRecord};

/// A store opened for looking. It never writes, and sees what is committed at the time of each call.
#[derive(Clone, Debug)]
pub struct ReadOnlyStore {
    layout: Layout,
}

impl Source for ReadOnlyStore {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn own_steps(&self, run: &RunName) -> Result<Vec<StepRecord>, ReadError> {
        Ok(step::scan(&self.layout, run, |_| None, std::iter::empty())?)
    }
}

impl ReadOnlyStore {
    pub(crate) fn files(&self) -> &Layout {
        &self.layout
    }

    /// Opens the store in `dir`, which must exist.
    pub fn open(dir: &Path) -> Result<Self, OpenError> {
        let layout = Layout::new(dir);
        let missing = || OpenError::Missing {
            dir: dir.to_owned(),
        };
        if !dir.is_dir() {
            return Err(missing());
        }
        match format::read(&layout)? {
            Found::Known | Found::Earlier(_) => Ok(Self { layout }),
            Found::Nothing => Err(missing()),
        }
    }

    /// The store's folder.
    pub fn dir(&self) -> &Path {
        self.layout.root()
    }

    /// The names of the runs, ascending.
    pub fn run_names(&self) -> Result<Vec<RunName>, ReadError> {
        Ok(self.layout.run_names()?)
    }

    /// What the runs are called.
    pub fn names(&self) -> Result<Names, ReadError> {
        Ok(Names::read(&self.layout)?)
    }

    /// The folder of work that waits for the store, the caller's to fill; it may not be there yet.
    pub fn queue_path(&self) -> PathBuf {
        self.layout.queue()
    }

    /// All runs in the order of their names. The first unreadable one is the error; go through
    /// [`Self::run_names`] to get past it.
    pub fn runs(&self) -> Result<Vec<RunRecord>, ReadError> {
        Source::runs(self)
    }

    /// One run.
    pub fn run(&self, run: &RunName) -> Result<RunRecord, ReadError> {
        Source::run(self, run)
    }

    /// The committed steps of a run and its ancestors, ascending, damaged ones included.
    pub fn steps(&self, run: &RunName) -> Result<Vec<StepRecord>, ReadError> {
        Source::steps(self, run)
    }

    /// Opens a committed step of a run or its ancestors.
    pub fn step(&self, run: &RunName, step: StepIndex) -> Result<StepReader, ReadError> {
        Source::step(self, run, step)
    }

    /// The journalled waves of a step, ascending.
    pub fn waves(&self, run: &RunName, step: StepIndex) -> Result<Vec<WaveIndex>, IoFailure> {
        self.layout.waves(run, step)
    }

    /// What is journalled of a wave; `None` where there is nothing sound.
    pub fn read_wave(
        &self,
        run: &RunName,
        step: StepIndex,
        wave: WaveIndex,
    ) -> Result<Option<WaveContents>, JournalError> {
        journal::read(&self.layout, run, step, wave)
    }

    /// Where the caller keeps the run's event log.
    pub fn events_path(&self, run: &RunName) -> PathBuf {
        self.layout.events(run)
    }

    /// What the cache has under `key`; `None` also where the entry is damaged.
    pub fn cache_get(&self, key: &Digest) -> Option<Vec<u8>> {
        cache::get(&self.layout, key)
    }

    /// Looks for damage and leftovers; the database is the owner's and is not looked at.
    pub fn check(&self, depth: Depth) -> Result<CheckReport, CheckError> {
        check::files(self, depth)
    }

    /// Sizes and counts.
    pub fn info(&self) -> Result<StoreInfo, ReadError> {
        space::info(self)
    }
}
