//! `femdem-flow prune RUN`, `delete RUN`, `rename RUN NAME`, `note RUN TEXT`, `log RUN`

use std::num::NonZeroU32;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context, Doing, Keep};

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("keep").required(true).multiple(true))]
pub struct PruneArgs {
    /// The run.
    run: RunName,
    /// Keep the load steps whose number is a multiple of this.
    #[arg(long, value_name = "N", group = "keep")]
    keep_every: Option<NonZeroU32>,
    /// Keep this many load steps at the end.
    #[arg(long, value_name = "N", group = "keep")]
    keep_last: Option<u32>,
    /// Only say what would go.
    #[arg(long)]
    dry_run: bool,
}

#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// The run.
    run: RunName,
}

#[derive(Debug, clap::Args)]
pub struct RenameArgs {
    /// The run.
    run: RunName,
    /// What it is called from now on.
    name: RunName,
}

#[derive(Debug, clap::Args)]
pub struct NoteArgs {
    /// The run.
    run: RunName,
    /// What is to be remembered of it.
    #[arg(value_parser = clap::builder::NonEmptyStringValueParser::new())]
    text: String,
}

pub fn prune(args: &PruneArgs, context: &Context<'_>) -> Result<Report, Failure> {
    let keep = Keep {
        every: args.keep_every,
        last: args.keep_last,
    };
    let doing = if args.dry_run {
        Doing::Dry
    } else {
        Doing::Really
    };
    run::prune(context, &args.run, keep, doing)
}

pub fn delete(args: &RunArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::delete(context, &args.run)
}

pub fn rename(args: &RenameArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::rename(context, &args.run, &args.name)
}

pub fn note(args: &NoteArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::note(context, &args.run, &args.text)
}

pub fn log(args: &RunArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::log(context, &args.run)
}
