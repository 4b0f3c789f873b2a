//! Every file operation of a verb fails in turn. Whatever fails, the verb has to end in words, nothing that was
//! committed may be lost, and done again on a sound disk it has to come to what it comes to when nothing fails.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::io::Errno;

use crate::faults::{self, Calls, Fault, Lasting};
use crate::folder;
use crate::history::{self, Steps};
use crate::inputs;
use crate::ordeal::{Blow, Ordeal};
use crate::workplace::{Outcome, Signal, Workplace};

const RUN: &str = "small";
const SUBMIT: &str = "submit input.yaml --threads 1";
const BRANCH: &str = "branch small@1 --hold --steps 2 --name other --threads 1";

/// The longest that a verb may take on a disk that fails: the database is waited for up to half a minute, twice.
const LIMIT: Duration = Duration::from_secs(100);

/// A verb on a store.
pub struct Scene {
    /// The command while the disk fails.
    pub command: String,
    /// The store before it.
    before: Workplace,
    /// The commands that end the matter afterwards, whatever the first came to: tried until one succeeds.
    again: Vec<&'static str>,
    /// What it comes to when nothing fails.
    calm: Calm,
}

/// What a verb comes to when nothing fails.
struct Calm {
    /// What it says on stdout.
    out: String,
    /// What the store holds after it.
    at_once: BTreeMap<String, Steps>,
    /// What the store holds when the matter is ended.
    finally: BTreeMap<String, Steps>,
}

/// How one fault ended.
pub enum End {
    /// The verb has fewer operations.
    NotHit,
    /// It hit this operation, and the verb ended with this exit code.
    Hit(String, i32),
}

/// The verbs that write to a store, each with a store before it.
pub fn writing() -> Vec<Scene> {
    let empty = with_input(Workplace::new(), 2);
    let whole = with_input(Workplace::new(), 2);
    whole.run(words(SUBMIT)).success();
    let long = with_input(Workplace::new(), 5);
    long.run(words(SUBMIT)).success();
    long.run(words(BRANCH)).success();
    let archived = with_input(Workplace::new(), 2);
    let archive = archived.dir().join("other.archive");
    let archive = archive.to_str().expect("a plain name");
    long.run(["export", "other", "--archive", archive])
        .success();
    let queued = with_input(Workplace::new(), 2);
    queued.run(words("submit input.yaml --queue")).success();
    vec![
        Scene::new(SUBMIT, &empty, &["resume small", SUBMIT]),
        Scene::new(
            "resume small --threads 1",
            &half_way(&whole),
            &["resume small"],
        ),
        Scene::new(BRANCH, &whole, &["resume other", BRANCH]),
        Scene::new(
            "prune small --keep-last 1",
            &long,
            &["prune small --keep-last 1"],
        ),
        Scene::new("delete other", &long, &["delete other", "runs"]),
        Scene::new("store rebuild", &long, &["store rebuild"]),
        Scene::new("store set-back small@1", &whole, &["resume small"]),
        Scene::new(
            "rename small better",
            &whole,
            &["show better", "rename small better"],
        ),
        Scene::new(
            "import other.archive",
            &archived,
            &["show other", "import other.archive"],
        ),
        Scene::new("queue run --threads 1", &queued, &["queue run --threads 1"]),
        Scene::new("note small remember", &whole, &["note small remember"]),
    ]
}

/// The verbs that only read; those that write read first what they write on.
pub fn reading() -> Vec<Scene> {
    let long = with_input(Workplace::new(), 3);
    long.run(words(SUBMIT)).success();
    long.run(words(BRANCH)).success();
    long.run(words("prune small --keep-last 1")).success();
    let verbs = [
        "runs",
        "show small",
        "show small@3",
        "log small",
        "verify small",
        "diff small other",
        "export small",
        "store check --deep",
        "store info",
    ];
    verbs
        .map(|verb| Scene::new(verb, &long, &[verb]))
        .into_iter()
        .chain(writing())
        .collect()
}

