//! A store that is killed at work, again and again: while a run is prepared and computed, while it is resumed, while a
//! branch is made, while load steps are pruned, while a run is deleted, while an archive is imported. After each kill everything that was committed is
//! there and sound; in the end everything has the bits of a store that nobody disturbed.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::history::{self, Kept, Steps};
use crate::inputs;
use crate::ordeal::{Blow, Ordeal};
use crate::random::Random;
use crate::workplace::{Signal, Workplace};

const RUN: &str = "campaign";
const BRANCH: &str = "branch campaign@1 --ramp shortening=0 --steps 2 --name other";
const PRUNE: &str = "prune campaign --keep-last 1";
const DELETE: &str = "delete other";
const IMPORT: &str = "import campaign.archive";

fn sound(place: &Workplace) -> Result<(), String> {
    let check = place.run(["store", "check", "--deep"]);
    match check.code {
        Some(0) => Ok(()),
        _ => Err(format!("the store is not sound: {check:#?}")),
    }
}

/// What was being done when the process was killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// The run is created, its packings are prepared.
    Preparing,
    /// Load steps are computed in the session that began the run.
    Submitting,
    /// Load steps are computed in a later session.
    Resuming,
    /// A branch is made, and its first steps are computed.
    Branching,
    /// Load steps are pruned.
    Pruning,
    /// A run is deleted.
    Deleting,
    /// A run and its branch are taken into another store.
    Importing,
}

/// The input of a campaign and what it comes to when nobody disturbs it.
pub struct Campaign {
    input: String,
    /// Events of the calm run.
    events: u64,
    /// The run and its branch as one file.
    archive: Vec<u8>,
    /// What the store holds after run, branch, prune, delete.
    calm: [BTreeMap<String, Steps>; 4],
    /// How long the short verbs take, undisturbed, as measured last.
    durations: BTreeMap<&'static str, Duration>,
    /// Kills by phase: sent, and of them those that found the process alive.
    pub kills: BTreeMap<Phase, (u64, u64)>,
}

impl Campaign {
    /// A campaign of runs of one element with 100 grains in each REV.
    ///
    /// # Panics
    /// Where the calm run does not arrive.
    pub fn new(steps: u32) -> Self {
        let input = inputs::least(RUN, steps).replace("grains: 20", "grains: 100");
        let mut campaign = Self {
            input,
            events: 0,
            archive: Vec::new(),
            calm: Default::default(),
            durations: BTreeMap::new(),
            kills: BTreeMap::new(),
        };
        let place = campaign.place();
        campaign.ordeal(2).arrive(&place);
        campaign.events = campaign.ordeal(2).events(&place);
        let held = || history::everything(&place.store()).expect("the store is sound");
        campaign.calm[0] = held();
        for (number, verb) in [BRANCH, PRUNE, DELETE].into_iter().enumerate() {
            campaign.timed(&place, verb);
            campaign.calm[number + 1] = held();
            if verb == BRANCH {
                let export = format!("export {RUN} --subtree --archive exported.archive");
                place.run(export.split(' ')).success();
                let archive = fs::read(place.dir().join("exported.archive"));
                campaign.archive = archive.expect("the archive is written");
            }
        }
        campaign.timed(&campaign.place(), IMPORT);
        campaign
    }

    /// Events of the calm run.
    pub fn events(&self) -> u64 {
        self.events
    }

    /// One round: a run, a branch, a prune and a deletion, each killed up to `most` times.
    ///
    /// # Errors
    /// What is lost, damaged or different.
    pub fn round(&mut self, random: &mut Random, most: u64) -> Result<(), String> {
        let place = self.place();
        let threads = 1 + random.below(2) as u32;
        let mut known = BTreeMap::new();
        for _ in 0..random.below(most + 1) {
            let ordeal = self.ordeal(threads);
            let before = ordeal.events(&place);
            let left = self.events.saturating_sub(before).max(4);
            let mut blow = Blow::random(random, left);
            // A step of this run takes some milliseconds.
            blow.then /= 8;
            let (outcome, after) = (ordeal.hit(&place, blow), ordeal.events(&place));
            // Two events, a session and its preparation, come before the first step.
            let phase = match before {
                0 if after < 4 => Phase::Preparing,
                0 => Phase::Submitting,
                _ => Phase::Resuming,
            };
            self.count(phase, outcome.signal == Some(9));
            self.nothing_is_lost(&place, &mut known)?;
        }
        self.ordeal(threads)
            .session(&place)
            .end(Duration::from_secs(120))?;
        self.holds(&place, 0)?;
        known.clone_from(&self.calm[0]);

        self.killed(&place, BRANCH, Phase::Branching, most, random, &mut known)?;
        // Killed before it was made, it is made; killed later, it is resumed.
        let resumed = place.run(["resume", "other"]);
        if resumed.code != Some(0) {
            self.timed(&place, BRANCH);
        }
        self.holds(&place, 1)?;
        known.clone_from(&self.calm[1]);

        self.killed(&place, PRUNE, Phase::Pruning, most, random, &mut known)?;
        self.timed(&place, PRUNE);
        self.holds(&place, 2)?;
        known.clone_from(&self.calm[2]);

        self.killed(&place, DELETE, Phase::Deleting, most, random, &mut known)?;
        if history::everything(&place.store())?.contains_key("other") {
            self.timed(&place, DELETE);
        }
        self.holds(&place, 3)?;
        sound(&place)?;

        let (place, mut known) = (self.place(), BTreeMap::new());
        self.killed(&place, IMPORT, Phase::Importing, most, random, &mut known)?;
        if history::everything(&place.store())?.is_empty() {
            // Killed late enough, it is finished by the next opening, and its runs are no longer to be imported.
            let outcome = place.run(IMPORT.split(' '));
            let finished = outcome
                .err
                .contains("finished an import that was cut short");
            if outcome.code != Some(0) && !(finished && outcome.code == Some(2)) {
                return Err(format!("it cannot be imported any more: {outcome:#?}"));
            }
        }
        // Where some of the runs are there, the next opening for writing brings the others.
        sound(&place)?;
        self.holds(&place, 1)
    }

