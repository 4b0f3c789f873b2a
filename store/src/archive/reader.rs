//! Reads an archive from front to back, hashing all of it.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

use super::{
    END, END_LEN, ENTRY, Head, LONGEST_HEAD, LONGEST_IN_MEMORY, MAGIC, MAGIC_STEM, PREFIX_LEN,
};
use crate::error::{Damage, ImportError, IoFailure};

const REMEDY: &str = "export it again, or copy it again from where it is whole";

/// An archive that is read.
pub(super) struct ArchiveReader {
    path: PathBuf,
    input: BufReader<File>,
    hasher: blake3::Hasher,
    /// Bytes of the file that are not read yet.
    left: u64,
    entries: u64,
    /// Bytes of the present entry's content that are not read yet.
    content: u64,
}

impl ArchiveReader {
    pub(super) fn open(path: &Path) -> Result<Self, ImportError> {
        let file = File::open(path).map_err(IoFailure::of("open", path))?;
        let meta = file.metadata().map_err(IoFailure::of("read", path))?;
        let mut reader = Self {
            path: path.to_owned(),
            input: BufReader::with_capacity(1 << 18, file),
            hasher: blake3::Hasher::new(),
            left: meta.len(),
            entries: 0,
            content: 0,
        };
        let foreign = || ImportError::NotAnArchive {
            path: path.to_owned(),
        };
        if !meta.is_file() || meta.len() < MAGIC.len() as u64 {
            return Err(foreign());
        }
        let mut magic = [0; MAGIC.len()];
        reader.read(&mut magic)?;
        match magic {
            MAGIC => Ok(reader),
            _ if magic.starts_with(MAGIC_STEM) => Err(ImportError::LaterFormat {
                path: path.to_owned(),
            }),
            _ => Err(foreign()),
        }
    }

    /// Bytes of the whole file that are not read yet.
    pub(super) fn left(&self) -> u64 {
        self.left
    }

    /// The next entry; `None` at the end, which is checked. Whatever of the entry before was not read is passed over.
    pub(super) fn next(&mut self) -> Result<Option<Head>, ImportError> {
        self.copy_content(&mut std::io::sink(), Path::new("nowhere"))?;
        if self.left < END_LEN {
            return Err(self.damaged("it is cut off"));
        }
        let mut magic = [0; 4];
        self.read(&mut magic)?;
        if magic == END[..4] {
            return self.end().map(|()| None);
        }
        if magic != ENTRY {
            return Err(self.damaged("no entry begins where one should"));
        }
        let (mut head, mut content) = ([0; 4], [0; 8]);
        self.read(&mut head)?;
        self.read(&mut content)?;
        let (head, content) = (u32::from_le_bytes(head), u64::from_le_bytes(content));
        if head > LONGEST_HEAD {
            return Err(self.damaged("an entry makes no sense"));
        }
        if u64::from(head)
            .checked_add(content)
            .is_none_or(|all| all > self.left)
        {
            return Err(self.damaged("it is cut off"));
        }
        let mut bytes = vec![0; head as usize];
        self.read(&mut bytes)?;
        self.content = content;
        self.entries += 1;
        match rmp_serde::from_slice(&bytes) {
            Ok(head) => Ok(Some(head)),
            Err(error) => Err(self.damaged(format!("an entry does not decode ({error})"))),
        }
    }

    /// The whole content of the present entry.
    pub(super) fn content(&mut self) -> Result<Vec<u8>, ImportError> {
        if self.content > LONGEST_IN_MEMORY {
            return Err(self.damaged("an entry is longer than it can be"));
        }
        let mut bytes = Vec::new();
        self.copy_content(&mut bytes, Path::new("memory"))?;
        Ok(bytes)
    }

    /// Hands what is left of the present entry's content to `to`, which lies at `path`.
    pub(super) fn copy_content(
        &mut self,
        to: &mut impl Write,
        path: &Path,
    ) -> Result<(), ImportError> {
        let mut buffer = vec![0; 1 << 18];
        while self.content > 0 {
            let take = buffer
                .len()
                .min(usize::try_from(self.content).unwrap_or(usize::MAX));
            self.read(&mut buffer[..take])?;
            self.content -= take as u64;
            to.write_all(&buffer[..take])
                .map_err(IoFailure::of("write", path))?;
        }
        Ok(())
    }

    /// Checks the end, of which four bytes are read.
    fn end(&mut self) -> Result<(), ImportError> {
        let (mut magic, mut entries, mut hash) = ([0; 4], [0; 8], [0; 32]);
        self.read(&mut magic)?;
        self.read(&mut entries)?;
        let expected = self.hasher.finalize();
        self.read(&mut hash)?;
        if magic != END[4..] || self.left > 0 {
            return Err(self.damaged("its end is not where it should be"));
        }
        if u64::from_le_bytes(entries) != self.entries || expected.as_bytes() != &hash {
            return Err(self.damaged("its hash does not fit"));
        }
        Ok(())
    }

    pub(super) fn damaged(&self, what: impl Into<String>) -> ImportError {
        Damage::new(&self.path, what, REMEDY).into()
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<(), ImportError> {
        if buffer.len() as u64 > self.left {
            return Err(self.damaged("it is cut off"));
        }
        self.input
            .read_exact(buffer)
            .map_err(IoFailure::of("read", &self.path))?;
        self.left -= buffer.len() as u64;
        self.hasher.update(buffer);
        Ok(())
    }
}

/// A short check that nothing of the layout drifts apart.
const _: () = assert!(PREFIX_LEN == (ENTRY.len() + 4 + 8) as u64);
