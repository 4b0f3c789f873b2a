//! The load step that a new run takes up, with all that it needs to know of the run before it.

use std::collections::BTreeMap;

use store::{Names, RunName, StepAddress, StepIndex};

use super::{
    error::RunError,
    load::{self, Steps},
    manifest::Manifest,
    open::{explain, find},
    schedule::Place,
    session,
    summary::StepSummary,
};
use crate::{
    address::{RunAddress, StepSelector},
    failure::{Failure, FailureKind},
};

/// The step that is taken up, with all that a new run needs to know of its run.
pub struct Origin {
    /// The step, as the new run's record names it.
    pub parent: StepAddress,
    /// The same as people know it.
    pub called: StepAddress,
    /// What the run is that the step is of.
    pub manifest: Manifest,
    /// Place in its programme.
    pub place: Place,
    /// Values of its loads there.
    pub loads: Vec<f64>,
    /// Where earlier changes of values came from.
    pub earlier: BTreeMap<String, String>,
}

/// The step that `at` means. Of a step before the one at which its run was taken up, the run that computed it is the
/// owner: what follows there follows from that one's input.
pub fn origin(store: &impl Steps, names: &Names, at: &RunAddress) -> Result<Origin, Failure> {
    let mut name = find(names, &at.run)?;
    let reading = |error: RunError| explain(&format!("read {at}"), error);
    let record = store.run(&name).map_err(|error| reading(error.into()))?;
    let called = record.shown();
    let step = match (at.step, record.last_step) {
        (None, _) => {
            let what = format!("failed to branch off `{called}`: the load step is missing");
            return Err(Failure::new(FailureKind::Usage, what).hint(format!(
                "name the step to go on from: `{called}@12`, `{called}@last`"
            )));
        }
        (Some(StepSelector::Last), Some(last)) => last,
        (Some(StepSelector::Index(index)), Some(last)) if index <= u64::from(last.0) => {
            StepIndex(index as u32)
        }
        (Some(selector), last) => {
            let what = format!("failed to find load step {selector} of run `{called}`");
            return Err(Failure::new(FailureKind::Usage, what).hint(match last {
                Some(last) => format!("its committed load steps are 0 to {last}"),
                None => format!("it has none yet; `femdem-flow resume {called}` computes it"),
            }));
        }
    };
    let mut lineage = record;
    while let Some(parent) = lineage.parent.clone().filter(|parent| step < parent.step) {
        name = parent.run;
        lineage = store.run(&name).map_err(|error| reading(error.into()))?;
    }
    let read = || -> Result<Origin, RunError> {
        let manifest = session::manifest(&lineage.manifest)?;
        let reader = store.step(&name, step)?;
        let summary = reader.summary()?;
        let summary: StepSummary = rmp_serde::from_slice(&summary)
            .map_err(|error| RunError::Manifest(error.to_string()))?;
        let parent = StepAddress {
            run: name.clone(),
            step,
        };
        Ok(Origin {
            place: load::place(store, &name, step)?,
            loads: summary.loads,
            earlier: earlier(store, &name)?,
            called: names.shown_address(&parent),
            parent,
            manifest,
        })
    };
    read().map_err(reading)
}

/// Where the values came from that `run` and its ancestors changed; the nearest change counts.
fn earlier(store: &impl Steps, run: &RunName) -> Result<BTreeMap<String, String>, RunError> {
    let mut places = BTreeMap::new();
    let mut next = Some(run.clone());
    while let Some(name) = next {
        let record = store.run(&name)?;
        let called = record.shown();
        let descent = session::manifest(&record.manifest)?.descent;
        for change in descent.into_iter().flat_map(|descent| descent.changes) {
            places
                .entry(change.key)
                .or_insert_with(|| format!("{} of `{called}`", change.to_place));
        }
        next = record.parent.map(|parent| parent.run);
    }
    Ok(places)
}
