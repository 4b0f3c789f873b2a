//! `femdem-flow show RUN[@STEP] [--revs [N]]`

use crate::address::RunAddress;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run, or one of its load steps: `hollow`, `hollow@12`, `hollow@last`.
    #[arg(value_name = "RUN[@STEP]")]
    address: RunAddress,
    /// List the REVs of the step that are worth a look instead: so many of the most strained, the least converged and the
    /// slowest.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5")]
    revs: Option<usize>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    match args.revs {
        Some(count) => run::show_revs(context, &args.address, count),
        None => run::show(context, &args.address),
    }
}
