//! Giving space back: whole runs, and the bulk of single steps.

use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;

use crate::database::Change;
use crate::error::{Damage, DeleteError, InUse, IoFailure, PruneError, ReadError};
use crate::files;
use crate::id::{Digest, RunName, StepAddress, StepIndex};
use crate::label;
use crate::layout::Layout;
use crate::open;
use crate::record;
use crate::run;
use crate::source::Source;
use crate::step::{StepHealth, StepRecord};
use crate::store::{Store, locked, put_step};

const STUB_REMEDY: &str = "nothing needs it but lists: restore it from a copy, or leave it";

/// `<step>.pruned`: what remains of a step whose pack was removed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stub {
    pub(crate) run: RunName,
    pub(crate) step: StepIndex,
    pub(crate) digest: Digest,
    pub(crate) summary: ByteBuf,
}

/// The stub of a step, if there is one.
pub(crate) fn read(layout: &Layout, address: &StepAddress) -> Result<Option<Stub>, ReadError> {
    let path = layout.stub(&address.run, address.step);
    match record::read::<Stub>(&path, STUB_REMEDY) {
        Ok(stub) if stub.run == address.run && stub.step == address.step => Ok(Some(stub)),
        Ok(stub) => {
            let what = format!("it is the stub of {}@{}", stub.run, stub.step);
            Err(Damage::new(&path, what, STUB_REMEDY).into())
        }
        Err(ReadError::Io(error)) if error.is_missing() => Ok(None),
        Err(error) => Err(error),
    }
}

impl Store {
    /// The own steps of `run` whose packs can go where only those are wanted that `keep` says: all others but the first
    /// and the last one, and those from which other runs take it up. What is kept can be continued from.
    pub fn prunable(
        &self,
        run: &RunName,
        keep: impl Fn(StepIndex) -> bool,
    ) -> Result<Vec<StepRecord>, PruneError> {
        // That there is such a run is part of the answer.
        run::read(&self.inner.layout, run)?;
        let own = self.inner.own_steps(run)?;
        let mut needed = Vec::new();
        for (_, parent) in self.children(run)? {
            needed.push(parent);
        }
        let ends = [own.first(), own.last()].map(|step| step.map(|step| step.index));
        let prunable = own.into_iter().filter(|step| {
            step.health == StepHealth::Sound
                && !ends.contains(&Some(step.index))
                && !needed.contains(&step.index)
                && !keep(step.index)
        });
        Ok(prunable.collect())
    }

    /// Removes the packs of [`Self::prunable`]; digest and summary of each step remain. Returns the steps that went, as
    /// they were before.
    pub fn prune(
        &self,
        run: &RunName,
        keep: impl Fn(StepIndex) -> bool,
    ) -> Result<Vec<StepRecord>, PruneError> {
        self.refuse_while_computed(run)?;
        let prunable = self.prunable(run, keep)?;
        let layout = &self.inner.layout;
        for step in &prunable {
            let Some(digest) = step.digest else { continue };
            let stub = Stub {
                run: run.clone(),
                step: step.index,
                digest,
                summary: ByteBuf::from(step.summary.clone()),
            };
            // First the stub, then the pack: a crash in between leaves both, and the pack counts.
            record::write(&layout.stub(run, step.index), &stub)?;
            files::remove_file(&layout.pack(run, step.index))?;
            let left = StepRecord {
                bytes: 0,
                health: StepHealth::Pruned,
                ..step.clone()
            };
            self.inner.record(put_step(&left).into_iter().collect());
            if let Some(own) = locked(&self.inner.steps).get_mut(run) {
                own.insert(step.index, left);
            }
        }
        if !prunable.is_empty() {
            files::sync_folder(&layout.run(run))?;
        }
        Ok(prunable)
    }

    /// Deletes a run and all that is its own. Refused where another run takes it up. Returns the bytes that are free
    /// again.
    pub fn delete_run(&self, run: &RunName) -> Result<u64, DeleteError> {
        self.refuse_while_computed(run)?;
        let layout = &self.inner.layout;
        let dir = layout.run(run);
        if !dir.is_dir() {
            return Err(ReadError::NoSuchRun(run.clone()).into());
        }
        if let Some(branch) = self.taken_up(run, StepIndex(0))? {
            return Err(branch.into());
        }
        // What would call the run missing forgets it first: a crash before the rename leaves the whole run.
        let own = self.inner.own_steps(run)?;
        let mut drops: Vec<Change> = own
            .iter()
            .map(|step| Change::DropStep(run.clone(), step.index))
            .collect();
        drops.push(Change::DropRun(run.clone()));
        self.inner.record(drops);
        if locked(&self.inner.database).is_none() {
            open::remove_database(layout)?;
        }
        let bytes = files::bytes_below(&dir);
        let gone = layout.gone_run(run);
        files::rename_durably(&dir, &gone)?;
        locked(&self.inner.steps).remove(run);
        std::fs::remove_dir_all(&gone).map_err(IoFailure::of("remove", &gone))?;
        Ok(bytes)
    }

    /// Refuses where a step of `run` is being computed.
    pub(crate) fn refuse_while_computed(&self, run: &RunName) -> Result<(), InUse> {
        if !locked(&self.inner.journals).contains(run) {
            return Ok(());
        }
        let label = label::read(&self.inner.layout, run).unwrap_or(None);
        Err(InUse::Journal(label.unwrap_or_else(|| run.clone())))
    }

    /// A run that takes up `run` at `step` or later, if there is one.
    pub(crate) fn taken_up(
        &self,
        run: &RunName,
        step: StepIndex,
    ) -> Result<Option<InUse>, ReadError> {
        let children = self.children(run)?;
        let Some((child, at)) = children.into_iter().find(|(_, at)| *at >= step) else {
            return Ok(None);
        };
        let names = self.names()?;
        let parent = StepAddress {
            run: names.shown(run),
            step: at,
        };
        let child = names.shown(&child);
        Ok(Some(InUse::Branch { child, parent }))
    }

    /// The runs that take up a step of `run`, each with the step. One whose record cannot be read is an error: it might
    /// be one of them.
    fn children(&self, run: &RunName) -> Result<Vec<(RunName, StepIndex)>, ReadError> {
        let mut children = Vec::new();
        for name in self.run_names()? {
            let parent = run::read(&self.inner.layout, &name)?.parent;
            if let Some(parent) = parent.filter(|parent| parent.run == *run) {
                children.push((name, parent.step));
            }
        }
        Ok(children)
    }
}
