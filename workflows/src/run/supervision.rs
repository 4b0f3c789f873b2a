//! What a run knows of a supervisor: the ticket of its work, and the restarts that are written into its log.

use std::time::{Duration, SystemTime};

use serde_json::json;
use store::{RunState, Store};

use super::{Context, event_log::EventLog, events};

/// What a supervised process is told.
#[derive(Debug, Clone)]
pub struct Supervision {
    /// Names the work, the same in every life of the process.
    pub ticket: String,
    /// When to stop in order, at the latest.
    pub deadline: Option<SystemTime>,
}

/// A restart to come.
#[derive(Debug, Clone)]
pub struct Restart {
    /// The process that died.
    pub pid: u32,
    /// Of what.
    pub why: String,
    /// The number of the restart, from 1.
    pub number: u32,
    /// The most there may be.
    pub of: u32,
    /// How long it is waited.
    pub pause: Duration,
}

/// Writes a restart into the logs of the runs that the dead process was at; returns their names.
pub fn note_restart(context: &Context<'_>, restart: &Restart) -> Vec<String> {
    let Ok(store) = Store::open_read_only(&context.store) else {
        return Vec::new();
    };
    let mut names = Vec::new();
    for id in store.run_names().unwrap_or_default() {
        let Ok(record) = store.run(&id) else { continue };
        if record.state != RunState::Running {
            continue;
        }
        let path = store.events_path(&id);
        let place = events::read(&path);
        if place.pid != Some(restart.pid) || place.ended.is_some() {
            continue;
        }
        names.push(format!("`{}`", record.shown()));
        match EventLog::open(&path) {
            Ok(mut log) => log.append(
                "restart",
                &json!({
                    "why": format!("process {} {}", restart.pid, restart.why),
                    "number": restart.number,
                    "of": restart.of,
                    "pause_s": restart.pause.as_secs_f64(),
                }),
            ),
            Err(error) => tracing::warn!(%error, "a restart could not be logged"),
        }
    }
    names
}
