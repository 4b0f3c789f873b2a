//! `femdem-flow resume RUN`

use super::terms;
use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run.
    run: RunName,
    #[command(flatten)]
    terms: terms::Args,
}

impl Args {
    /// How the verb is supervised.
    pub fn supervised(&self) -> &terms::Supervised {
        self.terms.supervised()
    }

    /// The run.
    pub fn run(&self) -> &RunName {
        &self.run
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    run::resume(context, &args.run, &args.terms.terms(context))
}
