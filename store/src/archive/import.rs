//! Taking an archive in.

use std::path::Path;

use super::arrival::{self, Arrival, Digests};
use super::contents::{Contents, RunContents};
use super::naming::{Given, Naming};
use super::reader::ArchiveReader;
use super::{Head, Kind};
use crate::error::{ImportError, IoFailure};
use crate::files;
use crate::id::{RunName, StepAddress};
use crate::label::{NameLock, Names};
use crate::layout::Layout;
use crate::run::{self, RunFile, StateFile};
use crate::source::Source;
use crate::space;
use crate::step::{self, StepHealth};
use crate::store::{Inner, Store, locked, put_run, put_step};

/// What came in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Imported {
    /// The run that the archive is of, by what the store calls it.
    pub root: RunName,
    /// All its runs, each after the one that it takes up.
    pub runs: Vec<ImportedRun>,
}

/// A run of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedRun {
    /// What people called it where it came from.
    pub called: RunName,
    /// What the store calls it.
    pub name: RunName,
    /// How it was taken in.
    pub taking: Taking,
    /// Its own steps in the archive.
    pub steps: usize,
}

/// How a run of an archive was taken in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taking {
    /// As a whole.
    Whole,
    /// An ancestor, up to the step that is taken up.
    Part,
    /// An ancestor whose steps the store has already: nothing was written.
    There,
}

impl Store {
    /// Takes the runs of the archive at `from` in, so that they continue, branch and read with the bits that they had. They
    /// are there when this returns `Ok`, all of them; otherwise none is, whatever crashes. An ancestor that the store has
    /// with the same steps is shared.
    ///
    /// # Errors
    /// The file is no archive or damaged; a run of the store has one of the names; the disk is too full; reading or writing
    /// fails.
    pub fn import_archive(&self, from: &Path, naming: Naming) -> Result<Imported, ImportError> {
        let _importing = locked(&self.inner.importing);
        let layout = &self.inner.layout;
        let mut archive = ArchiveReader::open(from)?;
        let free = space::free(layout)?;
        let needed = archive.left().saturating_add(space::RESERVE);
        if free < needed {
            let dir = layout.root().to_owned();
            return Err(ImportError::Full { dir, free, needed });
        }
        arrival::sweep(layout)?;
        let taken_in = take_in(&self.inner, &mut archive, naming);
        let settled = taken_in.and_then(|imported| {
            settle(layout, &imported)?;
            Ok(imported)
        });
        if settled.is_err() {
            // Best effort: opening the store removes what stays behind.
            let _ = arrival::sweep(layout);
        }
        let imported = settled?;
        self.inner.take_note(&imported)?;
        Ok(imported)
    }
}

/// Reads the archive at `from` to its end and checks its hash, without a store to take it in.
///
/// # Errors
/// The file is no archive or damaged; it cannot be read.
pub fn check_archive(from: &Path) -> Result<(), ImportError> {
    let mut archive = ArchiveReader::open(from)?;
    while archive.next()?.is_some() {}
    Ok(())
}

/// Reads the whole archive into a folder aside.
fn take_in(
    inner: &Inner,
    archive: &mut ArchiveReader,
    naming: Naming,
) -> Result<Imported, ImportError> {
    let layout = &inner.layout;
    files::create_folder(&layout.arriving())?;
    let contents = read_contents(archive)?;
    let mut given = Given::new(naming, contents.root.clone(), Names::read(layout)?);
    let mut digests = Digests::new();
    let mut waiting = contents.runs.into_iter();
    let mut present: Option<Arrival> = None;
    let mut runs = Vec::new();
    while let Some(Head { kind, run, step }) = archive.next()? {
        if kind == Kind::Record {
            close(present.take(), &digests, archive, &mut runs)?;
            let Some(contents) = waiting.next().filter(|next| next.run == run) else {
                return Err(archive.damaged(format!("`{run}` is not the run that comes next")));
            };
            let bytes = archive.content()?;
            let file: RunFile = decode(archive, &bytes)?;
            if file.name != run {
                return Err(archive.damaged(format!("it has `{}` for `{run}`", file.name)));
            }
            if contents.through.is_some() && is_there(inner, &contents, &file) {
                given.shared(&run);
                let steps = contents.steps.len();
                digests.extend(contents.steps.into_iter().map(|known| {
                    let run = run.clone();
                    let step = known.step;
                    (StepAddress { run, step }, known.digest)
                }));
                runs.push(ImportedRun {
                    called: contents.called,
                    name: run,
                    taking: Taking::There,
                    steps,
                });
                continue;
            }
            let name = given.name(&run)?;
            present = Some(Arrival::begin(
                layout, contents, file, name, &given, archive,
            )?);
            continue;
        }
        let Some(arrival) = &mut present else {
            // What belongs to a run that is here already is passed over; its bytes are hashed all the same.
            if runs.last().is_some_and(|last| last.taking == Taking::There) {
                continue;
            }
            return Err(archive.damaged("an entry belongs to no run"));
        };
        if arrival.contents.run != run {
            return Err(archive.damaged(format!("an entry of `{run}` is among others")));
        }
        match (kind, step) {
            (Kind::State, None) => {
                let bytes = archive.content()?;
                let state: StateFile = decode(archive, &bytes)?;
                arrival.state(&state)?;
            }
            (Kind::Label, None) => {
                let bytes = archive.content()?;
                let label: RunName = decode(archive, &bytes)?;
                if let Some(label) = given.label(&run, label)? {
                    arrival.label(label)?;
                }
            }
            (Kind::Events, None) => arrival.events(archive)?,
            (Kind::Pack, Some(step)) => arrival.pack(step, &mut digests, &given, archive)?,
            (Kind::Stub, Some(step)) => arrival.stub(step, &mut digests, archive)?,
            _ => return Err(archive.damaged("an entry makes no sense")),
        }
    }
    close(present, &digests, archive, &mut runs)?;
    if let Some(missing) = waiting.next() {
        return Err(archive.damaged(format!("it lacks the run `{}`", missing.run)));
    }
    files::sync_folder(&layout.arriving())?;
    let root = given.of(&contents.root).cloned();
    let root = root.ok_or_else(|| archive.damaged("it lacks its own run"))?;
    Ok(Imported { root, runs })
}

