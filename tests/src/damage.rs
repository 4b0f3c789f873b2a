//! Bytes of a store flipped and files cut, and what the program makes of it.
//!
//! A damage may end in three ways: it is *named* and what it touches refused; it is *repaired*; or it is *without effect*.
//! Repaired and without effect mean that everything the store is then asked, and every run taken to its end, comes to
//! the bits that an undamaged store comes to. Anything else is a failure: a panic, a store that looks empty, another result.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::folder;
use crate::history::{self, Steps};
use crate::inputs;
use crate::ordeal::{Blow, Ordeal};
use crate::random::Random;
use crate::workplace::{Outcome, Signal, Workplace};

/// A run that is complete, pruned in part, and has a branch.
const WHOLE: &str = "whole";
/// Its branch.
const BRANCH: &str = "branch";
/// A run that was killed in the midst of a wave.
const HALF: &str = "half";

/// A run that waits in the queue; whoever resumes another computes it too.
const QUEUED: &str = "queued";

/// The longest that a verb may take on a damaged store.
const LIMIT: Duration = Duration::from_secs(100);

/// What the store is asked after each damage, in this order: looking comes before what may repair.
const ASKED: [&str; 10] = [
    "runs",
    "show whole",
    "show branch",
    "status",
    "queue",
    "store check --deep",
    "resume half --threads 1",
    "verify whole",
    "verify branch",
    "verify half",
];

/// A store to be damaged again and again.
pub struct Original {
    place: Workplace,
    /// The files of the store, from its folder.
    files: Vec<PathBuf>,
    /// What an undamaged one answers to each of [`ASKED`].
    answers: Vec<String>,
    /// What it holds in the end.
    end: BTreeMap<String, Steps>,
}

/// What a file of a store is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A sealed step.
    Pack,
    /// The journal of a running wave.
    Part,
    /// `run.rmp`, `state.rmp` and their like, and the stub of a pruned step.
    Record,
    /// A file of sled.
    Database,
    /// A packing.
    Cache,
    /// The event log.
    Events,
    /// `FORMAT`.
    Format,
    /// Work that waits.
    Queue,
    /// `LOCK`.
    Lock,
    /// Any other.
    Other,
}

/// How a damage ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// Named, and what it touches refused.
    Refused,
    /// Named, and everything came to the bits of an undamaged store.
    Repaired,
    /// Not named, and everything came to the bits of an undamaged store.
    WithoutEffect,
}

/// What was damaged and how it ended.
#[derive(Clone, Debug)]
pub struct Case {
    /// The damage in words.
    pub what: String,
    /// The kind of file.
    pub kind: Kind,
    /// How it ended.
    pub fate: Result<Fate, String>,
}

/// Many cases counted.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// How often a kind of file ended so.
    pub counts: BTreeMap<(Kind, Fate), u32>,
    /// What was not as it should be.
    pub failures: Vec<String>,
}

impl Table {
    /// Counts a case.
    pub fn add(&mut self, case: Case) {
        match case.fate {
            Ok(fate) => *self.counts.entry((case.kind, fate)).or_default() += 1,
            Err(why) => self.failures.push(format!("{}: {why}", case.what)),
        }
    }

    /// The number of cases that ended so.
    pub fn of(&self, fate: Fate) -> u32 {
        let counts = self.counts.iter().filter(|((_, f), _)| *f == fate);
        counts.map(|(_, count)| count).sum()
    }
}

impl Original {
    /// A store with a bit of everything, and what it comes to undamaged.
    pub fn new() -> Self {
        let place = Workplace::new();
        place.write("whole.yaml", &inputs::least(WHOLE, 5));
        place.run(words("submit whole.yaml")).success();
        place
            .run(words(
                "branch whole@1 --ramp shortening=0 --steps 2 --name branch",
            ))
            .success();
        place.run(words("prune whole --keep-last 1")).success();
        kill_half_way(&place);
        place.write("queued.yaml", &inputs::least(QUEUED, 1));
        place.run(words("submit queued.yaml --queue")).success();
        let store = place.store();
        let files = folder::files_below(&store).into_iter();
        let files = files.map(|file| {
            let inside = file.strip_prefix(&store).expect("it lies below");
            inside.to_owned()
        });
        let mut original = Self {
            files: files.collect(),
            answers: Vec::new(),
            end: BTreeMap::new(),
            place,
        };
        let calm = original.place.copy();
        let answers = ASKED.map(|command| plain(&calm, &calm.run(words(command)).success()));
        original.answers = answers.to_vec();
        original.end = history::everything(&calm.store()).expect("an undamaged store is sound");
        original
    }

    /// Its files, from the folder of the store.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Damages the file with this number (they are gone round) in a copy, and asks everything.
    pub fn damage(&self, number: usize, random: &mut Random) -> Case {
        let file = &self.files[number % self.files.len()];
        let place = self.place.copy();
        let what = ruin(&place.store().join(file), random);
        let what = format!("{what} {}", file.display());
        let kind = Kind::of(file);
        let fate = self.fate(&place, file, kind);
        Case { what, kind, fate }
    }

