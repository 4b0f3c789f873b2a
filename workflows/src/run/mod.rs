//! What the verbs of the command line do: runs over the engine, the store and the solvers.

mod attempt;
mod body;
mod campaign;
mod core;
mod element_test;
mod error;
mod frames;
mod load;
mod manifest;
mod model;
mod open;
mod packings;
mod point;
mod schedule;
mod session;
mod show;
mod summary;
mod work;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use store::Store;

use self::open::{explain, open, open_existing, store_name};
use crate::address::{RevAddress, RunAddress, RunName};
use crate::failure::{Failure, FailureKind};
use crate::input::Problem;
use crate::progress::Progress;
use crate::report::Report;

/// Where and how a verb works.
pub struct Context<'a> {
    /// Folder of the store.
    pub store: PathBuf,
    /// Worker threads; as many as there are cores where it is not given. Results do not depend on it.
    pub threads: Option<NonZeroUsize>,
    /// Who is told about the progress.
    pub progress: &'a dyn Progress,
}

/// How thoroughly a store is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckDepth {
    /// Files, sizes, index.
    Quick,
    /// Every byte of every pack against its digest.
    Full,
}

fn not_available(what: &str) -> Result<Report, Failure> {
    Err(Failure::new(
        FailureKind::Run,
        format!("failed to {what}: not available yet"),
    ))
}

/// Computes `problem` as a new run, named `name` or as the input wishes.
pub fn submit(
    context: &Context<'_>,
    problem: Problem,
    name: Option<RunName>,
) -> Result<Report, Failure> {
    let name = store_name(name.as_ref().unwrap_or(&problem.name))?;
    let store = open(context)?;
    let threads = context.threads();
    let run = session::create(&store, name, problem.clone(), threads)
        .map_err(|error| explain("create the run", error))?;
    go(context, &store, &run, &problem)
}

/// Continues a run where it stopped.
pub fn resume(context: &Context<'_>, run: &RunName) -> Result<Report, Failure> {
    let name = store_name(run)?;
    let store = open_existing(context)?;
    let record = store.run(&name).map_err(|error| explain("find the run", error.into()))?;
    let manifest = session::manifest(&record.manifest).map_err(|error| explain("resume the run", error))?;
    go(context, &store, &name, &manifest.problem)
}

fn go(
    context: &Context<'_>,
    store: &Store,
    run: &store::RunName,
    problem: &Problem,
) -> Result<Report, Failure> {
    let end = session::advance(store, run, problem, context.threads(), context.progress)
        .map_err(|error| explain(&format!("compute run `{run}`"), error))?;
    show::ended(context, store, run, &end)
}

impl Context<'_> {
    /// Worker threads: as asked for, or one a core.
    fn threads(&self) -> NonZeroUsize {
        self.threads.unwrap_or_else(|| {
            std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
        })
    }
}

/// Lists the runs of the store.
pub fn runs(_context: &Context<'_>) -> Result<Report, Failure> {
    not_available("list the runs")
}

/// Reports on a run, or on one of its steps.
pub fn show(_context: &Context<'_>, _address: &RunAddress) -> Result<Report, Failure> {
    not_available("show the run")
}

/// Reports where a running run is, or all of them, without opening the database.
pub fn status(_context: &Context<'_>, _run: Option<&RunName>) -> Result<Report, Failure> {
    not_available("report the status")
}

/// Writes the outputs of a run into the folder `into`, by default one named after the run.
pub fn export(
    _context: &Context<'_>,
    _run: &RunName,
    _into: Option<&Path>,
) -> Result<Report, Failure> {
    not_available("export the run")
}

/// Prepares the packings of the materials of `problem` into the store, or those of `material` only.
pub fn rev_prepare(
    _context: &Context<'_>,
    _problem: &Problem,
    _material: Option<&str>,
) -> Result<Report, Failure> {
    not_available("prepare the packings")
}

/// Runs the element test of `problem` and reports its curve, without a run in the store.
pub fn rev_test(_context: &Context<'_>, _problem: &Problem) -> Result<Report, Failure> {
    not_available("run the element test")
}

/// Reads a packing of another program, brings it to equilibrium and reports its quality.
pub fn rev_import(_context: &Context<'_>, _packing: &Path) -> Result<Report, Failure> {
    not_available("import the packing")
}

/// Writes the packing of one REV of a committed step to the file `into`.
pub fn rev_export(
    _context: &Context<'_>,
    _rev: &RevAddress,
    _into: &Path,
) -> Result<Report, Failure> {
    not_available("export the packing")
}

/// Reports on the store.
pub fn store_info(_context: &Context<'_>) -> Result<Report, Failure> {
    not_available("describe the store")
}

/// Checks the store.
pub fn store_check(_context: &Context<'_>, _depth: CheckDepth) -> Result<Report, Failure> {
    not_available("check the store")
}

/// Builds the database of the store anew from its packs.
pub fn store_rebuild(_context: &Context<'_>) -> Result<Report, Failure> {
    not_available("rebuild the store")
}
