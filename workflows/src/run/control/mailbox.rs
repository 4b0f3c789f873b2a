//! Requests to the process that computes a run: small files in the folder `control` of the run, written by any process
//! that sees the folder, on whatever host, and taken by the one that they are addressed to.
//!
//! A request names the session it means. One that a session did not live to see stops no later one: whoever finds a
//! request for another session removes it.

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Stop the run.
    Cancel(Urgency, Extent),
    /// Start no new task until told to go on.
    Pause,
    /// Go on after a pause.
    Continue,
}

impl Order {
    /// One word for logs: the verb that asks for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Cancel(..) => "cancel",
            Self::Pause => "pause",
            Self::Continue => "continue",
        }
    }
}

/// How a run is stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Urgency {
    /// Tasks that run may end.
    InOrder,
    /// Tasks that run are given up.
    AtOnce,
}

/// What a cancel reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// The run; its process goes on with what else it has to compute.
    Run,
    /// The run and the process that computes it.
    Process,
}

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Asker {
    /// Its process.
    pub pid: u32,
    /// Its host.
    pub host: String,
}

impl Asker {
    /// This process.
    pub fn this() -> Self {
        Self {
            pid: std::process::id(),
            host: crate::machine::host(),
        }
    }
}

impl fmt::Display for Asker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "process {} on {}", self.pid, self.host)
    }
}

/// A request as it lies in its file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// The session that is meant, as its event log names it.
    pub session: String,
    /// What is asked for.
    pub order: Order,
    /// Who asks.
    pub by: Asker,
}

/// Leaves a request in `folder`, whole or not at all; returns its file.
///
/// # Errors
/// It cannot be written.
pub fn send(folder: &Path, request: &Request) -> io::Result<PathBuf> {
    fs::create_dir_all(folder)?;
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_nanos());
    // Names ascend with time, so that requests are acted upon in the order in which they were made.
    let name = format!("{now:020}-{}", request.by.pid);
    let path = folder.join(format!("{name}.json"));
    let temporary = folder.join(format!("{name}.tmp"));
    fs::write(&temporary, serde_json::to_vec(request)?)?;
    fs::rename(&temporary, &path)?;
    Ok(path)
}

/// The requests to one session.
#[derive(Debug)]
pub struct Mailbox {
    folder: PathBuf,
    session: String,
}

impl Mailbox {
    /// The mailbox of `session`. What lies in `folder` was meant for an earlier one and is removed.
    pub fn open(folder: &Path, session: &str) -> Self {
        let mailbox = Self {
            folder: folder.to_owned(),
            session: session.to_owned(),
        };
        for path in mailbox.files() {
            remove(&path);
        }
        mailbox
    }

    /// Takes the requests that have come, oldest first.
    pub fn take(&self) -> Vec<Request> {
        let mut found = Vec::new();
        for path in self.files() {
            if path.extension().is_none_or(|extension| extension != "json") {
                continue;
            }
            let request = fs::read(&path).map(|bytes| serde_json::from_slice::<Request>(&bytes));
            remove(&path);
            match request {
                Ok(Ok(request)) if request.session == self.session => found.push(request),
                Ok(Ok(_)) => {}
                Ok(Err(error)) => {
                    tracing::warn!(path = %path.display(), %error, "a request cannot be read");
                }
                Err(error) => {
                    tracing::warn!(path = %path.display(), %error, "a request cannot be read");
                }
            }
        }
        found
    }

    /// The files in the folder in the order of their names; none where there is no folder, as there is not before the
    /// first request.
    fn files(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        files.sort();
        files
    }
}

fn remove(path: &Path) {
    if let Err(error) = fs::remove_file(path)
        && error.kind() != io::ErrorKind::NotFound
    {
        tracing::warn!(path = %path.display(), %error, "a request cannot be removed");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(session: &str, order: Order) -> Request {
        Request {
            session: session.to_owned(),
            order,
            by: Asker::this(),
        }
    }

    #[test]
    fn requests_are_taken_once_and_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("control");
        let mailbox = Mailbox::open(&folder, "a");
        assert_eq!(mailbox.take(), []);
        let orders = [
            Order::Pause,
            Order::Continue,
            Order::Cancel(Urgency::AtOnce, Extent::Run),
        ];
        for order in orders {
            send(&folder, &request("a", order)).unwrap();
        }
        assert_eq!(mailbox.take(), orders.map(|order| request("a", order)));
        assert_eq!(mailbox.take(), []);
    }

    #[test]
    fn a_request_to_a_dead_session_does_not_stop_the_next_one() {
        let dir = tempfile::tempdir().unwrap();
        let cancel = Order::Cancel(Urgency::InOrder, Extent::Run);
        send(dir.path(), &request("dead", cancel)).unwrap();
        fs::write(dir.path().join("torn.tmp"), "{").unwrap();
        let mailbox = Mailbox::open(dir.path(), "alive");
        assert_eq!(mailbox.take(), []);
        // Also where it comes late.
        send(dir.path(), &request("dead", cancel)).unwrap();
        fs::write(dir.path().join("nonsense.json"), "{").unwrap();
        assert_eq!(mailbox.take(), []);
        assert_eq!(mailbox.files(), Vec::<PathBuf>::new());
    }
}
