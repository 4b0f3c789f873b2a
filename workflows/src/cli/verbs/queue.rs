//! `femdem-flow queue`, `femdem-flow queue remove N`, `femdem-flow queue run`

use super::terms;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// List what is queued; the same as `queue` alone.
    List,
    /// Take entries back before they are computed.
    Remove {
        /// Their numbers, or the names of their runs.
        #[arg(value_name = "N|RUN", required = true)]
        which: Vec<String>,
    },
    /// Compute what is queued, in order; refused where another process computes in the store.
    ///
    /// An entry that was begun by a process that is gone is gone on with. One that fails does not keep the next from being
    /// computed; the exit code is 1 then.
    Run(terms::Supervised),
}

impl Args {
    /// How the verb is supervised, where it computes.
    pub fn supervised(&self) -> Option<&terms::Supervised> {
        match &self.verb {
            Some(Verb::Run(terms)) => Some(terms),
            _ => None,
        }
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    match &args.verb {
        None | Some(Verb::List) => run::queue_list(context),
        Some(Verb::Remove { which }) => run::queue_remove(context, which),
        Some(Verb::Run(terms)) => run::queue_run(context, &terms.terms(context)),
    }
}
