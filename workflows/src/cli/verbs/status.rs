//! `femdem-flow status [RUN]`

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run; all runs where it is not given.
    run: Option<RunName>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::status(context, args.run.as_ref())
}
