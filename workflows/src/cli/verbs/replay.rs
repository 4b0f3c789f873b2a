//! `femdem-flow replay RUN@STEP:eN.G`

use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

use crate::address::{AddressError, RevAddress};
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The REV, `hollow@12:e46.2`; or the file that a failed task left in the store's folder `failed`, `step12-e46.rmp`.
    #[arg(value_name = "RUN@STEP:eN.G|FILE")]
    what: Target,
    /// Folder for the grains and contacts before and after (VTP, JSON) and the report.
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// What is replayed.
#[derive(Debug, Clone)]
enum Target {
    Rev(RevAddress),
    Kept(PathBuf),
}

impl FromStr for Target {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        if text.ends_with(".rmp") {
            let Ok(path): Result<PathBuf, Infallible> = text.parse();
            return Ok(Self::Kept(path));
        }
        text.parse().map(Self::Rev)
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    match &args.what {
        Target::Rev(address) => run::replay(context, address, args.output.as_deref()),
        Target::Kept(file) => run::replay_kept(file, args.output.as_deref()),
    }
}
