//! The table of contents of an archive.

use serde::{Deserialize, Serialize};

use crate::id::{Digest, RunName, StepIndex};

/// The first entry of an archive.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Contents {
    /// The run that was asked for.
    pub(super) root: RunName,
    /// The runs, each after the one that it takes up.
    pub(super) runs: Vec<RunContents>,
}

/// What an archive has of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct RunContents {
    /// By the name it was born with.
    pub(super) run: RunName,
    /// What people called it.
    pub(super) called: RunName,
    /// The last step that is taken along, of an ancestor; none: the run is whole.
    pub(super) through: Option<StepIndex>,
    /// Its own steps, ascending.
    pub(super) steps: Vec<StepContents>,
}

/// A step in the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StepContents {
    pub(super) step: StepIndex,
    pub(super) digest: Digest,
    /// Whether only its stub is there.
    pub(super) pruned: bool,
}

impl Contents {
    /// What speaks against the table by itself.
    pub(super) fn flaw(&self) -> Option<String> {
        let mut seen: Vec<&RunName> = Vec::new();
        for run in &self.runs {
            if seen.contains(&&run.run) {
                return Some(format!("its table names `{}` twice", run.run));
            }
            seen.push(&run.run);
            if !run.steps.is_sorted_by(|a, b| a.step < b.step) {
                return Some(format!("the steps of `{}` are out of order", run.run));
            }
        }
        (!seen.contains(&&self.root)).then(|| "its table lacks its own run".to_owned())
    }
}
