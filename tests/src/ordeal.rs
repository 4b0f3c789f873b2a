//! A run that is stopped again and again and still has to arrive.
//!
//! The instants are drawn in the run's own time, its event log, and only then spread by a few milliseconds: so they
//! fall all over the run on a fast machine as on a loaded one.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crate::history;
use crate::random::Random;
use crate::workplace::{Outcome, Session, Signal, Workplace};

/// One interruption.
#[derive(Clone, Copy, Debug)]
pub struct Blow {
    /// The session is hit when it has logged this many events…
    pub events: u64,
    /// …and this much time has passed.
    pub then: Duration,
    /// What it is hit with.
    pub signal: Signal,
}

/// A run to be put to the ordeal.
#[derive(Clone, Copy, Debug)]
pub struct Ordeal<'a> {
    /// Its input.
    pub input: &'a Path,
    /// The name of the run in the input.
    pub run: &'a str,
    /// Worker threads.
    pub threads: u32,
}

impl Blow {
    /// A SIGKILL at a random instant of a session that has about `events` events before it.
    pub fn random(random: &mut Random, events: u64) -> Self {
        Self {
            events: random.below(events),
            then: Duration::from_micros(random.below(40_000)),
            signal: Signal::KILL,
        }
    }
}

impl Ordeal<'_> {
    /// Starts the next session: `submit` while the run is not in the store, then `resume`.
    pub fn session(&self, place: &Workplace) -> Session {
        let threads = self.threads.to_string();
        if history::of(&place.store(), self.run).is_some() {
            place.start(["resume", self.run, "--threads", &threads])
        } else {
            let input = self
                .input
                .to_str()
                .expect("temporary folders have plain names");
            place.start(["submit", input, "--threads", &threads])
        }
    }

    /// Starts a session and hits it. Returns how it ended: by the blow, or before it.
    pub fn hit(&self, place: &Workplace, blow: Blow) -> Outcome {
        let before = self.events(place);
        let mut session = self.session(place);
        while session.is_alive() && self.events(place) < before + blow.events {
            sleep(Duration::from_micros(500));
        }
        sleep(blow.then);
        session.signal(blow.signal);
        session.wait()
    }

    /// Runs a session that nobody disturbs: it has to arrive.
    ///
    /// # Panics
    /// Where it does not.
    pub fn arrive(&self, place: &Workplace) -> Outcome {
        self.session(place).wait().success()
    }

    /// Number of lines in the run's event log.
    pub fn events(&self, place: &Workplace) -> u64 {
        let path = place
            .store()
            .join("packs")
            .join(self.run)
            .join("events.jsonl");
        let log = fs::read(path).unwrap_or_default();
        log.iter().filter(|&&byte| byte == b'\n').count() as u64
    }
}
