//! `femdem-flow completions SHELL`

use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::args::Cli;
use crate::report::Report;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell.
    shell: Shell,
}

/// The script for the shell; for machines the same text in a JSON string.
pub fn perform(args: &Args) -> Report {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "femdem-flow", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    Report::new(script.clone(), &script)
}