    fn fate(&self, place: &Workplace, file: &Path, kind: Kind) -> Result<Fate, String> {
        let (mut said, mut refused) = (String::new(), false);
        let mut other = Vec::new();
        for (command, expected) in ASKED.iter().zip(&self.answers) {
            let outcome = place.start(words(command)).end(LIMIT)?;
            let answer = plain(place, &outcome);
            match outcome.code {
                Some(0) if *command == "runs" => {
                    let mut runs = [WHOLE, BRANCH, HALF].into_iter();
                    if let Some(run) = runs.find(|run| !outcome.out.contains(run)) {
                        return Err(format!("`{run}` is not listed: {}", outcome.out));
                    }
                }
                Some(0) => {}
                Some(1 | 3) if outcome.err.contains("Error: ") => refused = true,
                _ => return Err(format!("{command} ended otherwise: {outcome:#?}")),
            }
            if outcome.code == Some(0) && answer != *expected {
                other.push(format!("{command} says {answer} and not {expected}"));
            }
            said += &outcome.out;
            said += &outcome.err;
        }
        let named = said.contains(&*file.to_string_lossy())
            || (kind == Kind::Database && said.contains("/meta: "))
            // A run's records are restored as a whole.
            || file.parent().is_some_and(|run| said.contains(&format!("{}: the run's record", run.display())))
            || (kind == Kind::Format && (said.contains("FORMAT") || said.contains("its format is")));
        match history::everything(&place.store()) {
            Ok(end) if end == self.end && !refused => match (named, other.pop()) {
                (true, _) => Ok(Fate::Repaired),
                (false, None) => Ok(Fate::WithoutEffect),
                // What happened when is no result, and has no checksum; what a journal lost is computed again, and
                // `status` is right to say so.
                (false, Some(_)) if matches!(kind, Kind::Events | Kind::Part) => {
                    Ok(Fate::WithoutEffect)
                }
                (false, Some(other)) => Err(format!("nobody names it, and {other}")),
            },
            Ok(end) if !refused => Err(format!(
                "another result, {}, and not {}: {said}",
                history::in_words(&end),
                history::in_words(&self.end)
            )),
            _ if refused && named => Ok(Fate::Refused),
            other => Err(format!(
                "refused {refused}, named {named}, {other:?}: {said}"
            )),
        }
    }
}

impl Default for Original {
    fn default() -> Self {
        Self::new()
    }
}

impl Kind {
    fn of(file: &Path) -> Self {
        let name = file.to_string_lossy();
        match file.extension().and_then(|e| e.to_str()) {
            _ if name.starts_with("meta/") => Self::Database,
            _ if name.starts_with("cache/") => Self::Cache,
            _ if name.starts_with("queue/") => Self::Queue,
            _ if name == "FORMAT" => Self::Format,
            _ if name == "LOCK" => Self::Lock,
            Some("pack") => Self::Pack,
            Some("part") => Self::Part,
            Some("rmp" | "pruned") => Self::Record,
            Some("jsonl") => Self::Events,
            _ => Self::Other,
        }
    }
}

fn words(command: &str) -> Vec<&str> {
    command.split(' ').collect()
}

/// What a verb says of a run, without what depends on the clock and the place.
fn plain(place: &Workplace, outcome: &Outcome) -> String {
    let text = outcome.out.replace(&place.dir().display().to_string(), "");
    let lines = text.lines().filter(|line| !line.contains(HALF));
    let timeless = lines.map(|line| {
        let words = line.split_whitespace();
        words.collect::<Vec<_>>().join(" ")
    });
    timeless.collect::<Vec<_>>().join("\n")
}

/// Kills a run that has committed something and is in the midst of a wave.
fn kill_half_way(place: &Workplace) {
    place.write("half.yaml", &inputs::least(HALF, 3));
    let ordeal = Ordeal {
        input: Path::new("half.yaml"),
        run: HALF,
        threads: 1,
    };
    for _ in 0..50 {
        let blow = Blow {
            events: 10,
            then: Duration::ZERO,
            signal: Signal::KILL,
        };
        let killed = ordeal.hit(place, blow).signal == Some(9);
        let files = folder::files_below(&place.store());
        let journalled = files
            .iter()
            .any(|file| file.extension().is_some_and(|e| e == "part"));
        let packs = files
            .iter()
            .filter(|file| file.ends_with("half/00000001.pack"));
        if killed && journalled && packs.count() > 0 {
            return;
        }
        place.start(words("delete half")).wait();
    }
    panic!("no kill fell into a wave of a later step");
}

/// Flips a bit, changes a byte, or cuts the file; says which.
fn ruin(file: &Path, random: &mut Random) -> String {
    let mut bytes = fs::read(file).expect("a file of the store can be read");
    let at = random.below(bytes.len() as u64) as usize;
    let what = match (random.below(3), bytes.get_mut(at)) {
        (0, _) | (_, None) => {
            bytes.truncate(at);
            format!("cut at {at} of {}", bytes.len())
        }
        (1, Some(byte)) => {
            *byte ^= 1 << random.below(8);
            format!("a bit flipped at {at} in")
        }
        (_, Some(byte)) => {
            *byte ^= 1 + random.below(255) as u8;
            format!("a byte changed at {at} in")
        }
    };
    fs::write(file, bytes).expect("a file of the store can be written");
    what
}
