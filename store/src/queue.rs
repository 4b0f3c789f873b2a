//! The queue: work that waits for whoever owns the store, left by any process without the lock.
//!
//! An entry is a file that is whole or not there. The owner marks it as taken before it acts upon it and removes it when
//! the work is done, so that a kill loses none: a taken entry is found by the next owner, who knows what became of it.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::{Damage, IoFailure, QueueError, ReadError};
use crate::files;
use crate::frame::{self, Frame, FrameId};
use crate::id::Digest;
use crate::layout::Layout;

const MAGIC: [u8; 8] = *b"FDFQUEU1";
/// The one frame of an entry.
const ENTRY: FrameId = FrameId::new(1, 0);

/// Number of an entry: entries are worked on in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EntryId(pub u64);

impl fmt::Display for EntryId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// How an entry stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EntryState {
    /// Nobody has begun it.
    Waiting,
    /// An owner has begun it, this one or one that is gone.
    Taken,
    /// It could not be done, in these words; it stays until it is removed.
    Failed(String),
}

/// An entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QueueEntry {
    /// Its number.
    pub id: EntryId,
    /// How it stands.
    pub state: EntryState,
    /// What it says; the damage where it cannot be read.
    pub payload: Result<Vec<u8>, String>,
}

/// The queue of a store. Looking at it and adding to it takes no lock.
#[derive(Clone, Debug)]
pub struct Queue {
    folder: PathBuf,
}

impl Queue {
    /// The queue of the store in `dir`.
    pub fn of(dir: &Path) -> Self {
        Self {
            folder: Layout::new(dir).queue(),
        }
    }

    /// Adds an entry behind all others. It is there for good, also after a power cut, when this returns `Ok`.
    ///
    /// # Errors
    /// It cannot be written; nothing of it is left then.
    pub fn put(&self, payload: Vec<u8>) -> Result<EntryId, QueueError> {
        files::create_folder(&self.folder)?;
        let mut bytes = MAGIC.to_vec();
        frame::encode(&Frame::content(ENTRY, payload), &mut bytes)?;
        let temporary = self
            .folder
            .join(format!("{}-{:p}.tmp", std::process::id(), &bytes));
        files::write_synced(&temporary, &bytes)?;
        let placed = self.place(&temporary);
        // It has its own name by now, or none.
        let _ = fs::remove_file(&temporary);
        let id = placed?;
        files::sync_folder(&self.folder)?;
        // Only so that a number is not given twice, which would be confusing but no harm.
        if let Err(error) = files::write_atomic(&self.last(), format!("{id}\n").as_bytes()) {
            tracing::warn!(%error, "the last number of the queue could not be kept");
        }
        Ok(id)
    }

    /// All entries in their order, damaged ones included.
    ///
    /// # Errors
    /// The system does not give the folder or an entry.
    pub fn entries(&self) -> Result<Vec<QueueEntry>, IoFailure> {
        let mut entries = Vec::new();
        for (id, kind) in self.files()? {
            let path = self.path(id, kind);
            let state = match kind {
                Kind::Waiting => EntryState::Waiting,
                Kind::Taken => EntryState::Taken,
                Kind::Failed => {
                    let why = fs::read(self.path(id, Kind::Why)).unwrap_or_default();
                    EntryState::Failed(String::from_utf8_lossy(&why).trim_end().to_owned())
                }
                Kind::Why => continue,
            };
            let payload = match read(&path) {
                Ok(payload) => Ok(payload),
                // It was taken or removed meanwhile.
                Err(_) if !path.exists() => continue,
                // A disk that does not give it now may give it later: it is not judged by that.
                Err(ReadError::Io(error)) => return Err(error),
                Err(damage) => Err(damage.to_string()),
            };
            entries.push(QueueEntry { id, state, payload });
        }
        Ok(entries)
    }

    /// Marks a waiting entry as taken; `false` where somebody removed it before. For the owner of the store.
    ///
    /// # Errors
    /// It cannot be renamed.
    pub fn take(&self, id: EntryId) -> Result<bool, IoFailure> {
        self.rename(id, Kind::Waiting, Kind::Taken)
    }

