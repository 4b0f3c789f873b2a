//! `femdem-flow submit FILE`

use std::path::PathBuf;

use crate::address::RunName;
use crate::failure::Failure;
use crate::input;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The input (YAML); `femdem-flow schema` describes it.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Name of the run, in place of the input's.
    #[arg(long, value_name = "RUN")]
    name: Option<RunName>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::submit(context, input::load(&args.file)?, args.name.clone())
}
