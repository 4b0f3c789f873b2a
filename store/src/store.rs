//! The store as its owner sees it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_bytes::ByteBuf;

use crate::cache;
use crate::check::{self, CheckReport, Depth, Finding, Severity};
use crate::database::{Change, Database, INLINE, RunRow, StepRow};
use crate::error::{
    CacheError, CheckError, IoFailure, JournalError, OpenError, ReadError, RebuildError, RunError,
    SpaceError,
};
use crate::id::{Digest, RunName, StepAddress, StepIndex};
use crate::journal::StepJournal;
use crate::label::{self, NameLock, Names};
use crate::layout::Layout;
use crate::lock::Lock;
use crate::open;
use crate::pack::{Predecessor, Sealed};
use crate::read_only::ReadOnlyStore;
use crate::run::{self, NewRun, RunFile, RunRecord, RunState, StateFile};
use crate::source::Source;
use crate::space::{self, StoreInfo};
use crate::step::{StepHealth, StepReader, StepRecord};

/// Steps by run, as the owner holds them in memory.
pub(crate) type StepIndexes = BTreeMap<RunName, BTreeMap<StepIndex, StepRecord>>;

/// What an owned store is made of. The fields are dropped in this order: the lock goes last.
pub(crate) struct Inner {
    pub(crate) layout: Layout,
    /// `None` when the database is lost; everything is in the packs, the next opening rebuilds it.
    pub(crate) database: Mutex<Option<Database>>,
    pub(crate) steps: Mutex<StepIndexes>,
    pub(crate) journals: Mutex<BTreeSet<RunName>>,
    /// Held while a cache entry is written: two of one key would share a temporary file.
    pub(crate) cache_writer: Mutex<()>,
    /// Held while an archive is taken in: there is one folder for what is on its way.
    pub(crate) importing: Mutex<()>,
    pub(crate) report: Vec<Finding>,
    pub(crate) _lock: Lock,
}

/// A store that this process owns. Clones share it; it is free for others when the last one, and the last
/// [`StepJournal`], is dropped.
#[derive(Clone)]
pub struct Store {
    pub(crate) inner: Arc<Inner>,
}

impl fmt::Debug for Store {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Store({})", self.inner.layout.root().display())
    }
}

/// What a rebuild put into the database.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RebuildReport {
    /// Runs.
    pub runs: usize,
    /// Sound steps.
    pub steps: usize,
    /// Steps that are listed as damaged or missing.
    pub lost: usize,
}

/// A mutex of ours is never held over code that can leave it half-changed.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Source for Inner {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn own_steps(&self, run: &RunName) -> Result<Vec<StepRecord>, ReadError> {
        let steps = locked(&self.steps);
        Ok(steps
            .get(run)
            .map_or_else(Vec::new, |own| own.values().cloned().collect()))
    }
}

impl Inner {
    /// Writes to the database; where that fails, goes on without: the packs have it all.
    pub(crate) fn record(&self, changes: Vec<Change>) {
        if let Err(error) = self.try_record(changes) {
            tracing::warn!(%error, "the database is lost; the next opening rebuilds it");
        }
    }

    fn try_record(&self, changes: Vec<Change>) -> Result<(), String> {
        let mut database = locked(&self.database);
        let Some(open) = database.as_ref() else {
            return Ok(());
        };
        let space = space::free(&self.layout).map_err(|error| error.to_string());
        let result = match space {
            Ok(free) if free < space::DATABASE_FLOOR => Err("the disk is full".to_owned()),
            Ok(_) => open.apply(changes),
            Err(error) => Err(error),
        };
        if result.is_err() {
            *database = None;
        }
        result
    }

    /// Takes note of a step that is sealed.
    pub(crate) fn committed(&self, address: &StepAddress, sealed: Sealed, summary: Vec<u8>) {
        let record = StepRecord {
            index: address.step,
            run: address.run.clone(),
            digest: Some(sealed.digest),
            bytes: sealed.bytes,
            summary,
            health: StepHealth::Sound,
        };
        let change = put_step(&record);
        locked(&self.steps)
            .entry(address.run.clone())
            .or_default()
            .insert(address.step, record);
        self.record(change.into_iter().collect());
    }

    pub(crate) fn release_journal(&self, run: &RunName) {
        locked(&self.journals).remove(run);
    }

    fn write_state(&self, run: &RunName, state: StateFile) -> Result<(), RunError> {
        let file = run::read(&self.layout, run)?;
        run::write_state(&self.layout, run, &state)?;
        self.record(vec![put_run(&file, &state)]);
        Ok(())
    }
}