    /// Removes an entry that is done. For the owner of the store.
    ///
    /// # Errors
    /// It cannot be removed.
    pub fn finish(&self, id: EntryId) -> Result<(), IoFailure> {
        files::remove_file(&self.path(id, Kind::Taken))
    }

    /// Keeps a taken entry as one that could not be done, and why. For the owner of the store.
    ///
    /// # Errors
    /// The reason cannot be written, or the entry not be renamed.
    pub fn fail(&self, id: EntryId, why: &str) -> Result<(), IoFailure> {
        files::write_atomic(&self.path(id, Kind::Why), why.as_bytes())?;
        self.rename(id, Kind::Taken, Kind::Failed).map(drop)
    }

    /// Removes an entry that is in this state; `false` where it is not, or not any more.
    ///
    /// # Errors
    /// It cannot be removed.
    pub fn remove(&self, id: EntryId, state: &EntryState) -> Result<bool, IoFailure> {
        let kind = match state {
            EntryState::Waiting => Kind::Waiting,
            EntryState::Taken => Kind::Taken,
            EntryState::Failed(_) => Kind::Failed,
        };
        let path = self.path(id, kind);
        let removed = match fs::remove_file(&path) {
            Ok(()) => true,
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(IoFailure::of("remove", &path)(error)),
        };
        files::remove_file(&self.path(id, Kind::Why))?;
        Ok(removed)
    }

    /// The file in which the process that works on the queue says who it is.
    pub fn worker(&self) -> PathBuf {
        self.folder.join("WORKER")
    }

    /// Gives the file at `temporary` the first free number behind all others.
    fn place(&self, temporary: &Path) -> Result<EntryId, IoFailure> {
        loop {
            let last = self.files()?.last().map_or(0, |(id, _)| id.0);
            let kept = fs::read_to_string(self.last()).unwrap_or_default();
            let kept: u64 = kept.trim().parse().unwrap_or(0);
            let id = EntryId(last.max(kept).saturating_add(1));
            let path = self.path(id, Kind::Waiting);
            // Unlike a rename, a link replaces nothing: of two that want one number, one is told.
            match fs::hard_link(temporary, &path) {
                Ok(()) => return Ok(id),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(IoFailure::of("link", &path)(error)),
            }
        }
    }

    fn rename(&self, id: EntryId, from: Kind, to: Kind) -> Result<bool, IoFailure> {
        let path = self.path(id, from);
        match fs::rename(&path, self.path(id, to)) {
            Ok(()) => files::sync_folder(&self.folder).map(|()| true),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(IoFailure::of("rename", &path)(error)),
        }
    }

    fn last(&self) -> PathBuf {
        self.folder.join("LAST")
    }

    fn path(&self, id: EntryId, kind: Kind) -> PathBuf {
        self.folder.join(format!("{:08}.{}", id.0, kind.ending()))
    }

    /// The files of entries, in the order of their numbers.
    fn files(&self) -> Result<Vec<(EntryId, Kind)>, IoFailure> {
        let names = files::list(&self.folder)?;
        let mut found: Vec<_> = names
            .iter()
            .filter_map(|name| {
                let (number, ending) = name.split_once('.')?;
                let kind = Kind::ALL.into_iter().find(|kind| kind.ending() == ending)?;
                let id = EntryId(number.parse().ok()?);
                (format!("{:08}", id.0) == number).then_some((id, kind))
            })
            .collect();
        found.sort();
        Ok(found)
    }
}

/// The payload of an entry's file, checked.
fn read(path: &Path) -> Result<Vec<u8>, ReadError> {
    let bytes = fs::read(path).map_err(IoFailure::of("read", path))?;
    let damaged = |what: &str| Damage::new(path, what, "remove it and queue the work again");
    let framed = bytes
        .strip_prefix(&MAGIC)
        .ok_or_else(|| damaged("it does not begin as an entry of the queue"))?;
    let (header, stored) = frame::parse(framed).map_err(damaged)?;
    let payload = frame::decode(&header, stored)
        .filter(|payload| header.id == ENTRY && Digest::of(payload) == header.hash);
    Ok(payload.ok_or_else(|| damaged("its hash does not fit"))?)
}

