//! `femdem-flow store info|check|rebuild`

use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, CheckDepth, Context};

#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Say what the store holds and how much room it takes.
    Info,
    /// Look for damage.
    ///
    /// Puts right what a crash left behind, as every opening does. While another process owns the store, the files are
    /// looked at without the database.
    Check {
        /// Read every byte of every pack and compare it with its digest.
        #[arg(long)]
        deep: bool,
    },
    /// Build the database anew from the packs, which hold everything.
    Rebuild,
}

pub fn perform(verb: &Verb, context: &Context<'_>) -> Result<Report, Failure> {
    match verb {
        Verb::Info => run::store_info(context),
        Verb::Check { deep } => run::store_check(
            context,
            if *deep {
                CheckDepth::Deep
            } else {
                CheckDepth::Quick
            },
        ),
        Verb::Rebuild => run::store_rebuild(context),
    }
}
