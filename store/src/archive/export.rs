//! Writing a run, and what it stands on, into an archive.

use std::collections::BTreeMap;
use std::path::Path;

use super::contents::{Contents, RunContents, StepContents};
use super::writer::ArchiveWriter;
use super::{Head, Kind};
use crate::error::{ArchiveError, ReadError};
use crate::id::{RunName, StepAddress, StepIndex};
use crate::label;
use crate::layout::Layout;
use crate::read_only::ReadOnlyStore;
use crate::record;
use crate::run::{self, RunFile, RunState, StateFile};
use crate::source::Source;
use crate::step::{StepHealth, StepReader, StepRecord};

/// How much goes into an archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The run, with the steps of its ancestors that it takes up.
    Run,
    /// That, and all runs that take it up, directly or not.
    Subtree,
}

/// What an archive was made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// The runs that are whole in it, as people call them.
    pub runs: Vec<RunName>,
    /// The ancestors of which it has the steps up to the one that is taken up.
    pub ancestors: Vec<StepAddress>,
    /// Steps, pruned ones included.
    pub steps: usize,
    /// Bytes of the archive.
    pub bytes: u64,
}

/// A run on its way into the archive.
struct Packed {
    file: RunFile,
    called: RunName,
    through: Option<StepIndex>,
    steps: Vec<StepRecord>,
}

impl ReadOnlyStore {
    /// Writes `run` into the new file `to`: its records, its event log and all its steps, every byte of them checked on the
    /// way, and what it needs of its ancestors. The journal of a step in progress is not taken along.
    ///
    /// # Errors
    /// A step is damaged or missing; the file exists already; reading or writing fails. Then there is no file.
    pub fn export_archive(
        &self,
        run: &RunName,
        extent: Extent,
        to: &Path,
    ) -> Result<Exported, ArchiveError> {
        if to.exists() {
            let path = to.to_owned();
            return Err(ArchiveError::Exists { path });
        }
        let mut packed = ancestors(self, run)?;
        packed.push(pack_up(self, run, None)?);
        if extent == Extent::Subtree {
            descendants(self, run, &mut packed)?;
        }
        let contents = contents(self.layout(), run, &packed)?;
        let mut writer = ArchiveWriter::create(to)?;
        let head = |kind, run: &RunName, step| Head {
            kind,
            run: run.clone(),
            step,
        };
        let table = record::to_rmp(&contents);
        writer.entry(&head(Kind::Contents, run, None), &table)?;
        for packed in &packed {
            self.write_run(packed, &mut writer)?;
        }
        let bytes = writer.finish()?;
        let whole = packed.iter().filter(|packed| packed.through.is_none());
        let cut = packed.iter().filter_map(|packed| {
            Some(StepAddress {
                run: packed.called.clone(),
                step: packed.through?,
            })
        });
        Ok(Exported {
            runs: whole.map(|packed| packed.called.clone()).collect(),
            ancestors: cut.collect(),
            steps: packed.iter().map(|packed| packed.steps.len()).sum(),
            bytes,
        })
    }

    fn write_run(&self, packed: &Packed, writer: &mut ArchiveWriter) -> Result<(), ArchiveError> {
        let layout = self.layout();
        let name = &packed.file.name;
        let head = |kind, step| Head {
            kind,
            run: name.clone(),
            step,
        };
        writer.entry(&head(Kind::Record, None), &record::to_rmp(&packed.file))?;
        let state = state(layout, packed);
        writer.entry(&head(Kind::State, None), &record::to_rmp(&state))?;
        if packed.called != *name {
            writer.entry(&head(Kind::Label, None), &record::to_rmp(&packed.called))?;
        }
        // The log of an ancestor tells of steps that are not taken along.
        let events = layout.events(name);
        if packed.through.is_none() && events.exists() {
            writer.entry_of_file(&head(Kind::Events, None), &events)?;
        }
        for step in &packed.steps {
            let pruned = step.health == StepHealth::Pruned;
            let (kind, path) = match pruned {
                true => (Kind::Stub, layout.stub(name, step.index)),
                false => (Kind::Pack, layout.pack(name, step.index)),
            };
            if !pruned {
                StepReader::open(&path, &step.address())?.verify()?;
            }
            writer.entry_of_file(&head(kind, Some(step.index)), &path)?;
        }
        Ok(())
    }
}

