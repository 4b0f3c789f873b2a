//! Who works on the queue: the owner of the store says so in a file, so that those who queue something know whether it
//! will be taken.

use std::{fs, path::PathBuf};

use store::Queue;

use crate::run::control::Asker;

/// Says that this process takes what is queued, until it is dropped.
pub struct Mark {
    path: PathBuf,
}

impl Mark {
    /// Sets the mark; for the owner of the store.
    pub fn set(queue: &Queue) -> Self {
        let path = queue.worker();
        let text = serde_json::to_vec(&Asker::this()).unwrap_or_default();
        let folder = path.parent().map_or(Ok(()), fs::create_dir_all);
        if let Err(error) = folder.and_then(|()| fs::write(&path, text)) {
            // Who queues something is told that nobody takes it, which is too little, not wrong.
            tracing::warn!(path = %path.display(), %error, "it cannot be said that the queue is worked on");
        }
        Self { path }
    }
}

impl Drop for Mark {
    fn drop(&mut self) {
        // Best effort: a mark that stays is of a process that does not own the store.
        let _ = fs::remove_file(&self.path);
    }
}

/// Whether the owner of the store takes what is queued. A mark that another process left behind does not count.
pub fn worker(queue: &Queue, pid: Option<u32>, host: Option<&str>) -> Option<Asker> {
    let text = fs::read(queue.worker()).ok()?;
    let mark: Asker = serde_json::from_slice(&text).ok()?;
    (Some(mark.pid) == pid && Some(mark.host.as_str()) == host).then_some(mark)
}
