//! The names of runs: the one that a run was born with, which its packs say in their sealed headers and its branches
//! refer to, and the label that people gave it since.
//!
//! A label is a file of its own beside the run's records, so that a run can be renamed while another process computes
//! it. Whoever gives a run a name, its first or another, holds `NAMES` for that instant.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::path::Path;

use rustix::fs::{FlockOperation, flock};
use serde::{Deserialize, Serialize};

use crate::error::{Damage, IoFailure, OpenError, ReadError, RenameError};
use crate::files;
use crate::format::{self, Found};
use crate::id::{RunName, StepAddress};
use crate::layout::Layout;
use crate::record;

/// The file's name.
pub(crate) const FILE: &str = "label.rmp";
const REMEDY: &str =
    "the run goes by the name it was born with; rename it, which writes the file anew";

/// `label.rmp`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct LabelFile {
    /// The run, by the name it was born with: a file that strayed here from another run is not believed.
    pub(crate) run: RunName,
    pub(crate) label: RunName,
}

/// The names of the runs of a store.
///
/// A run answers to its label and to the name it was born with. No other run can be given either of them, so that a
/// name never changes its meaning while the run is there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// By the name a run was born with.
    labels: BTreeMap<RunName, Option<RunName>>,
}

impl Names {
    /// The names as the files have them. A damaged label counts as none; `check` reports it.
    pub(crate) fn read(layout: &Layout) -> Result<Self, IoFailure> {
        let runs = layout.run_names()?.into_iter();
        let labels = runs.map(|run| {
            let label = read(layout, &run).unwrap_or(None);
            (run, label)
        });
        Ok(Self {
            labels: labels.collect(),
        })
    }

    /// The name that the run called `name` was born with; `None` where no run is called so.
    pub fn resolve(&self, name: &RunName) -> Option<RunName> {
        if self.labels.contains_key(name) {
            return Some(name.clone());
        }
        let labelled = self.labels.iter();
        let mut labelled = labelled.filter(|(_, label)| label.as_ref() == Some(name));
        labelled.next().map(|(run, _)| run.clone())
    }

    /// What people call the run that was born as `run`.
    pub fn shown(&self, run: &RunName) -> RunName {
        let label = self.labels.get(run).and_then(Option::as_ref);
        label.unwrap_or(run).clone()
    }

    /// The same for the run of an address.
    pub fn shown_address(&self, address: &StepAddress) -> StepAddress {
        StepAddress {
            run: self.shown(&address.run),
            step: address.step,
        }
    }

    /// What people call the runs, in the order of the names they were born with.
    pub fn all_shown(&self) -> Vec<RunName> {
        self.labels.keys().map(|run| self.shown(run)).collect()
    }

    /// [`Self::free`], which counts as taken from then on: for runs that are yet to come.
    pub fn reserve(&mut self, base: &RunName) -> RunName {
        let name = self.free(base);
        self.labels.insert(name.clone(), None);
        name
    }

    /// The first of `base`, `base-2`, `base-3`, … that no run answers to.
    pub fn free(&self, base: &RunName) -> RunName {
        let counted = (2..).map(|n| base.with_suffix(n));
        std::iter::once(base.clone())
            .chain(counted)
            .find(|name| self.resolve(name).is_none())
            .expect("a folder has fewer entries than there are numbers")
    }
}

/// The label of a run, if it has one.
pub(crate) fn read(layout: &Layout, run: &RunName) -> Result<Option<RunName>, ReadError> {
    let path = layout.label(run);
    match record::read::<LabelFile>(&path, REMEDY) {
        Ok(file) if file.run == *run => Ok(Some(file.label)),
        Ok(file) => {
            let what = format!("it is the label of `{}`", file.run);
            Err(Damage::new(&path, what, REMEDY).into())
        }
        Err(ReadError::Io(error)) if error.is_missing() => Ok(None),
        Err(error) => Err(error),
    }
}

/// The address as people know it.
pub(crate) fn shown(layout: &Layout, address: &StepAddress) -> StepAddress {
    let label = read(layout, &address.run).unwrap_or(None);
    StepAddress {
        run: label.unwrap_or_else(|| address.run.clone()),
        step: address.step,
    }
}

/// Writes the label of a run.
pub(crate) fn write(layout: &Layout, run: &RunName, label: &RunName) -> Result<(), IoFailure> {
    let file = LabelFile {
        run: run.clone(),
        label: label.clone(),
    };
    record::write(&layout.label(run), &file)
}

/// Gives the run that was born as `run` the name `label` in the store in `dir`, also while another process has the store
/// open. Its own first name takes the label away again. The run still answers to the name it was born with.
///
/// # Errors
/// Another run answers to that name; there is no such run; the store is of an earlier format and has to be opened for
/// writing first.
pub fn rename_run(dir: &Path, run: &RunName, label: &RunName) -> Result<(), RenameError> {
    let layout = Layout::new(dir);
    match format::read(&layout)? {
        Found::Known => {}
        Found::Earlier(found) => return Err(RenameError::EarlierFormat { found }),
        Found::Nothing => {
            let dir = dir.to_owned();
            return Err(OpenError::Missing { dir }.into());
        }
    }
    let _naming = NameLock::take(&layout)?;
    let names = Names::read(&layout)?;
    if !names.labels.contains_key(run) {
        return Err(ReadError::NoSuchRun(run.clone()).into());
    }
    match names.resolve(label) {
        Some(other) if other != *run => Err(RenameError::Taken {
            name: label.clone(),
            by: names.shown(&other),
        }),
        _ if label == run => {
            files::remove_file(&layout.label(run))?;
            Ok(files::sync_folder(&layout.run(run))?)
        }
        _ => Ok(write(&layout, run, label)?),
    }
}

/// Held while a name is looked for and given; closing the file gives it free.
#[derive(Debug)]
pub(crate) struct NameLock(#[expect(dead_code, reason = "only held")] File);

impl NameLock {
    /// Waits for whoever gives a name at this moment.
    pub(crate) fn take(layout: &Layout) -> Result<Self, IoFailure> {
        let path = layout.names();
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(IoFailure::of("open", &path))?;
        loop {
            match flock(&file, FlockOperation::LockExclusive) {
                Ok(()) => return Ok(Self(file)),
                Err(rustix::io::Errno::INTR) => {}
                Err(errno) => return Err(IoFailure::of("lock", &path)(errno.into())),
            }
        }
    }
}
