//! What the verbs of the command line do: runs over the engine, the store and the solvers.

mod ahead;
mod archive;
mod asked;
mod attempt;
mod body;
mod branch;
mod campaign;
mod compute;
mod control;
mod core;
mod diff;
mod draw;
mod element_test;
mod ended;
mod error;
mod event_log;
mod events;
mod export;
mod failed_task;
mod forecast;
mod frames;
mod internal_length;
mod keeping;
mod lineage;
mod list;
mod load;
mod manifest;
mod model;
mod notes;
mod open;
mod origin;
mod packings;
mod place;
mod plan;
mod plot;
mod point;
mod preparing;
mod queue;
mod recorded;
mod relaw;
mod rename;
mod replay;
mod rev_exchange;
mod rev_of_step;
mod rev_prepare;
mod rev_show;
mod rev_test;
mod schedule;
mod session;
mod shift;
mod show;
mod show_revs;
mod show_step;
mod status;
mod store_verbs;
mod summary;
mod supervision;
#[cfg(test)]
mod task_policy;
mod test_picture;
pub(crate) mod text;
mod triggers;
mod verify;
mod view;
mod watch;
mod work;

/// What the frames of a step are made of, for measurements of the store.
pub(crate) mod step_frames {
    pub use super::asked::AskedWave;
    pub use super::frames::{MACRO, POINT, answer_frame, content, point_frame};
    pub use super::point::{PointAnswer, PointEnd, PointState, with_state};
}

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use store::Extent as ArchiveExtent;
use store::Store;

pub use self::branch::{Computing, Wish};
pub use self::control::{Extent, Signals, Urgency};
pub use self::keeping::{Doing, Keep};
use self::open::explain;
pub use self::plan::Intent;
pub use self::plot::{
    ColourRange, CurveAxes, MapStyle, Quantity, Spread, Window, curve as plot_curve,
    map as plot_map,
};
pub use self::rev_show::RevSource;
pub use self::rev_test::Extras as RevTestExtras;
pub use self::shift::{Sharing, Terms};
pub use self::show_revs::show_revs;
pub use self::supervision::{Restart, Supervision, note_restart};
pub use self::verify::Sample;
use crate::address::{RevAddress, RunAddress, RunName};
use crate::failure::Failure;
use crate::input::{Problem, derive::Scope};
use crate::plot::PictureFile;
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
    /// What a supervisor of this process told it; `None` where nobody supervises it.
    pub supervision: Option<&'a Supervision>,
}

/// How thoroughly a store is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckDepth {
    /// Files, sizes, index.
    Quick,
    /// Every byte of every pack against its digest.
    Deep,
}

/// Computes `problem` as a new run, named `name` or as the input wishes; queues it where the store is in use.
pub fn submit(
    context: &Context<'_>,
    problem: Problem,
    name: Option<RunName>,
    terms: &Terms,
) -> Result<Report, Failure> {
    compute::submit(context, problem, name, terms)
}

/// Continues a run where it stopped; queues that where the store is in use. A run that is complete is left as it is; one
/// that failed tries its step again.
pub fn resume(context: &Context<'_>, run: &RunName, terms: &Terms) -> Result<Report, Failure> {
    compute::resume(context, run, terms)
}

/// What became of the work that an earlier life of a supervised command began; `None` where it has not begun.
pub fn again(context: &Context<'_>, terms: &Terms) -> Option<Result<Report, Failure>> {
    compute::again(context, terms)
}

/// Lists what is queued.
pub fn queue_list(context: &Context<'_>) -> Result<Report, Failure> {
    queue::list(context)
}

/// Takes entries of the queue back, by their numbers or runs.
pub fn queue_remove(context: &Context<'_>, which: &[String]) -> Result<Report, Failure> {
    queue::remove(context, which)
}

/// Computes what is queued.
pub fn queue_run(context: &Context<'_>, terms: &Terms) -> Result<Report, Failure> {
    compute::queue_run(context, terms)
}

/// Follows a run live, until its session ends; `tell` gets each event of its log as a line of JSON.
pub fn watch(
    context: &Context<'_>,
    run: Option<&RunName>,
    tell: &mut dyn FnMut(&str),
) -> Result<Report, Failure> {
    watch::watch(context, run, &mut |event| {
        if let Ok(line) = serde_json::to_string(event) {
            tell(&line);
        }
    })
}

/// Makes the runs that take up a load step as `wish` says, and computes them.
pub fn derive(
    context: &Context<'_>,
    wish: &Wish,
    scope: Scope,
    terms: &Terms,
) -> Result<Report, Failure> {
    branch::derive(context, wish, scope, terms)
}

/// Asks the process that computes `run` to stop it, and waits for `patience` until it has.
pub fn cancel(
    context: &Context<'_>,
    run: &RunName,
    urgency: Urgency,
    extent: Extent,
    patience: Duration,
) -> Result<Report, Failure> {
    control::cancel(context, run, urgency, extent, patience)
}

/// Asks the process that computes `run` to start nothing new, and waits for `patience` until nothing runs.
pub fn pause(context: &Context<'_>, run: &RunName, patience: Duration) -> Result<Report, Failure> {
    control::pause(context, run, patience)
}

/// Asks the process that computes `run` to go on after a pause, and waits for `patience` until it does.
pub fn go_on(context: &Context<'_>, run: &RunName, patience: Duration) -> Result<Report, Failure> {
    control::go_on(context, run, patience)
}

/// Reports what a verb would do, without doing it.
pub fn plan(context: &Context<'_>, intent: &Intent) -> Result<Report, Failure> {
    plan::plan(context, intent)
}

