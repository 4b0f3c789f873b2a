//! What the runs of an archive are called in the store that takes them in.

use std::collections::BTreeMap;

use crate::error::ImportError;
use crate::id::{RunName, StepAddress};
use crate::label::Names;

/// What an imported run is to be called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Naming {
    /// What it is called in the archive. Refused where a run of the store answers to that.
    AsItIs,
    /// By this name. Other runs of the archive whose names are taken get them with `-2`, `-3`, … behind.
    Called(RunName),
}

/// The names that are given, as far as the runs have come in.
pub(super) struct Given {
    naming: Naming,
    root: RunName,
    /// Whether the name that is asked for the run of the archive is kept for it.
    kept: bool,
    taken: Names,
    /// From the archive's names to those in this store.
    names: BTreeMap<RunName, RunName>,
}

impl Given {
    pub(super) fn new(naming: Naming, root: RunName, mut taken: Names) -> Self {
        let names = BTreeMap::new();
        // Ancestors come in before the run itself; they must not be given its name.
        let kept = match &naming {
            Naming::Called(name) if taken.resolve(name).is_none() => {
                taken.reserve(name);
                true
            }
            Naming::Called(_) | Naming::AsItIs => false,
        };
        Self {
            naming,
            root,
            kept,
            taken,
            names,
        }
    }

    /// Gives the run `run` of the archive its name.
    pub(super) fn name(&mut self, run: &RunName) -> Result<RunName, ImportError> {
        let wanted = match &self.naming {
            Naming::Called(name) if *run == self.root => name,
            _ => run,
        };
        if self.kept && *run == self.root {
            let name = wanted.clone();
            self.names.insert(run.clone(), name.clone());
            return Ok(name);
        }
        let may_count = self.naming != Naming::AsItIs && *run != self.root;
        let name = match self.taken.resolve(wanted) {
            None => wanted.clone(),
            Some(_) if may_count => self.taken.free(wanted),
            Some(by) => {
                return Err(ImportError::Taken {
                    name: wanted.clone(),
                    by: self.taken.shown(&by),
                });
            }
        };
        self.taken.reserve(&name);
        self.names.insert(run.clone(), name.clone());
        Ok(name)
    }

    /// The label that the run keeps: none where it got a name of its own, or where the label is taken.
    pub(super) fn label(
        &mut self,
        run: &RunName,
        label: RunName,
    ) -> Result<Option<RunName>, ImportError> {
        if matches!(self.naming, Naming::Called(_)) && *run == self.root {
            return Ok(None);
        }
        match (self.taken.resolve(&label), &self.naming) {
            (None, _) => {
                self.taken.reserve(&label);
                Ok(Some(label))
            }
            (Some(_), Naming::Called(_)) => Ok(None),
            (Some(by), Naming::AsItIs) => Err(ImportError::Taken {
                by: self.taken.shown(&by),
                name: label,
            }),
        }
    }

    /// Says that the run is there already under its own name.
    pub(super) fn shared(&mut self, run: &RunName) {
        self.names.insert(run.clone(), run.clone());
    }

    /// The name of a run that came in.
    pub(super) fn of(&self, run: &RunName) -> Option<&RunName> {
        self.names.get(run)
    }

    /// The same for an address.
    pub(super) fn address(&self, address: &StepAddress) -> Option<StepAddress> {
        Some(StepAddress {
            run: self.of(&address.run)?.clone(),
            step: address.step,
        })
    }
}
