//! A run's event log: where the run is, for whoever does not own the store.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::machine::Machine;

/// One line of the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Seconds since 1970.
    pub at: f64,
    /// Which.
    pub event: String,
    /// What it says.
    #[serde(default)]
    pub data: Value,
}

/// Where a run is, by the last session in its log. Times are in seconds since 1970.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whereabouts {
    /// Name of the session, to which requests are addressed; none of sessions from before they had one.
    pub session: Option<String>,
    /// Process of the session.
    pub pid: Option<u32>,
    /// Its host.
    pub host: Option<String>,
    /// Its threads.
    pub threads: Option<u64>,
    /// The machines of all sessions so far, each once, in the order of first use; none of sessions from before it was
    /// recorded.
    pub machines: Vec<Machine>,
    /// When it began.
    pub begun: f64,
    /// The last sign of life.
    pub last: f64,
    /// Increments of the programme.
    pub of: u64,
    /// Packings needed, and how many are there.
    pub packings: Option<(u64, u64)>,
    /// The step that is running.
    pub step: Option<RunningStep>,
    /// Since when a pause is asked for.
    pub pausing: Option<f64>,
    /// Whether the pause has come to a standstill.
    pub still: bool,
    /// How the session ended, where it has: state and note.
    pub ended: Option<(String, String)>,
    /// What users noted, over all sessions.
    pub notes: Vec<String>,
    /// Increments done and when: at the beginning of the session, and after each commit.
    reached: Vec<(f64, f64)>,
}

/// A step in progress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunningStep {
    /// Its number.
    pub step: u32,
    /// Increment of the programme.
    pub increment: u64,
    /// Stage of the programme.
    pub stage: String,
    /// Part of the increment it covers.
    pub part: (f64, f64),
    /// When it began.
    pub since: f64,
    /// Attempts that failed.
    pub cuts: u32,
    /// Number of the wave that is out, from 0.
    pub wave: Option<u32>,
    /// Element tasks of the wave.
    pub tasks: u64,
    /// Force residual of the last wave that was assembled.
    pub residual: Option<f64>,
}

/// How many of the last commits the remaining time is judged by.
const RECENT: usize = 6;

/// What the log at `path` says; a log that is not there says nothing. Lines that do not read, as the last one of a
/// killed process may not, are passed over.
pub fn read(path: &Path) -> Whereabouts {
    let bytes = std::fs::read(path).unwrap_or_default();
    let lines = bytes.split(|&byte| byte == b'\n');
    let events = lines.filter_map(|line| serde_json::from_slice::<Event>(line).ok());
    let mut place = Whereabouts::default();
    for event in events {
        place.follow(&event);
    }
    place
}

/// The events of the log at `path`; one that is not there has none.
///
/// # Errors
/// The system does not give it.
pub fn list(path: &Path) -> io::Result<Vec<Event>> {
    Follower::from_start(path).look()
}

/// Reads a log while it grows.
#[derive(Debug)]
pub struct Follower {
    path: PathBuf,
    /// Bytes that were read.
    offset: u64,
    /// The beginning of a line whose end is not written yet.
    rest: Vec<u8>,
}

impl Follower {
    /// Follows the log at `path` from its first line.
    pub fn from_start(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            offset: 0,
            rest: Vec::new(),
        }
    }

    /// Follows the log at `path` from its present end.
    pub fn from_end(path: &Path) -> Self {
        let mut follower = Self::from_start(path);
        follower.next();
        follower
    }

    /// What was written since the last look; nothing where the log is not there or cannot be read for the moment.
    pub fn next(&mut self) -> Vec<Event> {
        self.look().unwrap_or_default()
    }

    /// The same, where it matters why there is nothing. Lines that do not read are passed over.
    fn look(&mut self) -> io::Result<Vec<Event>> {
        let known = self.rest.len();
        let read = File::open(&self.path).and_then(|mut file| {
            file.seek(SeekFrom::Start(self.offset))?;
            file.read_to_end(&mut self.rest)
        });
        match read {
            Ok(bytes) => self.offset += bytes as u64,
            Err(error) => {
                // What came before the error comes again with the next look.
                self.rest.truncate(known);
                return match error.kind() {
                    io::ErrorKind::NotFound => Ok(Vec::new()),
                    _ => Err(error),
                };
            }
        }
        let whole = self.rest.iter().rposition(|&byte| byte == b'\n');
        let lines: Vec<u8> = match whole {
            Some(end) => self.rest.drain(..=end).collect(),
            None => return Ok(Vec::new()),
        };
        Ok(lines
            .split(|&byte| byte == b'\n')
            .filter_map(|line| serde_json::from_slice::<Event>(line).ok())
            .collect())
    }
}

