//! The command line. [`run`] is all of `main`; [`execute`] is the same with its streams handed in, for tests.
//!
//! Data goes to stdout, everything else to stderr. One verb, one file in `verbs`.

mod args;
mod display;
mod panics;
mod progress;
mod supervise;
mod verbs;
mod warnings;

use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use self::args::{Cli, Verb};
pub use self::progress::Audience;
use crate::failure::FailureKind;
use crate::run::{Context, Supervision};

/// Runs the command with the arguments of the process, its own name first.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    panics::install_hook();
    let audience = if io::stderr().is_terminal() {
        Audience::Terminal
    } else {
        Audience::Log
    };
    let args: Vec<OsString> = args.into_iter().collect();
    let process = Process {
        args: args.clone(),
        supervision: supervise::supervised(),
    };
    ExitCode::from(execute_in(
        Some(&process),
        args,
        &mut io::stdout(),
        &mut io::stderr(),
        audience,
    ))
}

/// What the command is where it is a process of its own, and not called by a test.
struct Process {
    args: Vec<OsString>,
    supervision: Option<Supervision>,
}

/// Runs the command with other streams than those of the process; returns its exit code.
pub fn execute(
    args: impl IntoIterator<Item = OsString>,
    out: &mut dyn Write,
    err: &mut dyn Write,
    audience: Audience,
) -> u8 {
    execute_in(None, args, out, err, audience)
}

fn execute_in(
    process: Option<&Process>,
    args: impl IntoIterator<Item = OsString>,
    out: &mut dyn Write,
    err: &mut dyn Write,
    audience: Audience,
) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return explain_usage(&error, out, err),
    };
    let audience = if cli.global.quiet {
        Audience::Nobody
    } else {
        audience
    };
    let progress = progress::for_audience(audience);
    let context = Context {
        store: cli.global.store.clone(),
        threads: cli.global.threads,
        progress: progress.as_ref(),
        supervision: process.and_then(|process| process.supervision.as_ref()),
    };
    if process.is_some() {
        warnings::show(progress.clone());
    }
    let result = match (process, cli.verb.supervised()) {
        (Some(process), Some(order)) if process.supervision.is_none() => {
            match supervise::supervise(&process.args, order, &context) {
                // The last of the supervised processes has said all there is to say.
                Ok(code) => return code,
                Err(failure) => Err(failure),
            }
        }
        _ => verbs::perform(&cli, &context, out),
    };
    let display = match cli.verb {
        // Its data is a stream, which an object at its end would spoil.
        Verb::Watch(_) => display::Display::for_people(&cli.global),
        _ => display::Display::new(&cli.global),
    };
    let (code, shown) = match &result {
        Ok(report) => (0, display.report(out, report)),
        Err(failure) => (
            failure.kind().exit_code(),
            display.failure(out, err, failure),
        ),
    };
    match shown.and_then(|()| out.flush()) {
        Ok(()) => code,
        // Whoever reads us has seen enough, as in `femdem-flow schema | head`.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => code,
        // stderr is the last resort; where it fails too, the exit code remains.
        Err(error) => {
            let _ = writeln!(err, "Error: failed to write the output: {error}");
            FailureKind::Run.exit_code()
        }
    }
}

fn explain_usage<'a>(error: &clap::Error, out: &'a mut dyn Write, err: &'a mut dyn Write) -> u8 {
    let asked_for = matches!(
        error.kind(),
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion
    );
    let (stream, code) = if asked_for {
        (out, 0)
    } else {
        (err, FailureKind::Usage.exit_code())
    };
    // Nobody is left to be told where this fails.
    let _ = write!(stream, "{}", error.render());
    code
}
