//! The writing side of a run's event log; [`super::events`] reads it.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    time::{SystemTime, UNIX_EPOCH},
};

use serde::Serialize;
use serde_json::json;

/// A log that lines are appended to.
pub struct EventLog {
    file: Option<File>,
}

impl EventLog {
    /// Opens the log at `path` for appending. A line that a killed process left torn is ended, so that it takes no
    /// later one with it.
    ///
    /// # Errors
    /// It cannot be opened or written.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut file = File::options()
            .create(true)
            .read(true)
            .append(true)
            .open(path)?;
        if file.seek(SeekFrom::End(0))? > 0 {
            file.seek(SeekFrom::End(-1))?;
            let mut last = [0];
            file.read_exact(&mut last)?;
            if last != *b"\n" {
                file.write_all(b"\n")?;
            }
        }
        Ok(Self { file: Some(file) })
    }

    /// Appends one line. A log that cannot be written any more is given up with a warning; the run does not depend
    /// on it.
    pub fn append(&mut self, event: &str, data: &impl Serialize) {
        let Some(file) = &mut self.file else { return };
        let at = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0.0, |d| d.as_secs_f64());
        let line = json!({ "at": at, "event": event, "data": data });
        // In one piece: who looks at the log meanwhile finds whole lines.
        if let Err(error) = file.write_all(format!("{line}\n").as_bytes()) {
            tracing::warn!(%error, "the event log cannot be written any more");
            self.file = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::events;

    #[test]
    fn the_line_that_a_kill_tore_does_not_swallow_the_next_session() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.jsonl");
        let session = |pid: u32| {
            let mut log = EventLog::open(&path).unwrap();
            log.append("session", &json!({ "pid": pid, "done": 0, "of": 3 }));
        };
        session(7);
        let whole = std::fs::read(&path).unwrap();
        let torn = &whole[..whole.len() / 2];
        std::fs::write(&path, [&whole, torn].concat()).unwrap();
        session(8);
        assert_eq!(events::read(&path).pid, Some(8));
        // A whole log is left as it is.
        session(9);
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 4, "{text}");
    }
}
