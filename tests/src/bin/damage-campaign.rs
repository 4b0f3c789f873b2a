//! `cargo run --release -p tests --bin damage-campaign`: 500 bytes flipped and files cut, over all files of a store, and
//! how each damage ended. `cargo test` takes some of them.

use std::process::ExitCode;

use clap::Parser;
use tests::damage::{Original, Table};
use tests::random::Random;

/// Damage a store in one place at a time and see whether it is noticed.
#[derive(Debug, Parser)]
struct Args {
    /// Number of damages.
    #[arg(long, default_value_t = 500)]
    rounds: usize,
    /// Seed of places and kinds.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let original = Original::new();
    println!("{} files", original.files().len());
    let (mut random, mut table) = (Random::new(args.seed), Table::default());
    for number in 0..args.rounds {
        let case = original.damage(number, &mut random);
        if let Err(why) = &case.fate {
            println!("FAILED {}: {why}", case.what);
        }
        table.add(case);
    }
    for ((kind, fate), count) in &table.counts {
        println!("{kind:?}: {fate:?} {count}");
    }
    println!("{} damages, {} failures", args.rounds, table.failures.len());
    if table.failures.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