impl Whereabouts {
    /// Takes one more event into account.
    pub fn follow(&mut self, event: &Event) {
        let data = &event.data;
        let whole = |key: &str| data[key].as_u64();
        let real = |key: &str| data[key].as_f64();
        let text = |key: &str| data[key].as_str().unwrap_or_default().to_owned();
        if !matches!(event.event.as_str(), "note" | "renamed" | "imported") {
            // These are signs of their writer's life, not of the run's.
            self.last = event.at;
        }
        match event.event.as_str() {
            "session" => {
                let done = real("done").unwrap_or(0.0);
                let mut machines = std::mem::take(&mut self.machines);
                let machine = serde_json::from_value::<Machine>(data["machine"].clone()).ok();
                machines.extend(machine.filter(|machine| !machines.contains(machine)));
                *self = Self {
                    session: data["session"].as_str().map(str::to_owned),
                    host: data["host"].as_str().map(str::to_owned),
                    pid: whole("pid").and_then(|pid| u32::try_from(pid).ok()),
                    threads: whole("threads"),
                    machines,
                    begun: event.at,
                    last: event.at,
                    of: whole("of").unwrap_or(0),
                    notes: std::mem::take(&mut self.notes),
                    reached: vec![(event.at, done)],
                    ..Self::default()
                };
            }
            "preparing" => {
                self.packings = whole("packings").zip(whole("cached"));
            }
            "packing_ready" => {
                if let Some((_, there)) = &mut self.packings {
                    *there += 1;
                }
            }
            "step_started" => {
                let step = whole("step").unwrap_or(0) as u32;
                // A step that was cut begins again.
                let before = self.step.take().filter(|before| before.step == step);
                let (cuts, since) =
                    before.map_or((0, event.at), |before| (before.cuts, before.since));
                let part = |k: usize| data["part"][k].as_f64().unwrap_or(0.0);
                self.step = Some(RunningStep {
                    step,
                    increment: whole("increment").unwrap_or(0),
                    stage: text("stage"),
                    part: (part(0), part(1)),
                    since,
                    cuts,
                    ..RunningStep::default()
                });
            }
            "wave_started" => {
                if let Some(step) = &mut self.step {
                    step.wave = whole("wave").and_then(|wave| u32::try_from(wave).ok());
                    step.tasks = whole("tasks").unwrap_or(0);
                }
            }
            "iteration" => {
                if let Some(step) = &mut self.step {
                    step.residual = data["sweep"]["residual"].as_f64();
                }
            }
            "step_cut" => {
                if let Some(step) = &mut self.step {
                    step.cuts += 1;
                }
            }
            "step_committed" => {
                let summary = &data["summary"];
                let increment = summary["increment"].as_f64().unwrap_or(0.0);
                let position = summary["position"].as_f64().unwrap_or(0.0);
                self.reached.push((event.at, increment - 1.0 + position));
                self.step = None;
            }
            "asked" if data["request"] == "pause" => {
                self.pausing.get_or_insert(event.at);
            }
            "paused" => self.still = true,
            "continued" => {
                let lost = self.pausing.take().map_or(0.0, |since| event.at - since);
                self.still = false;
                // The pace is that of the time in which something ran.
                for (at, _) in &mut self.reached {
                    *at += lost;
                }
            }
            "note" => self.notes.push(text("text")),
            "ended" => self.ended = Some((text("state"), text("note"))),
            _ => {}
        }
    }

    /// Seconds from `now` to the end of the programme, at the pace of the last steps; `None` before the first commit of
    /// the session.
    pub fn remaining(&self, now: f64) -> Option<f64> {
        let (at, reached) = *self.reached.last()?;
        let (from, start) = self.reached[self.reached.len().saturating_sub(RECENT)];
        let pace = (at - from) / (reached - start);
        let left = (self.of as f64 - reached) * pace - (now - at);
        (self.reached.len() > 1 && pace.is_finite()).then_some(left.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(lines: &[&str]) -> Whereabouts {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.jsonl");
        std::fs::write(&path, lines.join("\n")).unwrap();
        read(&path)
    }

    const LINES: [&str; 6] = [
        r#"{"at":100,"event":"session","data":{"done":2,"of":10,"pid":7,"threads":2}}"#,
        r#"{"at":100,"event":"step_started","data":{"step":3,"increment":3,"of":10,"part":[0.0,1.0],"stage":"a"}}"#,
        r#"{"at":110,"event":"step_committed","data":{"summary":{"increment":3,"position":1.0}}}"#,
        r#"{"at":110,"event":"step_started","data":{"step":4,"increment":4,"of":10,"part":[0.0,1.0],"stage":"a"}}"#,
        r#"{"at":112,"event":"iteration","data":{"sweep":{"residual":0.5}}}"#,
        r#"{"at":113,"event":"wave_sta"#,
    ];

    #[test]
    fn the_torn_last_line_of_a_killed_process_hides_nothing_else() {
        let place = place(&LINES);
        let step = place.step.clone().unwrap();
        assert_eq!(
            (step.step, step.since, step.residual),
            (4, 110.0, Some(0.5))
        );
        assert_eq!((place.pid, place.last), (Some(7), 112.0));
        // 7 increments at 10 s, 5 s of them gone.
        assert_eq!(place.remaining(115.0), Some(65.0));
    }

    #[test]
    fn a_later_session_is_not_taken_for_the_one_that_died() {
        let again = r#"{"at":500,"event":"session","data":{"done":3,"of":10,"pid":8,"threads":1}}"#;
        let mut lines = LINES.to_vec();
        lines.push(again);
        let place = place(&lines);
        assert_eq!(
            (place.pid, place.step.clone(), place.begun),
            (Some(8), None, 500.0)
        );
        assert_eq!(place.remaining(510.0), None);
        assert_eq!(read(Path::new("no/such/file")), Whereabouts::default());
    }
}
