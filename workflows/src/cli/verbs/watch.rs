//! `femdem-flow watch [RUN]`

use std::io::Write;

use crate::address::RunName;
use crate::cli::display::Format;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run; the one that is being computed where it is not given. A queued one is waited for.
    run: Option<RunName>,
}

pub fn perform(
    args: &Args,
    context: &Context<'_>,
    format: Format,
    out: &mut dyn Write,
) -> Result<Report, Failure> {
    if format == Format::Text {
        return run::watch(context, args.run.as_ref(), &mut |_| {});
    }
    let mut line = |event: &str| {
        // Whoever reads us may have seen enough; the end is told by the exit code.
        let _ = writeln!(out, "{event}").and_then(|()| out.flush());
    };
    let watched = run::watch(context, args.run.as_ref(), &mut line);
    // The last event has said it all.
    watched.map(|_| Report::new("", &serde_json::Value::Null))
}