fn words(command: &str) -> Vec<&str> {
    command.split(' ').collect()
}

fn with_input(place: Workplace, steps: u32) -> Workplace {
    place.write("input.yaml", &inputs::least(RUN, steps));
    place
}

/// A store whose run was killed in the midst of a wave.
fn half_way(whole: &Workplace) -> Workplace {
    let ordeal = Ordeal {
        input: Path::new("input.yaml"),
        run: RUN,
        threads: 1,
    };
    let blow = Blow {
        events: ordeal.events(whole) / 2,
        then: Duration::ZERO,
        signal: Signal::KILL,
    };
    for _ in 0..50 {
        let place = with_input(Workplace::new(), 2);
        let killed = ordeal.hit(&place, blow).signal == Some(9);
        let files = folder::files_below(&place.store());
        let journals = files
            .iter()
            .filter(|file| file.extension().is_some_and(|e| e == "part"));
        if killed && journals.count() > 0 {
            return place;
        }
    }
    panic!("no kill fell into a wave");
}

impl Scene {
    fn new(command: &str, before: &Workplace, again: &[&'static str]) -> Self {
        let mut scene = Self {
            command: command.to_owned(),
            before: before.copy(),
            again: again.to_vec(),
            calm: Calm {
                out: String::new(),
                at_once: BTreeMap::new(),
                finally: BTreeMap::new(),
            },
        };
        let place = scene.before.copy();
        let outcome = place.run(words(command)).success();
        let at_once = history::everything(&place.store()).expect("the store is sound");
        scene
            .end_the_matter(&place)
            .expect("nothing fails when nothing fails");
        scene.calm = Calm {
            out: outcome.out,
            at_once,
            finally: history::everything(&place.store()).expect("the store is sound"),
        };
        scene
    }

    /// Number of operations of the verb when none fails.
    pub fn operations(&self, calls: Calls) -> u64 {
        let place = self.before.copy();
        let counting = faults::counting(&place, calls);
        place
            .start_in(words(&self.command), &counting)
            .wait()
            .success();
        faults::noted(&place).len() as u64
    }

    /// The verb meets a fault.
    ///
    /// # Errors
    /// What was not as it should be.
    pub fn meet(&self, fault: Fault) -> Result<End, String> {
        let place = self.before.copy();
        let environment = fault.environment(&place);
        let outcome = place
            .start_in(words(&self.command), &environment)
            .end(LIMIT)?;
        let Some(hit) = faults::noted(&place).into_iter().next() else {
            return Ok(End::NotHit);
        };
        let failed = |what: String| Err(format!("{hit}: {what}"));
        let code = match outcome.code {
            Some(code @ (0 | 1 | 3)) => code,
            // A step that could not be listed for a moment and is pruned is refused as one that the user gave up.
            Some(2) if outcome.err.contains("it was pruned") => 2,
            _ => return failed(format!("another exit code: {outcome:#?}")),
        };
        if code != 0 && !outcome.err.contains("Error: ") {
            return failed(format!("it does not say why: {outcome:#?}"));
        }
        if let Err(error) = self.is_sound(&place) {
            return failed(format!("{error}, after {outcome:#?}"));
        }
        if code == 0
            && let Err(error) = self.is_done(&place, &outcome)
        {
            return failed(format!("it claims success, and {error}"));
        }
        if let Err(error) = self.end_the_matter(&place) {
            return failed(error);
        }
        match history::everything(&place.store()) {
            Ok(found) if found == self.calm.finally => Ok(End::Hit(hit, code)),
            Ok(found) => failed(format!(
                "in the end {}, it should be {}, after {outcome:#?}",
                history::in_words(&found),
                history::in_words(&self.calm.finally)
            )),
            Err(error) => failed(format!("in the end {error}, after {outcome:#?}")),
        }
    }

    /// On a sound disk nothing is wrong with the store, where there is one yet.
    fn is_sound(&self, place: &Workplace) -> Result<(), String> {
        let check = place
            .start(words("store check --deep"))
            .end(Duration::from_secs(100))?;
        match check.code {
            Some(0) => Ok(()),
            Some(3) if check.err.contains("find a store in") => Ok(()),
            _ => Err(format!("the store is not sound: {check:#?}")),
        }
    }

    fn is_done(&self, place: &Workplace, outcome: &Outcome) -> Result<(), String> {
        let found = history::everything(&place.store())?;
        // A load step that could not be read when it was to be pruned is named and stays.
        let stays = outcome.err.contains(".pack: ") && same_digests(&found, &self.calm.at_once);
        if found != self.calm.at_once && !stays {
            return Err(format!(
                "it left {} and not {}",
                history::in_words(&found),
                history::in_words(&self.calm.at_once)
            ));
        }
        // Lists tell how long things took, so that lines are counted only; less of them has to be excused. The runs
        // that take a run up are told as far as they can be read: `runs` is the one to complain of the others.
        let count = |text: &str| {
            text.lines()
                .filter(|line| !line.contains("taken up"))
                .count()
        };
        let excuses = ["cannot be read", "damaged: "];
        let excused = excuses.iter().any(|words| outcome.out.contains(words));
        let excused = excused || !outcome.err.is_empty();
        if count(&outcome.out) < count(&self.calm.out) && !excused {
            return Err(format!("it says {} and not {}", outcome.out, self.calm.out));
        }
        Ok(())
    }

    fn end_the_matter(&self, place: &Workplace) -> Result<(), String> {
        let mut said = Vec::new();
        for command in &self.again {
            let outcome = place.start(words(command)).end(LIMIT)?;
            if outcome.code == Some(0) {
                return Ok(());
            }
            said.push(outcome);
        }
        Err(format!("it cannot be done again: {said:#?}"))
    }
}

/// Whether the same steps are there, pruned or not.
fn same_digests(found: &BTreeMap<String, Steps>, expected: &BTreeMap<String, Steps>) -> bool {
    let plain = |runs: &BTreeMap<String, Steps>| -> Vec<_> {
        let steps = |(run, (_, steps)): (&String, &Steps)| {
            let digests = steps.iter().map(|(step, digest, _)| (*step, *digest));
            (run.clone(), digests.collect::<Vec<_>>())
        };
        runs.iter().map(steps).collect()
    };
    plain(found) == plain(expected)
}

/// What a sweep came to.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Faults that hit, by kind of operation and exit code.
    pub hits: BTreeMap<(String, i32), u64>,
    /// The longest that a verb took, all of a case together.
    pub longest: Duration,
    /// What was not as it should be.
    pub failures: Vec<String>,
}

impl Tally {
    /// Number of faults that hit.
    pub fn count(&self) -> u64 {
        self.hits.values().sum::<u64>() + self.failures.len() as u64
    }

    /// Lets `fault` befall the scene; whether it hit.
    pub fn meet(&mut self, scene: &Scene, fault: Fault) -> bool {
        let since = Instant::now();
        let end = scene.meet(fault);
        self.longest = self.longest.max(since.elapsed());
        match end {
            Ok(End::NotHit) => return false,
            Ok(End::Hit(operation, code)) => {
                let kind = operation.split(' ').nth(1).unwrap_or_default().to_owned();
                *self.hits.entry((kind, code)).or_default() += 1;
            }
            Err(error) => self
                .failures
                .push(format!("{}: {fault:?}: {error}", scene.command)),
        }
        true
    }
}

/// The kinds of fault: a passing error, a dying disk, a full disk.
pub const KINDS: [(Errno, Lasting); 3] = [
    (Errno::IO, Lasting::Once),
    (Errno::IO, Lasting::On),
    (Errno::NOSPC, Lasting::On),
];
