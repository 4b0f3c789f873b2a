//! `cargo run --release -p tests --bin crash-campaign -- --rounds 50 --seed 1`: runs that are killed at random
//! instants, again and again, for as long as one likes. Each must arrive at the digests of the run that nobody
//! disturbed. `cargo test` does a few rounds of the same; this is for a night.

use std::process::ExitCode;

use clap::Parser;
use tests::history;
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::random::Random;
use tests::workplace::Workplace;

const RUN: &str = "campaign";

/// Kill a run at random instants until it arrives, round after round.
#[derive(Debug, Parser)]
struct Args {
    /// Number of rounds.
    #[arg(long, default_value_t = 20)]
    rounds: u32,
    /// Seed of the instants.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Most kills of one run.
    #[arg(long, default_value_t = 6)]
    kills: u32,
    /// Load steps of the run.
    #[arg(long, default_value_t = 6)]
    steps: u32,
}

/// What a round came to.
struct Round {
    /// Kills that found the process alive.
    hits: u32,
    /// Whether it arrived at the digests of the calm run.
    same: bool,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let input = inputs::biaxial(RUN, 100, args.steps);
    let calm_place = Workplace::new();
    let file = calm_place.write("calm.yaml", &input);
    let calm = Ordeal {
        input: &file,
        run: RUN,
        threads: 2,
    };
    calm.arrive(&calm_place);
    let expected = history::of(&calm_place.store(), RUN);
    let events = calm.events(&calm_place);
    println!("calm run: {} load steps, {events} events", args.steps);

    let mut random = Random::new(args.seed);
    let (mut hits, mut different) = (0, 0);
    for number in 1..=args.rounds {
        let round = ordeal(&input, &mut random, args.kills, events, expected.as_ref());
        hits += round.hits;
        different += u32::from(!round.same);
        let verdict = if round.same {
            "same digests"
        } else {
            "DIFFERENT"
        };
        println!(
            "round {number}/{}: {} kills hit, {verdict}",
            args.rounds, round.hits
        );
    }
    println!(
        "{} rounds, {hits} kills hit, {different} rounds with other digests",
        args.rounds
    );
    if different == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn ordeal(
    input: &str,
    random: &mut Random,
    most: u32,
    events: u64,
    expected: Option<&history::History>,
) -> Round {
    let place = Workplace::new();
    let file = place.write("campaign.yaml", input);
    let threads = 1 + u32::from(random.below(2) == 1);
    let ordeal = Ordeal {
        input: &file,
        run: RUN,
        threads,
    };
    let kills = 1 + random.below(u64::from(most));
    let mut hits = 0;
    for _ in 0..kills {
        let left = events.saturating_sub(ordeal.events(&place)).max(4);
        let outcome = ordeal.hit(&place, Blow::random(random, left));
        hits += u32::from(outcome.signal == Some(9));
    }
    ordeal.arrive(&place);
    Round {
        hits,
        same: history::of(&place.store(), RUN).as_ref() == expected,
    }
}
