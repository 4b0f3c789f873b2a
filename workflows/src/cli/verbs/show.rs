//! `femdem-flow show RUN[@STEP]`

use crate::address::RunAddress;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run, or one of its load steps: `hollow`, `hollow@12`, `hollow@last`.
    #[arg(value_name = "RUN[@STEP]")]
    address: RunAddress,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::show(context, &args.address)
}
