//! `femdem-flow store info|check|rebuild|set-back`

use std::str::FromStr;

use crate::address::{AddressError, RunAddress, RunName, StepSelector};
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
    /// Set a run back to a load step, the way out where a later one is damaged.
    ///
    /// The load steps after it are set aside: their files are renamed, not deleted. `resume` computes them again.
    SetBack {
        /// The load step that becomes the last one: `hollow@12`.
        #[arg(value_name = "RUN@STEP")]
        to: StepAddress,
    },
}

/// A load step by its number.
#[derive(Debug, Clone)]
pub struct StepAddress {
    run: RunName,
    step: u64,
}

impl FromStr for StepAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        match text.parse()? {
            RunAddress {
                run,
                step: Some(StepSelector::Index(step)),
            } => Ok(Self { run, step }),
            RunAddress {
                step: Some(StepSelector::Last),
                ..
            } => Err(AddressError::Step {
                found: "last".to_owned(),
            }),
            RunAddress { run, step: None } => Err(AddressError::NoStep {
                run: run.to_string(),
            }),
        }
    }
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
        Verb::SetBack { to } => run::store_set_back(context, &to.run, to.step),
    }
}
