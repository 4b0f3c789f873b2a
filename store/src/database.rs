//! All access to sled, on a thread of its own.
//!
//! sled 0.34 reports damage by panicking and may hang on a full disk. Nothing here can take the caller
//! with it: a panic is caught, a hang is waited for no longer than [`PATIENCE`], and either ends as an
//! error after which the database counts as lost. It can be lost: the packs can rebuild it.
//!
//! One tree, big-endian keys, one batch and one flush per change; keys and values are laid down in
//! `docs/design/store.md`.

mod rows;

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

pub(crate) use rows::{Change, Contents, INLINE, RunRow, StepRow};

/// How long the database may take for anything.
const PATIENCE: Duration = Duration::from_secs(30);
/// How long it may take to close when it has not answered before: it will not now.
const LAST_PATIENCE: Duration = Duration::from_secs(1);
/// How long to wait for sled's own lock: it is released a moment after its last user is gone.
const LOCK_PATIENCE: Duration = Duration::from_secs(3);
/// sled's memory: the database is an index, the bulk never goes through it.
const CACHE_BYTES: u64 = 16 << 20;

/// Name of the thread, by which a panic hook can tell sled's reports of damage from real panics.
pub(crate) const THREAD: &str = "store-meta";

struct Request {
    changes: Vec<Change>,
    reply: SyncSender<Result<(), String>>,
}

/// An open database.
pub(crate) struct Database {
    requests: Option<SyncSender<Request>>,
    /// Disconnects when the thread has closed sled.
    closed: Receiver<()>,
    /// How long to wait for that.
    closing: Cell<Duration>,
}

impl Database {
    /// Opens or creates the database in `dir` and reads all of it.
    pub(crate) fn open(dir: &Path) -> Result<(Self, Contents), String> {
        let (opened_sender, opened) = sync_channel(1);
        let (requests, inbox) = sync_channel(1);
        let (closed_sender, closed) = sync_channel::<()>(1);
        let dir = dir.to_owned();
        thread::Builder::new()
            .name(THREAD.to_owned())
            .spawn(move || {
                serve(&dir, &opened_sender, &inbox);
                drop(closed_sender);
            })
            .map_err(|error| format!("no thread for it: {error}"))?;
        let contents = opened.recv_timeout(PATIENCE).map_err(|_| impatient())??;
        let requests = Some(requests);
        let closing = Cell::new(PATIENCE);
        let database = Self {
            requests,
            closed,
            closing,
        };
        Ok((database, contents))
    }

    /// Makes the changes in one batch and flushes. After an error the database is lost.
    pub(crate) fn apply(&self, changes: Vec<Change>) -> Result<(), String> {
        let (reply, answer) = sync_channel(1);
        let request = Request { changes, reply };
        match &self.requests {
            Some(requests) if requests.send(request).is_ok() => {}
            _ => return Err("its thread has ended".to_owned()),
        }
        answer.recv_timeout(PATIENCE).map_err(|_| {
            self.closing.set(LAST_PATIENCE);
            impatient()
        })?
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        // The thread ends when the channel does; sled's files are free when the thread has ended.
        self.requests = None;
        if self.closed.recv_timeout(self.closing.get()) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("the database does not close");
        }
    }
}

fn impatient() -> String {
    format!("it did not answer within {} s", PATIENCE.as_secs())
}

fn serve(dir: &Path, opened: &SyncSender<Result<Contents, String>>, inbox: &Receiver<Request>) {
    let db = match guarded(|| open_and_read(dir)) {
        Ok((db, contents)) => {
            if opened.send(Ok(contents)).is_err() {
                return;
            }
            db
        }
        Err(error) => {
            let _ = opened.send(Err(error));
            return;
        }
    };
    for request in inbox {
        let result = guarded(|| write(&db, &request.changes));
        let lost = result.is_err();
        let _ = request.reply.send(result);
        if lost {
            break;
        }
    }
    let _ = guarded(move || {
        drop(db);
        Ok(())
    });
}

/// Runs `f`; a panic becomes an error.
fn guarded<T>(f: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    // Nothing is looked at again after a panic: the caller drops the database.
    catch_unwind(AssertUnwindSafe(f)).unwrap_or_else(|panic| Err(panic_text(panic.as_ref())))
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "it panicked".to_owned())
}

fn open_and_read(dir: &Path) -> Result<(sled::Db, Contents), String> {
    let config = sled::Config::new()
        .path(dir)
        .cache_capacity(CACHE_BYTES)
        .flush_every_ms(None);
    let since = Instant::now();
    let db = loop {
        match config.open() {
            Ok(db) => break db,
            Err(error) => {
                let text = error.to_string();
                if !text.contains("lock") || since.elapsed() > LOCK_PATIENCE {
                    return Err(text);
                }
                thread::sleep(Duration::from_millis(20));
            }
        }
    };
    let mut contents = Contents::default();
    for row in db.iter() {
        let (key, value) = row.map_err(|error| error.to_string())?;
        contents.take(&key, &value)?;
    }
    Ok((db, contents))
}

fn write(db: &sled::Db, changes: &[Change]) -> Result<(), String> {
    let mut batch = sled::Batch::default();
    for change in changes {
        match change.to_bytes() {
            (key, Some(value)) => batch.insert(key, value),
            (key, None) => batch.remove(key),
        }
    }
    db.apply_batch(batch).map_err(|error| error.to_string())?;
    db.flush().map_err(|error| error.to_string()).map(drop)
}
