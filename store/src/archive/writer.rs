//! Writes an archive under a temporary name.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::{END, ENTRY, Head, MAGIC};
use crate::error::IoFailure;
use crate::files;
use crate::record::to_rmp;

/// An archive being written. Dropped before it is finished, it leaves nothing.
pub(super) struct ArchiveWriter {
    path: PathBuf,
    tmp: PathBuf,
    out: BufWriter<File>,
    hasher: blake3::Hasher,
    entries: u64,
    bytes: u64,
    finished: bool,
}

impl ArchiveWriter {
    pub(super) fn create(path: &Path) -> Result<Self, IoFailure> {
        let tmp = files::temporary(path);
        let file = File::create(&tmp).map_err(IoFailure::of("create", &tmp))?;
        let mut writer = Self {
            path: path.to_owned(),
            tmp,
            out: BufWriter::with_capacity(1 << 18, file),
            hasher: blake3::Hasher::new(),
            entries: 0,
            bytes: 0,
            finished: false,
        };
        writer.put(&MAGIC)?;
        Ok(writer)
    }

    /// Adds an entry whose content is in memory.
    pub(super) fn entry(&mut self, head: &Head, content: &[u8]) -> Result<(), IoFailure> {
        self.begin(head, content.len() as u64)?;
        self.put(content)
    }

    /// Adds an entry whose content is the file at `path` as far as it is now; one that grows meanwhile, as an event log
    /// does, is cut there.
    pub(super) fn entry_of_file(&mut self, head: &Head, path: &Path) -> Result<(), IoFailure> {
        let failed = || IoFailure::of("read", path);
        let mut file = File::open(path).map_err(failed())?;
        let len = file.metadata().map_err(failed())?.len();
        self.begin(head, len)?;
        let mut buffer = vec![0; 1 << 18];
        let mut left = len;
        while left > 0 {
            let take = buffer
                .len()
                .min(usize::try_from(left).unwrap_or(usize::MAX));
            file.read_exact(&mut buffer[..take]).map_err(failed())?;
            self.put(&buffer[..take])?;
            left -= take as u64;
        }
        Ok(())
    }

    fn begin(&mut self, head: &Head, content: u64) -> Result<(), IoFailure> {
        let head = to_rmp(head);
        self.entries += 1;
        self.put(&ENTRY)?;
        // A head is two names and some numbers.
        self.put(&(head.len() as u32).to_le_bytes())?;
        self.put(&content.to_le_bytes())?;
        self.put(&head)
    }

    /// Ends the archive and gives it its name; returns its bytes.
    pub(super) fn finish(mut self) -> Result<u64, IoFailure> {
        self.put(&END)?;
        self.put(&self.entries.to_le_bytes())?;
        let hash = *self.hasher.finalize().as_bytes();
        self.put(&hash)?;
        self.out
            .flush()
            .and_then(|()| self.out.get_ref().sync_all())
            .map_err(IoFailure::of("write", &self.tmp))?;
        files::rename_durably(&self.tmp, &self.path)?;
        self.finished = true;
        Ok(self.bytes)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), IoFailure> {
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        self.out
            .write_all(bytes)
            .map_err(IoFailure::of("write", &self.tmp))
    }
}

impl Drop for ArchiveWriter {
    fn drop(&mut self) {
        if !self.finished {
            // Best effort: what is left is a file that says of itself that it is temporary.
            let _: io::Result<()> = std::fs::remove_file(&self.tmp);
        }
    }
}
