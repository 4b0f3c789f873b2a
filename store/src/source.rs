//! Reading runs and chains of steps, the same for the owner of a store and for onlookers.

use std::collections::BTreeSet;

use crate::error::{Damage, ReadError};
use crate::id::{RunName, StepAddress, StepIndex};
use crate::label;
use crate::layout::Layout;
use crate::run::{self, RunRecord};
use crate::step::{StepHealth, StepReader, StepRecord};

/// Where the steps that a run committed itself come from: the owner's memory, or the files.
pub(crate) trait Source {
    fn layout(&self) -> &Layout;
    /// The run's own steps, ascending.
    fn own_steps(&self, run: &RunName) -> Result<Vec<StepRecord>, ReadError>;

    /// The record of a run.
    fn run(&self, name: &RunName) -> Result<RunRecord, ReadError> {
        let file = run::read(self.layout(), name)?;
        let last_own = self.own_steps(name)?.last().map(|step| step.index);
        let state =
            run::read_state(self.layout(), name).unwrap_or_else(|_| run::lost_state(last_own));
        let last_step = last_own.or(file.parent.as_ref().map(|parent| parent.step));
        Ok(RunRecord {
            label: label::read(self.layout(), name).unwrap_or(None),
            name: file.name,
            created: file.created,
            parent: file.parent,
            manifest: file.manifest,
            state: state.state,
            note: state.note,
            last_step,
        })
    }

    /// All runs in the order of their names; the first unreadable one is the error.
    fn runs(&self) -> Result<Vec<RunRecord>, ReadError> {
        let names = self.layout().run_names()?;
        names.iter().map(|name| self.run(name)).collect()
    }

    /// The steps of a run and, up to where it branches off, of its ancestors; ascending.
    fn steps(&self, name: &RunName) -> Result<Vec<StepRecord>, ReadError> {
        let mut parts = Vec::new();
        let mut seen = BTreeSet::new();
        let mut next = Some((name.clone(), StepIndex(u32::MAX)));
        while let Some((run, until)) = next {
            let file = run::read(self.layout(), &run)?;
            if !seen.insert(run.clone()) {
                let dir = self.layout().run(&run);
                let remedy = "restore the `run.rmp` of the runs involved from copies";
                return Err(Damage::new(&dir, "the run is its own ancestor", remedy).into());
            }
            let mut own = self.own_steps(&run)?;
            own.retain(|step| step.index <= until);
            parts.push(own);
            next = file
                .parent
                .map(|parent| (parent.run, parent.step.min(until)));
        }
        Ok(parts.into_iter().rev().flatten().collect())
    }

    /// Opens one step of a run or its ancestors.
    fn step(&self, name: &RunName, step: StepIndex) -> Result<StepReader, ReadError> {
        let steps = self.steps(name)?;
        let wanted = StepAddress {
            run: name.clone(),
            step,
        };
        let record = steps
            .iter()
            .find(|record| record.index == step)
            .ok_or_else(|| ReadError::NoSuchStep(label::shown(self.layout(), &wanted)))?;
        let path = self.layout().pack(&record.run, step);
        let missing = || ReadError::PackMissing {
            step: label::shown(self.layout(), &record.address()),
            path: path.clone(),
        };
        match record.health {
            StepHealth::Missing => return Err(missing()),
            StepHealth::Pruned => {
                let step = label::shown(self.layout(), &record.address());
                return Err(ReadError::Pruned(step));
            }
            StepHealth::Sound | StepHealth::Damaged(_) => {}
        }
        match StepReader::open(&path, &record.address()) {
            Err(ReadError::Io(error)) if error.is_missing() => Err(missing()),
            other => other,
        }
    }
}