/// What people call a run.
fn called(store: &Store, run: &store::RunName) -> store::RunName {
    match store.names() {
        Ok(names) => names.shown(run),
        Err(_) => run.clone(),
    }
}

impl Context<'_> {
    /// Worker threads: as asked for, or one a core.
    fn threads(&self) -> NonZeroUsize {
        self.threads
            .unwrap_or_else(|| std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
    }
}

/// Lists the runs of the store.
pub fn runs(context: &Context<'_>) -> Result<Report, Failure> {
    list::runs(context)
}

/// Removes the packs of steps of a run that are not to be kept.
pub fn prune(
    context: &Context<'_>,
    run: &RunName,
    keep: Keep,
    doing: Doing,
) -> Result<Report, Failure> {
    keeping::prune(context, run, keep, doing)
}

/// Deletes a run that no other one takes up.
pub fn delete(context: &Context<'_>, run: &RunName) -> Result<Report, Failure> {
    keeping::delete(context, run)
}

/// Gives a run another name, also while it is computed.
pub fn rename(context: &Context<'_>, run: &RunName, to: &RunName) -> Result<Report, Failure> {
    rename::rename(context, run, to)
}

/// Writes a note into the log of a run.
pub fn note(context: &Context<'_>, run: &RunName, words: &str) -> Result<Report, Failure> {
    keeping::note(context, run, words)
}

/// Reports what happened to a run.
pub fn log(context: &Context<'_>, run: &RunName) -> Result<Report, Failure> {
    keeping::log(context, run)
}

/// Reports on a run, or on one of its steps.
pub fn show(context: &Context<'_>, address: &RunAddress) -> Result<Report, Failure> {
    show::show(context, address)
}

/// Reports where a running run is, or all of them, without opening the database.
pub fn status(context: &Context<'_>, run: Option<&RunName>) -> Result<Report, Failure> {
    status::status(context, run)
}

/// Asks one REV of a committed step again, compares the bits, and writes its grains into the folder `into`.
pub fn replay(
    context: &Context<'_>,
    rev: &RevAddress,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    replay::replay(context, rev, into)
}

/// Carries out the task again that failed and left the file `file`; writes its grains into the folder `into`.
pub fn replay_kept(file: &Path, into: Option<&Path>) -> Result<Report, Failure> {
    replay::replay_kept(file, into)
}

/// Checks every hash of a run or a step and carries out a sample of its REV tasks again.
pub fn verify(
    context: &Context<'_>,
    address: &RunAddress,
    sample: Sample,
) -> Result<Report, Failure> {
    verify::verify(context, address, sample)
}

/// Names where two runs part; writes the mesh coloured by the difference to the file `into`.
pub fn diff(
    context: &Context<'_>,
    a: &RunName,
    b: &RunName,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    diff::diff(context, a, b, into)
}

/// Writes the outputs of a run into the folder `into`, by default one named after the run.
pub fn export(
    context: &Context<'_>,
    run: &RunName,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    export::export(context, run, into)
}

/// Writes a run, or one with all that takes it up, into the new file `to`.
pub fn export_archive(
    context: &Context<'_>,
    run: &RunName,
    extent: ArchiveExtent,
    to: &Path,
) -> Result<Report, Failure> {
    archive::export(context, run, extent, to)
}

/// Takes the runs of an archive into the store, the one that was asked for under the name `name`.
pub fn import_archive(
    context: &Context<'_>,
    from: &Path,
    name: Option<&RunName>,
) -> Result<Report, Failure> {
    archive::import(context, from, name)
}

/// Prepares the packings of the materials of `problem` into the store, or those of `material` only.
pub fn rev_prepare(
    context: &Context<'_>,
    problem: &Problem,
    material: Option<&str>,
) -> Result<Report, Failure> {
    rev_prepare::prepare(context, problem, material)
}

/// Runs the element test of `problem` and reports its curve, without a run in the store, with `extras`.
pub fn rev_test(
    context: &Context<'_>,
    problem: &Problem,
    extras: &RevTestExtras,
) -> Result<Report, Failure> {
    rev_test::test(context, problem, extras)
}

/// Reads a packing of another program, brings it to equilibrium and reports its quality.
pub fn rev_import(_context: &Context<'_>, packing: &Path) -> Result<Report, Failure> {
    rev_exchange::import(packing)
}

/// Writes the packing of one REV of a committed step to the file `into`.
pub fn rev_export(context: &Context<'_>, rev: &RevAddress, into: &Path) -> Result<Report, Failure> {
    rev_exchange::export(context, rev, into)
}

/// Draws one REV, of a committed step or of a packing file, and reports its figures.
pub fn rev_show(
    context: &Context<'_>,
    source: &RevSource,
    output: Option<&PictureFile>,
) -> Result<Report, Failure> {
    rev_show::show(context, source, output)
}

/// Reports on the store.
pub fn store_info(context: &Context<'_>) -> Result<Report, Failure> {
    store_verbs::info(context)
}

/// Checks the store.
pub fn store_check(context: &Context<'_>, depth: CheckDepth) -> Result<Report, Failure> {
    store_verbs::check(context, depth)
}

/// Builds the database of the store anew from its packs.
pub fn store_rebuild(context: &Context<'_>) -> Result<Report, Failure> {
    store_verbs::rebuild(context)
}

/// Sets a run back to this load step: those after it are set aside and computed again by `resume`.
pub fn store_set_back(context: &Context<'_>, run: &RunName, step: u64) -> Result<Report, Failure> {
    store_verbs::set_back(context, run, step)
}
