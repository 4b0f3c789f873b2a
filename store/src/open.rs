//! Opening a store: lock, format, sweeping up after a crash, and making files and database agree. Where
//! they differ the files are right.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use crate::archive;
use crate::check::{Finding, Severity};
use crate::database::{Change, Contents, Database, RunRow, StepRow};
use crate::error::{IoFailure, OpenError, ReadError};
use crate::files;
use crate::format::{self, Found};
use crate::id::{RunName, StepIndex};
use crate::label::{self, NameLock};
use crate::layout::{Layout, RunFile};
use crate::lock::Lock;
use crate::run::{self, StateFile};
use crate::space;
use crate::step;
use crate::store::{Inner, StepIndexes, put_run, put_step};

pub(crate) fn open(dir: &Path) -> Result<Inner, OpenError> {
    let layout = Layout::new(dir);
    files::create_folder(dir)?;
    // Before the lock: a folder that is no store must not get one.
    format::read(&layout)?;
    let lock = Lock::take(&layout)?;
    let mut report = Vec::new();
    match format::read(&layout)? {
        Found::Known => {}
        Found::Nothing => format::write(&layout)?,
        Found::Earlier(version) => upgrade(&layout, version, &mut report)?,
    }
    files::create_folder(&layout.packs())?;
    files::create_folder(&layout.cache())?;
    files::create_folder(&layout.queue())?;

    {
        // What is being written at this moment is no leftover.
        let _naming = NameLock::take(&layout)?;
        if let Some(what) = archive::finish(&layout)? {
            report.push(repaired(&layout.packs(), what));
        }
        sweep_temporaries(&layout, &mut report)?;
    }
    let (database, contents) = open_database(&layout, &mut report)?;
    repair_runs(&layout, &contents, &mut report)?;
    let (wanted, steps) = survey(&layout, &contents.steps)?;
    report_lost_steps(&layout, &steps, &mut report);
    let database = update_database(&layout, database, &contents, wanted, &mut report);
    for (run, own) in &steps {
        let Some(last) = own.keys().next_back() else {
            continue;
        };
        if remove_parts(&layout, run, |step| step <= *last)? > 0 {
            let what = "removed journals of a step that is committed";
            report.push(repaired(&layout.run(run), what));
        }
    }
    for finding in &report {
        tracing::debug!(path = %finding.path.display(), what = finding.what, "on opening");
    }
    Ok(Inner {
        layout,
        database: Mutex::new(database),
        steps: Mutex::new(steps),
        journals: Mutex::new(BTreeSet::new()),
        cache_writer: Mutex::new(()),
        importing: Mutex::new(()),
        report,
        _lock: lock,
    })
}

/// Takes a store of an earlier format along. What format 1 lays down is the same in format 2, so that the new line in
/// `FORMAT` is the whole upgrade: it is there or it is not, whenever a crash comes.
fn upgrade(layout: &Layout, from: u64, report: &mut Vec<Finding>) -> Result<(), IoFailure> {
    format::write(layout)?;
    let what = format!(
        "the store was of format {from} and is of format {} now; all that is in it is as it was, but earlier versions \
         of femdem-flow do not open it any more",
        format::VERSION
    );
    let path = layout.format();
    report.push(Finding::new(Severity::Upgraded, &path, &what, ""));
    Ok(())
}

fn repaired(path: &Path, what: &str) -> Finding {
    Finding::new(Severity::Repaired, path, what, "")
}

/// Removes what a crash left half-written: such files never took their name.
fn sweep_temporaries(layout: &Layout, report: &mut Vec<Finding>) -> Result<(), IoFailure> {
    let mut folders = vec![layout.root().to_owned(), layout.cache()];
    folders.extend(layout.run_names()?.iter().map(|run| layout.run(run)));
    for folder in folders {
        for name in files::list(&folder)? {
            if name.ends_with(".tmp") {
                let path = folder.join(name);
                files::remove_file(&path)?;
                report.push(repaired(&path, "removed a half-written file"));
            }
        }
    }
    for dir in layout.unfinished_runs()? {
        fs::remove_dir_all(&dir).map_err(IoFailure::of("remove", &dir))?;
        report.push(repaired(&dir, "removed a half-created or half-deleted run"));
    }
    Ok(())
}