fn read_contents(archive: &mut ArchiveReader) -> Result<Contents, ImportError> {
    let first = archive.next()?;
    if first.is_none_or(|head| head.kind != Kind::Contents) {
        return Err(archive.damaged("it does not begin with its table"));
    }
    let bytes = archive.content()?;
    let contents: Contents = decode(archive, &bytes)?;
    match contents.flaw() {
        None => Ok(contents),
        Some(what) => Err(archive.damaged(what)),
    }
}

fn decode<T: serde::de::DeserializeOwned>(
    archive: &ArchiveReader,
    bytes: &[u8],
) -> Result<T, ImportError> {
    rmp_serde::from_slice(bytes)
        .map_err(|error| archive.damaged(format!("an entry does not decode ({error})")))
}

/// Ends a run's arrival.
fn close(
    arrival: Option<Arrival>,
    digests: &Digests,
    archive: &ArchiveReader,
    runs: &mut Vec<ImportedRun>,
) -> Result<(), ImportError> {
    let Some(arrival) = arrival else {
        return Ok(());
    };
    arrival.end(digests, archive)?;
    let taking = match arrival.contents.through {
        None => Taking::Whole,
        Some(_) => Taking::Part,
    };
    runs.push(ImportedRun {
        called: arrival.contents.called,
        name: arrival.name,
        taking,
        steps: arrival.steps,
    });
    Ok(())
}

/// Whether the store has the run with these very steps, the last of them readable: then nothing of it need come in.
fn is_there(inner: &Inner, contents: &RunContents, file: &RunFile) -> bool {
    let same = run::read(&inner.layout, &file.name).is_ok_and(|here| here == *file);
    let Ok(own) = inner.own_steps(&file.name) else {
        return false;
    };
    let has = |step: &super::contents::StepContents| {
        let found = own.iter().find(|here| here.index == step.step);
        found.is_some_and(|here| {
            here.digest == Some(step.digest)
                && (here.health == StepHealth::Sound
                    || (step.pruned && here.health == StepHealth::Pruned))
        })
    };
    same && contents.steps.iter().all(has)
}

/// Lets the runs be that lie aside: one rename decides, and whatever comes after it is finished by the next opening.
fn settle(layout: &Layout, imported: &Imported) -> Result<(), ImportError> {
    let _naming = NameLock::take(layout)?;
    let names = Names::read(layout)?;
    let new = imported
        .runs
        .iter()
        .filter(|run| run.taking != Taking::There);
    for run in new {
        if let Some(by) = names.resolve(&run.name) {
            let by = names.shown(&by);
            let name = run.name.clone();
            return Err(ImportError::Taken { name, by });
        }
    }
    files::rename_durably(&layout.arriving(), &layout.arrived())?;
    Ok(move_in(layout).map(drop)?)
}

/// Moves the runs that have arrived to their places; says how many there were.
fn move_in(layout: &Layout) -> Result<usize, IoFailure> {
    let arrived = layout.arrived();
    let names = files::list(&arrived)?;
    for name in &names {
        let to = layout.packs().join(name);
        files::rename_durably(&arrived.join(name), &to)?;
    }
    if arrived.exists() {
        std::fs::remove_dir(&arrived).map_err(IoFailure::of("remove", &arrived))?;
    }
    Ok(names.len())
}

/// Finishes an import that a crash cut short after it was decided, and removes what one left that was not.
pub(crate) fn finish(layout: &Layout) -> Result<Option<&'static str>, IoFailure> {
    let decided = layout.arrived().exists();
    let begun = layout.arriving().exists();
    move_in(layout)?;
    arrival::sweep(layout)?;
    Ok(match (decided, begun) {
        (true, _) => Some("finished an import that was cut short"),
        (false, true) => Some("removed a half-read import"),
        (false, false) => None,
    })
}

impl Inner {
    /// Takes note of runs whose files are in place. Nothing of it can undo the import.
    fn take_note(&self, imported: &Imported) -> Result<(), ImportError> {
        for run in &imported.runs {
            if run.taking == Taking::There {
                continue;
            }
            let own = step::scan(&self.layout, &run.name, |_| None, std::iter::empty())?;
            let file = run::read(&self.layout, &run.name)?;
            let state = run::read_state(&self.layout, &run.name)?;
            let mut changes: Vec<_> = own.iter().filter_map(put_step).collect();
            changes.push(put_run(&file, &state));
            let own = own.into_iter().map(|step| (step.index, step)).collect();
            locked(&self.steps).insert(run.name.clone(), own);
            self.record(changes);
        }
        Ok(())
    }
}
