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
    /// How the verb is supervised.
    pub fn supervised(&self) -> &terms::Supervised {
        self.terms.supervised()
    }

    /// The checked input, and the name that is to replace its own.
    pub fn problem(&self) -> Result<(Problem, Option<RunName>), Failure> {
        Ok((input::load(&self.file)?, self.name.clone()))
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let terms = args.terms.terms(context);
    if let Some(report) = run::again(context, &terms) {
        // The file may have changed since; the run is what was submitted.
        return report;
    }
    let (problem, name) = args.problem()?;
    run::submit(context, problem, name, &terms)
}
