//! `femdem-flow diff A B`

use std::path::PathBuf;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A run.
    a: RunName,
    /// Another one.
    b: RunName,
    /// File for the mesh coloured by the difference at the first step that differs (VTU).
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::diff(context, &args.a, &args.b, args.output.as_deref())
}