/// Opens the database; one that cannot be opened or read is removed and begun anew. `None`: there is too
/// little space to touch it, or even a new one cannot be made; the store works without.
fn open_database(
    layout: &Layout,
    report: &mut Vec<Finding>,
) -> Result<(Option<Database>, Contents), OpenError> {
    let meta = layout.meta();
    if space::free(layout)? < space::DATABASE_FLOOR {
        let remedy = "free some space and open the store again";
        let what = "the disk is too full to touch the database";
        report.push(Finding::new(Severity::Leftover, &meta, what, remedy));
        return Ok((None, Contents::default()));
    }
    let error = match Database::open(&meta) {
        Ok((database, contents)) => return Ok((Some(database), contents)),
        Err(error) => error,
    };
    report.push(repaired(
        &meta,
        &format!("the database was damaged ({error}) and is rebuilt from the packs"),
    ));
    remove_database(layout)?;
    match Database::open(&meta) {
        Ok((database, contents)) => Ok((Some(database), contents)),
        Err(error) => {
            let what = format!("no database could be made ({error}); the store works without");
            let remedy = "check the disk";
            report.push(Finding::new(Severity::Damage, &meta, &what, remedy));
            Ok((None, Contents::default()))
        }
    }
}

/// Removes the database, whatever is at its place.
pub(crate) fn remove_database(layout: &Layout) -> Result<(), IoFailure> {
    let meta = layout.meta();
    let removed = match fs::symlink_metadata(&meta) {
        Err(_) => return Ok(()),
        Ok(found) if found.is_dir() => fs::remove_dir_all(&meta),
        Ok(_) => fs::remove_file(&meta),
    };
    removed.map_err(IoFailure::of("remove", &meta))
}

/// Restores a run's records from each other, and its state from the database.
fn repair_runs(
    layout: &Layout,
    contents: &Contents,
    report: &mut Vec<Finding>,
) -> Result<(), OpenError> {
    for run in layout.run_names()? {
        match run::repair_records(layout, &run) {
            Ok(false) => {}
            Ok(true) => {
                let what = "the run's record was damaged and is restored from its copy";
                report.push(repaired(&layout.run(&run), what));
            }
            Err(error) => report.push(Finding::damage(&layout.run(&run), &error)),
        }
        repair_state(layout, &run, contents.runs.get(&run), report)?;
    }
    for run in layout.run_names()? {
        if let Err(error) = label::read(layout, &run) {
            report.push(Finding::damage(&layout.label(&run), &error));
        }
    }
    let present: BTreeSet<RunName> = layout.run_names()?.into_iter().collect();
    let known = contents.runs.keys().chain(contents.steps.keys());
    for run in known.collect::<BTreeSet<_>>() {
        if !present.contains(run) {
            let remedy = "restore it from a copy, or rebuild the database to forget it";
            let what = "the database knows this run, but its folder is gone";
            report.push(Finding::new(
                Severity::Damage,
                &layout.run(run),
                what,
                remedy,
            ));
        }
    }
    Ok(())
}

/// Restores how far a run has come, from the database where that knows it.
fn repair_state(
    layout: &Layout,
    run: &RunName,
    known: Option<&RunRow>,
    report: &mut Vec<Finding>,
) -> Result<(), IoFailure> {
    match run::read_state(layout, run) {
        // A disk that does not give it now may give it later: nothing is put in its place.
        Err(ReadError::Io(error)) if !error.is_missing() => {
            report.push(Finding::damage(&layout.state(run), &error.into()));
            return Ok(());
        }
        Err(ReadError::Damaged(_) | ReadError::Io(_)) => {}
        _ => return Ok(()),
    }
    let mut state = run::lost_state(None);
    if let Some(row) = known {
        state.state = row.state;
        state.note = row.note.clone().unwrap_or_default();
    }
    run::write_state(layout, run, &state)?;
    let what = match known {
        Some(_) => "the record of the run's state was damaged and is restored",
        None => "the record of the run's state was lost; it counts as interrupted",
    };
    report.push(repaired(&layout.state(run), what));
    Ok(())
}

