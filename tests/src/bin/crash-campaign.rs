//! `cargo run --release -p tests --bin crash-campaign -- --rounds 1000 --seed 1`: stores that are killed at random
//! instants, while runs are computed, resumed, branched, pruned and deleted, for as long as one likes. After each kill every
//! committed step must be there and sound, and each store must come to the digests of one that nobody disturbed.
//! `cargo test` does a few rounds of the same; this is for a night.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use tests::crash::Campaign;
use tests::random::Random;

/// Kill femdem-flow at random instants of all it does, round after round.
#[derive(Debug, Parser)]
struct Args {
    /// Number of rounds.
    #[arg(long, default_value_t = 20)]
    rounds: u32,
    /// Seed of the instants.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Most kills of one verb in a round.
    #[arg(long, default_value_t = 2)]
    kills: u64,
    /// Load steps of the run.
    #[arg(long, default_value_t = 3)]
    steps: u32,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let mut campaign = Campaign::new(args.steps);
    println!(
        "calm run: {} load steps, {} events",
        args.steps,
        campaign.events()
    );
    let (mut random, since, mut failures) = (Random::new(args.seed), Instant::now(), 0);
    for number in 1..=args.rounds {
        if let Err(why) = campaign.round(&mut random, args.kills) {
            failures += 1;
            println!("round {number} FAILED: {why}");
        }
        if number % 50 == 0 {
            println!(
                "{number} rounds, {failures} failed, {:.0} s",
                since.elapsed().as_secs_f64()
            );
        }
    }
    for (phase, (sent, hits)) in &campaign.kills {
        println!("{phase:?}: {hits} of {sent} kills hit");
    }
    let hits: u64 = campaign.kills.values().map(|(_, hits)| hits).sum();
    println!(
        "{} rounds, {hits} kills hit, {failures} rounds failed",
        args.rounds
    );
    if failures == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