/// The database's row of a step; none for one whose digest nobody knows.
pub(crate) fn put_step(record: &StepRecord) -> Option<Change> {
    let row = StepRow {
        digest: record.digest?,
        bytes: record.bytes,
        summary: (record.summary.len() <= INLINE).then(|| ByteBuf::from(record.summary.clone())),
    };
    Some(Change::PutStep(record.run.clone(), record.index, row))
}

/// The database's row of a run.
pub(crate) fn put_run(file: &RunFile, state: &StateFile) -> Change {
    let row = RunRow {
        created: file.created,
        parent: file.parent.clone(),
        state: state.state,
        note: (state.note.len() <= INLINE).then(|| state.note.clone()),
    };
    Change::PutRun(file.name.clone(), row)
}

impl Store {
    /// Opens the store in `dir` for writing, creating it where there is none, and puts right what a crash or
    /// damage left behind: see [`Self::opening_report`].
    pub fn open(dir: &Path) -> Result<Self, OpenError> {
        let inner = Arc::new(open::open(dir)?);
        Ok(Self { inner })
    }

    /// Opens the store in `dir` for looking only, whoever owns it.
    pub fn open_read_only(dir: &Path) -> Result<ReadOnlyStore, OpenError> {
        ReadOnlyStore::open(dir)
    }

    /// What opening found and put right.
    pub fn opening_report(&self) -> &[Finding] {
        &self.inner.report
    }

    /// The store's folder.
    pub fn dir(&self) -> &Path {
        self.inner.layout.root()
    }

    /// The names of the runs, ascending.
    pub fn run_names(&self) -> Result<Vec<RunName>, ReadError> {
        Ok(self.inner.layout.run_names()?)
    }

    /// All runs in the order of their names. The first unreadable one is the error; go through
    /// [`Self::run_names`] to get past it.
    pub fn runs(&self) -> Result<Vec<RunRecord>, ReadError> {
        self.inner.runs()
    }

    /// One run.
    pub fn run(&self, run: &RunName) -> Result<RunRecord, ReadError> {
        self.inner.run(run)
    }

    /// What the runs are called.
    pub fn names(&self) -> Result<Names, ReadError> {
        Ok(Names::read(&self.inner.layout)?)
    }

    /// The folder of work that waits for the store, the caller's to fill.
    pub fn queue_path(&self) -> PathBuf {
        self.inner.layout.queue()
    }

    /// Creates a run. It exists, with its record on disk, when this returns `Ok`.
    pub fn create_run(&self, new: NewRun) -> Result<RunRecord, RunError> {
        if let Some(parent) = &new.parent {
            let readable = self.inner.step(&parent.run, parent.step).map(drop);
            readable.map_err(|source| RunError::Parent {
                parent: label::shown(&self.inner.layout, parent),
                source,
            })?;
        }
        // Held so that no two find the same name free, threads or processes.
        let naming = NameLock::take(&self.inner.layout)?;
        let mut steps = locked(&self.inner.steps);
        let name = Names::read(&self.inner.layout)?.free(&new.name);
        let file = RunFile {
            name: name.clone(),
            created: new.created,
            parent: new.parent,
            manifest: new.manifest,
        };
        run::create(&self.inner.layout, &file)?;
        steps.insert(name.clone(), BTreeMap::new());
        drop(steps);
        drop(naming);
        let state = run::read_state(&self.inner.layout, &name)?;
        self.inner.record(vec![put_run(&file, &state)]);
        Ok(self.run(&name)?)
    }

    /// Records how far a run has come, with a note for people.
    pub fn set_run_state(
        &self,
        run: &RunName,
        state: RunState,
        note: &str,
    ) -> Result<(), RunError> {
        let last_own = self.inner.own_steps(run)?.last().map(|step| step.index);
        let state = StateFile {
            state,
            note: note.to_owned(),
            last_own,
        };
        self.inner.write_state(run, state)
    }

    /// The committed steps of a run and its ancestors, ascending, damaged ones included.
    pub fn steps(&self, run: &RunName) -> Result<Vec<StepRecord>, ReadError> {
        self.inner.steps(run)
    }

    /// Opens a committed step of a run or its ancestors.
    pub fn step(&self, run: &RunName, step: StepIndex) -> Result<StepReader, ReadError> {
        self.inner.step(run, step)
    }

    /// Opens the journal of the next step. Steps are consecutive; the first one of a run without parent may
    /// have any number.
    pub fn journal(&self, run: &RunName, step: StepIndex) -> Result<StepJournal, JournalError> {
        let address = StepAddress {
            run: run.clone(),
            step,
        };
        if !locked(&self.inner.journals).insert(run.clone()) {
            return Err(JournalError::Busy(run.clone()));
        }
        let steps = self.inner.steps(run).map_err(JournalError::from);
        match steps.and_then(|steps| predecessor(&address, steps.last())) {
            Ok(before) => Ok(StepJournal::new(Arc::clone(&self.inner), address, before)),
            Err(error) => {
                self.inner.release_journal(run);
                Err(error)
            }
        }
    }