/// What the archive says of how far the run has come. A process that computes it now is of no meaning elsewhere.
fn state(layout: &Layout, packed: &Packed) -> StateFile {
    let last_own = packed.steps.last().map(|step| step.index);
    let known = run::read_state(layout, &packed.file.name);
    let mut state = known.unwrap_or_else(|_| run::lost_state(None));
    state.last_own = last_own;
    if let Some(through) = packed.through {
        state.state = RunState::Interrupted;
        state.note = format!("an archive brought its load steps up to {through}");
    } else if state.state == RunState::Running {
        state.state = RunState::Interrupted;
        state.note = "it was being computed when its archive was written".to_owned();
    }
    state
}

/// The ancestors of `run`, the oldest first, as far as it takes them up.
fn ancestors(source: &ReadOnlyStore, run: &RunName) -> Result<Vec<Packed>, ReadError> {
    // Going through all steps finds a run that is its own ancestor.
    Source::steps(source, run)?;
    let mut ancestors = Vec::new();
    let mut next = run::read(source.layout(), run)?.parent;
    while let Some(parent) = next {
        let packed = pack_up(source, &parent.run, Some(parent.step))?;
        next = packed.file.parent.clone().map(|grand| StepAddress {
            step: grand.step.min(parent.step),
            ..grand
        });
        ancestors.push(packed);
    }
    ancestors.reverse();
    Ok(ancestors)
}

/// The runs that take up `root`, directly or not, each after its parent.
fn descendants(
    source: &ReadOnlyStore,
    root: &RunName,
    packed: &mut Vec<Packed>,
) -> Result<(), ReadError> {
    let mut children: BTreeMap<RunName, Vec<RunName>> = BTreeMap::new();
    for name in source.layout().run_names()? {
        if let Some(parent) = run::read(source.layout(), &name)?.parent {
            children.entry(parent.run).or_default().push(name);
        }
    }
    let mut parents = vec![root.clone()];
    while let Some(parent) = parents.pop() {
        // Taken out: runs that are each other's ancestors come to an end.
        for child in children.remove(&parent).unwrap_or_default() {
            packed.push(pack_up(source, &child, None)?);
            parents.push(child);
        }
    }
    Ok(())
}

fn pack_up(
    source: &ReadOnlyStore,
    run: &RunName,
    through: Option<StepIndex>,
) -> Result<Packed, ReadError> {
    let file = run::read(source.layout(), run)?;
    let label = label::read(source.layout(), run).unwrap_or(None);
    let mut steps = source.own_steps(run)?;
    steps.retain(|step| through.is_none_or(|through| step.index <= through));
    Ok(Packed {
        called: label.unwrap_or_else(|| file.name.clone()),
        file,
        through,
        steps,
    })
}

/// The table of contents; a step that is lost is an error.
fn contents(layout: &Layout, root: &RunName, packed: &[Packed]) -> Result<Contents, ArchiveError> {
    let mut runs = Vec::new();
    for packed in packed {
        let mut steps = Vec::new();
        for step in &packed.steps {
            let (Some(digest), false) = (step.digest, step.is_lost()) else {
                let what = match &step.health {
                    StepHealth::Damaged(what) => what.clone(),
                    _ => "its pack is gone".to_owned(),
                };
                let step = label::shown(layout, &step.address());
                return Err(ArchiveError::Lost { step, what });
            };
            let pruned = step.health == StepHealth::Pruned;
            let step = step.index;
            steps.push(StepContents {
                step,
                digest,
                pruned,
            });
        }
        runs.push(RunContents {
            run: packed.file.name.clone(),
            called: packed.called.clone(),
            through: packed.through,
            steps,
        });
    }
    Ok(Contents {
        root: root.clone(),
        runs,
    })
}
