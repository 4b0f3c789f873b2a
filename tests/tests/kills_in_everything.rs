//! A queue, a power cut or an owner in a hurry kill not only runs: they kill the making of a branch and the pruning of load
//! steps as well. After each kill, whatever was being done, every committed step is there and sound, and in the end
//! everything has the bits of a store that nobody disturbed. (`crash-campaign` does this for a night.)

use tests::crash::{Campaign, Phase};
use tests::random::Random;

#[test]
fn killed_in_whatever_it_does_the_store_comes_to_the_same_bits() {
    let mut campaign = Campaign::new(3);
    let mut random = Random::new(5);
    // Whether a kill finds a verb of some milliseconds is a matter of the machine: then a few rounds more.
    let phases = [Phase::Resuming, Phase::Branching, Phase::Pruning];
    for round in 0..60 {
        if let Err(why) = campaign.round(&mut random, 2) {
            panic!("round {round}: {why}");
        }
        let hits = |phase: &Phase| campaign.kills.get(phase).map_or(0, |(_, hits)| *hits);
        if round >= 7 && phases.iter().all(|phase| hits(phase) > 0) {
            println!("{:?}", campaign.kills);
            return;
        }
    }
    panic!(
        "no kill hit in some phase, the test shows nothing: {:?}",
        campaign.kills
    );
}