/// Looks at all runs and packs: the steps there are, and what the database should say.
pub(crate) fn survey(
    layout: &Layout,
    known: &BTreeMap<RunName, BTreeMap<StepIndex, StepRow>>,
) -> Result<(Vec<Change>, StepIndexes), IoFailure> {
    let mut changes = Vec::new();
    let mut found = StepIndexes::new();
    let nothing = BTreeMap::new();
    for run in layout.run_names()? {
        let rows = known.get(&run).unwrap_or(&nothing);
        let steps = step::scan(layout, &run, |step| rows.get(&step), rows.keys().copied())?;
        changes.extend(steps.iter().filter_map(put_step));
        let own = steps.into_iter().map(|step| (step.index, step)).collect();
        if let Ok(file) = run::read(layout, &run) {
            let state: StateFile =
                run::read_state(layout, &run).unwrap_or_else(|_| run::lost_state(None));
            changes.push(put_run(&file, &state));
        }
        found.insert(run, own);
    }
    Ok((changes, found))
}

fn report_lost_steps(layout: &Layout, steps: &StepIndexes, report: &mut Vec<Finding>) {
    let lost = steps
        .values()
        .flat_map(BTreeMap::values)
        .filter(|s| s.is_lost());
    for record in lost {
        let what = match &record.health {
            step::StepHealth::Damaged(what) => what.as_str(),
            _ => "the step's pack is gone",
        };
        let remedy = "restore the pack from a copy, or set the run back to the step before";
        let path = layout.pack(&record.run, record.index);
        report.push(Finding::new(Severity::Damage, &path, what, remedy));
    }
}

/// Writes what the database does not say yet: everything after a rebuild, the last step after a crash
/// between its rename and its row, usually nothing.
fn update_database(
    layout: &Layout,
    database: Option<Database>,
    contents: &Contents,
    wanted: Vec<Change>,
    report: &mut Vec<Finding>,
) -> Option<Database> {
    let database = database?;
    let (mut missing, mut adopted) = (Vec::new(), 0);
    for change in wanted {
        let known = match &change {
            Change::PutRun(run, row) => contents.runs.get(run) == Some(row),
            Change::PutStep(run, step, row) => {
                let known = contents.steps.get(run).and_then(|own| own.get(step)) == Some(row);
                adopted += usize::from(!known);
                known
            }
            Change::DropStep(..) | Change::DropRun(_) => false,
        };
        if !known {
            missing.push(change);
        }
    }
    if adopted > 0 {
        let what = format!("took {adopted} committed step(s) into the database");
        report.push(repaired(&layout.meta(), &what));
    }
    if missing.is_empty() {
        return Some(database);
    }
    match database.apply(missing) {
        Ok(()) => Some(database),
        Err(error) => {
            let what = format!("the database cannot be written ({error}); the store works without");
            let remedy = "rebuild the database";
            report.push(Finding::new(
                Severity::Damage,
                &layout.meta(),
                &what,
                remedy,
            ));
            None
        }
    }
}

/// Removes the journals of those steps; says how many files went.
pub(crate) fn remove_parts(
    layout: &Layout,
    run: &RunName,
    which: impl Fn(StepIndex) -> bool,
) -> Result<usize, IoFailure> {
    let mut removed = 0;
    for (path, file) in layout.run_files(run)? {
        if let RunFile::Part(step, _) = file
            && which(step)
        {
            files::remove_file(&path)?;
            removed += 1;
        }
    }
    Ok(removed)
}
