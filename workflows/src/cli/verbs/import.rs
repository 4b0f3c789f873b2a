//! `femdem-flow import FILE`

use std::path::PathBuf;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The archive.
    file: PathBuf,
    /// Another name for its run; other runs in it whose names are taken get a number behind.
    #[arg(long)]
    name: Option<RunName>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::import_archive(context, &args.file, args.name.as_ref())
}