/// What a file of the queue is, by the end of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Waiting,
    Taken,
    Failed,
    Why,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Waiting, Self::Taken, Self::Failed, Self::Why];

    fn ending(self) -> &'static str {
        match self {
            Self::Waiting => "job",
            Self::Taken => "taken",
            Self::Failed => "failed",
            Self::Why => "why",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(queue: &Queue) -> Vec<u64> {
        let entries = queue.entries().unwrap();
        entries.iter().map(|entry| entry.id.0).collect()
    }

    #[test]
    fn entries_keep_their_order_and_no_number_is_given_twice() {
        let dir = tempfile::tempdir().unwrap();
        let queue = Queue::of(dir.path());
        assert_eq!(ids(&queue), [0; 0]);
        for number in 1..=3 {
            assert_eq!(queue.put(vec![number as u8]).unwrap(), EntryId(number));
        }
        assert!(queue.remove(EntryId(3), &EntryState::Waiting).unwrap());
        assert!(!queue.remove(EntryId(3), &EntryState::Waiting).unwrap());
        assert_eq!(queue.put(vec![4]).unwrap(), EntryId(4));
        assert_eq!(ids(&queue), [1, 2, 4]);
        assert_eq!(queue.entries().unwrap()[2].payload, Ok(vec![4]));
    }

    #[test]
    fn many_who_queue_at_once_each_get_a_number_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        let queue = Queue::of(dir.path());
        std::thread::scope(|scope| {
            for thread in 0..8_u8 {
                let queue = &queue;
                scope.spawn(move || {
                    for n in 0..10 {
                        queue.put(vec![thread, n]).unwrap();
                    }
                });
            }
        });
        let entries = queue.entries().unwrap();
        let mut payloads: Vec<_> = entries.into_iter().map(|e| e.payload.unwrap()).collect();
        payloads.sort();
        payloads.dedup();
        assert_eq!(payloads.len(), 80);
        assert_eq!(ids(&queue), Vec::from_iter(1..=80));
    }

    #[test]
    fn an_entry_is_removed_by_its_user_or_taken_by_the_owner_but_not_both() {
        let dir = tempfile::tempdir().unwrap();
        let queue = Queue::of(dir.path());
        let id = queue.put(vec![1]).unwrap();
        assert!(queue.take(id).unwrap());
        assert!(!queue.remove(id, &EntryState::Waiting).unwrap());
        assert!(!queue.take(id).unwrap());
        assert_eq!(queue.entries().unwrap()[0].state, EntryState::Taken);
        queue.fail(id, "its parent is gone").unwrap();
        let failed = EntryState::Failed("its parent is gone".to_owned());
        assert_eq!(queue.entries().unwrap()[0].state, failed);
        assert!(queue.remove(id, &failed).unwrap());
        assert_eq!(ids(&queue), [0; 0]);
        assert_eq!(
            fs::read_dir(dir.path().join("queue")).unwrap().count(),
            1,
            "LAST"
        );
        let id = queue.put(vec![2]).unwrap();
        assert!(queue.take(id).unwrap());
        queue.finish(id).unwrap();
        assert_eq!(ids(&queue), [0; 0]);
    }

    #[test]
    fn a_damaged_entry_is_named_and_hides_no_other() {
        let dir = tempfile::tempdir().unwrap();
        let queue = Queue::of(dir.path());
        for payload in [vec![7; 40], vec![8; 40]] {
            queue.put(payload).unwrap();
        }
        let path = dir.path().join("queue/00000001.job");
        let bytes = fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x10;
            fs::write(&path, flipped).unwrap();
            let entries = queue.entries().unwrap();
            assert!(entries[0].payload.is_err(), "byte {at}");
            assert_eq!(entries[1].payload, Ok(vec![8; 40]));
        }
        fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        let damage = queue.entries().unwrap()[0].payload.clone().unwrap_err();
        assert!(damage.contains("00000001.job"), "{damage}");
    }
}
