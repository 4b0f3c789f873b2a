//! `femdem-flow cancel RUN`, `femdem-flow pause RUN` and `femdem-flow continue RUN`

use std::time::Duration;

use crate::address::RunName;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context, Extent, Urgency};

#[derive(Debug, clap::Args)]
pub struct CancelArgs {
    /// The run.
    run: RunName,
    /// Give up the tasks that run rather than wait for them, as a second signal does.
    #[arg(long)]
    now: bool,
    /// End the process that computes the run as well: what it would compute next is left as it is.
    #[arg(long)]
    process: bool,
    #[command(flatten)]
    patience: Patience,
}

#[derive(Debug, clap::Args)]
pub struct PauseArgs {
    /// The run.
    run: RunName,
    #[command(flatten)]
    patience: Patience,
}

#[derive(Debug, clap::Args)]
struct Patience {
    /// How long to wait until the process has acted, in seconds; 0 only leaves the request.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds)]
    timeout: Duration,
}

pub fn cancel(args: &CancelArgs, context: &Context<'_>) -> Result<Report, Failure> {
    let urgency = if args.now {
        Urgency::AtOnce
    } else {
        Urgency::InOrder
    };
    let extent = if args.process {
        Extent::Process
    } else {
        Extent::Run
    };
    run::cancel(context, &args.run, urgency, extent, args.patience.timeout)
}

pub fn pause(args: &PauseArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::pause(context, &args.run, args.patience.timeout)
}

pub fn go_on(args: &PauseArgs, context: &Context<'_>) -> Result<Report, Failure> {
    run::go_on(context, &args.run, args.patience.timeout)
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = text.parse().ok();
    seconds
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| "write a number of seconds".to_owned())
}