    /// Where the caller keeps the run's event log.
    pub fn events_path(&self, run: &RunName) -> PathBuf {
        self.inner.layout.events(run)
    }

    /// What the cache has under `key`; `None` also where the entry is damaged.
    pub fn cache_get(&self, key: &Digest) -> Option<Vec<u8>> {
        cache::get(&self.inner.layout, key)
    }

    /// Puts a payload into the cache, replacing what was there.
    pub fn cache_put(&self, key: &Digest, payload: Vec<u8>) -> Result<(), CacheError> {
        let _writing = locked(&self.inner.cache_writer);
        cache::put(&self.inner.layout, key, payload)
    }

    /// Looks for damage and leftovers.
    pub fn check(&self, depth: Depth) -> Result<CheckReport, CheckError> {
        let mut report = check::files(&*self.inner, depth)?;
        if locked(&self.inner.database).is_none() {
            report.findings.push(Finding::new(
                Severity::Damage,
                &self.inner.layout.meta(),
                "the database is lost",
                "rebuild it, or open the store again when there is enough free space",
            ));
        }
        Ok(report)
    }

    /// Makes the database anew from the packs and the runs' records.
    pub fn rebuild(&self) -> Result<RebuildReport, RebuildError> {
        let mut database = locked(&self.inner.database);
        *database = None;
        open::remove_database(&self.inner.layout)?;
        let (open, _) =
            Database::open(&self.inner.layout.meta()).map_err(RebuildError::Database)?;
        let mut steps = locked(&self.inner.steps);
        let (changes, found) = open::survey(&self.inner.layout, &steps_known(&steps))?;
        open.apply(changes).map_err(RebuildError::Database)?;
        *database = Some(open);
        let all = || found.values().flat_map(BTreeMap::values);
        let report = RebuildReport {
            runs: found.len(),
            steps: all().filter(|step| step.is_sound()).count(),
            lost: all().filter(|step| step.is_lost()).count(),
        };
        *steps = found;
        Ok(report)
    }

    /// Sizes and counts.
    pub fn info(&self) -> Result<StoreInfo, ReadError> {
        space::info(&*self.inner)
    }

    /// Refuses where a step of about `expected_step` bytes might not fit: call it before each step with the
    /// size of the last one.
    pub fn free_space_guard(&self, expected_step: u64) -> Result<(), SpaceError> {
        space::guard(&self.inner.layout, expected_step)
    }

    /// Bytes free for this user on the store's disk.
    pub fn free_space(&self) -> Result<u64, IoFailure> {
        space::free(&self.inner.layout)
    }
}

/// What is known of the steps, for a survey that must not forget a missing one.
fn steps_known(steps: &StepIndexes) -> BTreeMap<RunName, BTreeMap<StepIndex, StepRow>> {
    let rows = |own: &BTreeMap<StepIndex, StepRecord>| {
        own.values()
            .filter_map(|record| match put_step(record)? {
                Change::PutStep(_, step, row) => Some((step, row)),
                Change::PutRun(..) | Change::DropStep(..) | Change::DropRun(_) => None,
            })
            .collect()
    };
    steps
        .iter()
        .map(|(run, own)| (run.clone(), rows(own)))
        .collect()
}

/// The step that `address` continues from, if it may come next after `last`.
fn predecessor(
    address: &StepAddress,
    last: Option<&StepRecord>,
) -> Result<Option<Predecessor>, JournalError> {
    let Some(last) = last else { return Ok(None) };
    if address.step <= last.index {
        return Err(JournalError::Committed(address.clone()));
    }
    let expected = StepIndex(last.index.0.saturating_add(1));
    if address.step != expected {
        let step = address.clone();
        return Err(JournalError::OutOfOrder { step, expected });
    }
    match (&last.health, last.digest) {
        (StepHealth::Sound, Some(digest)) => Ok(Some(Predecessor {
            address: last.address(),
            digest,
        })),
        (StepHealth::Damaged(what), _) => Err(JournalError::PredecessorDamaged {
            step: last.address(),
            what: what.clone(),
        }),
        (StepHealth::Pruned, _) => Err(JournalError::PredecessorDamaged {
            step: last.address(),
            what: "it was pruned".to_owned(),
        }),
        (StepHealth::Missing | StepHealth::Sound, _) => Err(JournalError::PredecessorDamaged {
            step: last.address(),
            what: "its pack is gone".to_owned(),
        }),
    }
}
