//! Which file lies where in a store's folder.

use std::path::{Path, PathBuf};

use crate::error::IoFailure;
use crate::files;
use crate::id::{Digest, RunName, StepIndex, WaveIndex};
use crate::label;

/// Begins the name of a run's folder while it is being made; no run name begins so.
const NEW_RUN: &str = ".new-";
/// Begins the name of a run's folder while it is being deleted.
const GONE_RUN: &str = ".gone-";
/// Runs that are read from an archive.
const ARRIVING: &str = ".import-new";
/// Runs of an archive that is read and checked, on their way to their places.
const ARRIVED: &str = ".import-done";
/// Record of how far a run has come.
pub(crate) const STATE: &str = "state.rmp";
/// The caller's event log.
pub(crate) const EVENTS: &str = "events.jsonl";
/// Ends the name of a pack that was set aside.
const ASIDE: &str = ".aside";

/// A store's folder.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    root: PathBuf,
}

/// What a file in a run's folder is, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum RunFile {
    Pack(StepIndex),
    Stub(StepIndex),
    Part(StepIndex, WaveIndex),
    Temporary,
    SetAside,
    Other,
}

impl Layout {
    pub(crate) fn new(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    pub(crate) fn lock(&self) -> PathBuf {
        self.root.join("LOCK")
    }

    pub(crate) fn format(&self) -> PathBuf {
        self.root.join("FORMAT")
    }

    pub(crate) fn meta(&self) -> PathBuf {
        self.root.join("meta")
    }

    pub(crate) fn packs(&self) -> PathBuf {
        self.root.join("packs")
    }

    pub(crate) fn cache(&self) -> PathBuf {
        self.root.join("cache")
    }

    /// Work that waits for the owner of the store.
    pub(crate) fn queue(&self) -> PathBuf {
        self.root.join("queue")
    }

    /// Locked by who gives a run its name, so that no two runs get the same one.
    pub(crate) fn names(&self) -> PathBuf {
        self.root.join("NAMES")
    }

    pub(crate) fn run(&self, run: &RunName) -> PathBuf {
        self.packs().join(run.as_str())
    }

    pub(crate) fn new_run(&self, run: &RunName) -> PathBuf {
        self.packs().join(format!("{NEW_RUN}{run}"))
    }

    pub(crate) fn gone_run(&self, run: &RunName) -> PathBuf {
        self.packs().join(format!("{GONE_RUN}{run}"))
    }

    pub(crate) fn arriving(&self) -> PathBuf {
        self.packs().join(ARRIVING)
    }

    pub(crate) fn arrived(&self) -> PathBuf {
        self.packs().join(ARRIVED)
    }

    pub(crate) fn state(&self, run: &RunName) -> PathBuf {
        self.run(run).join(STATE)
    }

    pub(crate) fn label(&self, run: &RunName) -> PathBuf {
        self.run(run).join(label::FILE)
    }

    pub(crate) fn events(&self, run: &RunName) -> PathBuf {
        self.run(run).join(EVENTS)
    }

    pub(crate) fn pack(&self, run: &RunName, step: StepIndex) -> PathBuf {
        self.run(run).join(pack_name(step))
    }

    pub(crate) fn stub(&self, run: &RunName, step: StepIndex) -> PathBuf {
        self.run(run).join(stub_name(step))
    }

    pub(crate) fn part(&self, run: &RunName, step: StepIndex, wave: WaveIndex) -> PathBuf {
        self.run(run).join(part_name(step, wave))
    }

    pub(crate) fn cache_entry(&self, key: &Digest) -> PathBuf {
        self.cache().join(format!("{key}.pack"))
    }

    /// The runs' names, in order, by their folders.
    pub(crate) fn run_names(&self) -> Result<Vec<RunName>, IoFailure> {
        let names = files::list(&self.packs())?;
        Ok(names
            .into_iter()
            .filter_map(|n| RunName::new(n).ok())
            .collect())
    }

    /// The folders of runs that were never finished being created, or being deleted.
    pub(crate) fn unfinished_runs(&self) -> Result<Vec<PathBuf>, IoFailure> {
        let names = files::list(&self.packs())?;
        Ok(names
            .iter()
            .filter(|n| n.starts_with(NEW_RUN) || n.starts_with(GONE_RUN) || *n == ARRIVING)
            .map(|n| self.packs().join(n))
            .collect())
    }

    /// The files of a run with their meaning, in the order of their names.
    pub(crate) fn run_files(&self, run: &RunName) -> Result<Vec<(PathBuf, RunFile)>, IoFailure> {
        let dir = self.run(run);
        let names = files::list(&dir)?;
        Ok(names
            .into_iter()
            .map(|n| (dir.join(&n), classify(&n)))
            .collect())
    }

    /// The steps of which the run's folder has a pack or the stub of one, ascending.
    pub(crate) fn pack_steps(&self, run: &RunName) -> Result<Vec<StepIndex>, IoFailure> {
        let mut steps: Vec<_> = self
            .run_files(run)?
            .into_iter()
            .filter_map(|(_, file)| match file {
                RunFile::Pack(step) | RunFile::Stub(step) => Some(step),
                _ => None,
            })
            .collect();
        steps.sort();
        steps.dedup();
        Ok(steps)
    }

    /// The journalled waves of a step, ascending.
    pub(crate) fn waves(
        &self,
        run: &RunName,
        step: StepIndex,
    ) -> Result<Vec<WaveIndex>, IoFailure> {
        let mut waves: Vec<_> = self
            .run_files(run)?
            .into_iter()
            .filter_map(|(_, file)| match file {
                RunFile::Part(of, wave) if of == step => Some(wave),
                _ => None,
            })
            .collect();
        waves.sort();
        Ok(waves)
    }
}

/// Where a pack goes when its run is set back to before it.
pub(crate) fn aside(pack: &Path) -> PathBuf {
    let mut name = pack.as_os_str().to_owned();
    name.push(ASIDE);
    PathBuf::from(name)
}

pub(crate) fn pack_name(step: StepIndex) -> String {
    format!("{:08}.pack", step.0)
}

pub(crate) fn stub_name(step: StepIndex) -> String {
    format!("{:08}.pruned", step.0)
}

fn part_name(step: StepIndex, wave: WaveIndex) -> String {
    format!("{:08}.wave{:06}.part", step.0, wave.0)
}

fn classify(name: &str) -> RunFile {
    if name.ends_with(".tmp") {
        return RunFile::Temporary;
    }
    if name.ends_with(ASIDE) {
        return RunFile::SetAside;
    }
    if let Some(step) = name.strip_suffix(".pack").and_then(|n| n.parse().ok()) {
        let step = StepIndex(step);
        if pack_name(step) == name {
            return RunFile::Pack(step);
        }
    }
    if let Some(step) = name.strip_suffix(".pruned").and_then(|n| n.parse().ok()) {
        let step = StepIndex(step);
        if stub_name(step) == name {
            return RunFile::Stub(step);
        }
    }
    let part = name
        .strip_suffix(".part")
        .and_then(|n| n.split_once(".wave"));
    if let Some((Ok(step), Ok(wave))) = part.map(|(s, w)| (s.parse(), w.parse())) {
        let (step, wave) = (StepIndex(step), WaveIndex(wave));
        if part_name(step, wave) == name {
            return RunFile::Part(step, wave);
        }
    }
    RunFile::Other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_canonical_spelling_of_a_name_is_a_pack() {
        assert_eq!(classify("00000012.pack"), RunFile::Pack(StepIndex(12)));
        assert_eq!(classify("12.pack"), RunFile::Other);
        assert_eq!(classify("00000012.pruned"), RunFile::Stub(StepIndex(12)));
        assert_eq!(classify("12.pruned"), RunFile::Other);
        assert_eq!(classify("+0000012.pack"), RunFile::Other);
        let part = RunFile::Part(StepIndex(3), WaveIndex(1_234_567));
        assert_eq!(classify("00000003.wave1234567.part"), part);
        assert_eq!(classify("00000012.pack.tmp"), RunFile::Temporary);
        assert_eq!(classify("00000012.pack.aside"), RunFile::SetAside);
    }
}