    fn place(&self) -> Workplace {
        let place = Workplace::new();
        place.write("campaign.yaml", &self.input);
        let archive = place.dir().join("campaign.archive");
        fs::write(archive, &self.archive).expect("a temporary folder can be written to");
        place
    }

    fn ordeal(&self, threads: u32) -> Ordeal<'static> {
        Ordeal {
            input: Path::new("campaign.yaml"),
            run: RUN,
            threads,
        }
    }

    fn count(&mut self, phase: Phase, hit: bool) {
        let (sent, hits) = self.kills.entry(phase).or_default();
        *sent += 1;
        *hits += u64::from(hit);
    }

    /// Runs a verb to its end and takes note of how long that took.
    fn timed(&mut self, place: &Workplace, verb: &'static str) {
        let since = Instant::now();
        place.run(verb.split(' ')).success();
        self.durations.insert(verb, since.elapsed());
    }

    /// Kills a verb up to `most` times at instants over its whole length.
    fn killed(
        &mut self,
        place: &Workplace,
        verb: &'static str,
        phase: Phase,
        most: u64,
        random: &mut Random,
        known: &mut BTreeMap<String, Steps>,
    ) -> Result<(), String> {
        let length = self
            .durations
            .get(verb)
            .map_or(20_000, |length| length.as_micros() as u64);
        for _ in 0..random.below(most + 1) {
            // A branch that was made before the kill is there, and is gone on with.
            let made = verb == BRANCH && known.contains_key("other");
            let verb = if made { "resume other" } else { verb };
            if verb == IMPORT && !known.is_empty() {
                // All of it came in, or some of it, which the end shows.
                break;
            }
            let session = place.start(verb.split(' '));
            sleep(Duration::from_micros(random.below(length)));
            session.signal(Signal::KILL);
            let outcome = session.end(Duration::from_secs(120))?;
            self.count(phase, outcome.signal == Some(9));
            if phase == Phase::Deleting {
                known.remove("other");
            }
            self.nothing_is_lost(place, known)?;
            if outcome.code == Some(0) {
                break;
            }
        }
        Ok(())
    }

    /// What was known to be committed is there, sound and with the right digests; what is new is known from now on.
    fn nothing_is_lost(
        &self,
        place: &Workplace,
        known: &mut BTreeMap<String, Steps>,
    ) -> Result<(), String> {
        let found = history::everything(&place.store())?;
        for (run, (_, steps)) in known.iter() {
            let there = found.get(run).map_or(&[][..], |(_, steps)| steps);
            for (step, digest, _) in steps {
                if !there.iter().any(|(s, d, _)| (s, d) == (step, digest)) {
                    let all = history::in_words(&found);
                    return Err(format!("{run}@{step}, committed before, is lost: {all}"));
                }
            }
        }
        for (run, (_, steps)) in &found {
            let calm = self.calm.iter().find_map(|held| held.get(run));
            let (_, calm) = calm.ok_or_else(|| format!("a run `{run}` that nobody asked for"))?;
            for (step, digest, kept) in steps {
                let right = calm.iter().find(|(s, ..)| s == step);
                if right.is_none_or(|(_, d, _)| d != digest) {
                    return Err(format!("{run}@{step} is another than undisturbed"));
                }
                let prunable = self.calm[2].get(run).is_some_and(|(_, steps)| {
                    steps
                        .iter()
                        .any(|(s, _, k)| s == step && *k == Kept::Pruned)
                });
                if *kept == Kept::Pruned && !prunable {
                    return Err(format!("{run}@{step} was pruned"));
                }
            }
        }
        known.extend(found);
        Ok(())
    }

    fn holds(&self, place: &Workplace, stage: usize) -> Result<(), String> {
        let found = history::everything(&place.store())?;
        if found == self.calm[stage] {
            return Ok(());
        }
        Err(format!(
            "stage {stage} came to {}\nand not {}",
            history::in_words(&found),
            history::in_words(&self.calm[stage])
        ))
    }
}
