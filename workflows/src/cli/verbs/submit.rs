//! `femdem-flow submit FILE`

use std::path::PathBuf;

use super::terms;
use crate::address::RunName;
use crate::failure::Failure;
use crate::input::{self, Problem};
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
    #[command(flatten)]
    terms: terms::Args,
}

impl Args {
    /// The checked input, and the name that is to replace its own.
    pub fn problem(&self) -> Result<(Problem, Option<RunName>), Failure> {
        Ok((input::load(&self.file)?, self.name.clone()))
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let (problem, name) = args.problem()?;
    run::submit(context, problem, name, &args.terms.terms())
}
