//! `femdem-flow export RUN`

use std::path::PathBuf;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run.
    run: RunName,
    /// Folder for the files; one named after the run where it is not given.
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::export(context, &args.run, args.into.as_deref())
}
