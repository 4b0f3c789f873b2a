//! `femdem-flow export RUN`

use std::path::PathBuf;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, ArchiveExtent, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run.
    run: RunName,
    /// Folder for the files; one named after the run where it is not given.
    #[arg(long, value_name = "DIR", conflicts_with = "archive")]
    into: Option<PathBuf>,
    /// Write the run itself into this one new file, for `femdem-flow import` in another store.
    ///
    /// It holds all committed load steps, those of its ancestors that it takes up, the log and the notes; every byte is checked
    /// on the way. The REV tasks of a load step in progress are not in it: they are computed again.
    #[arg(long, value_name = "FILE")]
    archive: Option<PathBuf>,
    /// The archive takes all branches and reruns of the run along, and theirs.
    #[arg(long, requires = "archive")]
    subtree: bool,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let Some(archive) = &args.archive else {
        return run::export(context, &args.run, args.into.as_deref());
    };
    let extent = match args.subtree {
        true => ArchiveExtent::Subtree,
        false => ArchiveExtent::Run,
    };
    run::export_archive(context, &args.run, extent, archive)
}
