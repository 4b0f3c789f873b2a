//! `cargo run --release -p tests --bin fault-sweep`: every file operation of every verb fails in turn, once and for
//! good, with an error of the disk and for want of space. `cargo test` takes a few of them; this is all.

use std::process::ExitCode;

use clap::Parser;
use tests::fault_sweep::{self, KINDS, Tally};
use tests::faults::{Calls, Fault};

/// Let every file operation of every verb fail in turn.
#[derive(Debug, Parser)]
struct Args {
    /// Only every N-th operation.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: u64,
    /// Only verbs whose command contains this.
    #[arg(long, default_value = "")]
    only: String,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let mut all_right = true;
    let scenes = [
        (Calls::Changes, fault_sweep::writing()),
        (Calls::Reads, fault_sweep::reading()),
    ];
    for (calls, scenes) in scenes {
        for scene in scenes
            .iter()
            .filter(|scene| scene.command.contains(&args.only))
        {
            let operations = scene.operations(calls);
            let mut tally = Tally::default();
            for (error, lasting) in KINDS {
                // The order of a few operations, and with it their number, changes from run to run.
                for at in (1..=operations + 3).step_by(args.every.max(1) as usize) {
                    let fault = Fault {
                        calls,
                        at,
                        error,
                        lasting,
                    };
                    tally.meet(scene, fault);
                }
            }
            println!(
                "{}: {operations} {calls:?}, {} faults hit, {} failures, the longest case {:.1} s",
                scene.command,
                tally.count(),
                tally.failures.len(),
                tally.longest.as_secs_f64()
            );
            for ((operation, code), count) in &tally.hits {
                println!("    {count:4} × {operation}: exit code {code}");
            }
            for failure in &tally.failures {
                println!("  FAILED {failure}");
            }
            all_right &= tally.failures.is_empty();
        }
    }
    if all_right {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
