//! Reads a pack: trailer, index, single frames, and the whole for verification.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use super::{ENTRY_LEN, MAGIC, SEAL, StepHeader, TRAILER_LEN};
use crate::error::{Damage, IoFailure, ReadError};
use crate::frame::{self, FrameHeader, FrameId, array_at, u64_at};
use crate::id::Digest;

const REMEDY: &str = "restore the file from a copy, or set the run back to the step before";

/// The last bytes of a pack, which say whether it is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Trailer {
    pub(crate) digest: Digest,
    pub(crate) file_len: u64,
    index_at: u64,
    index_len: u64,
    hash: Digest,
}

impl Trailer {
    /// Reads the trailer of the pack at `path`.
    pub(crate) fn read(path: &Path) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(IoFailure::of("open", path))?;
        Self::of(&file, path)
    }

    fn of(file: &File, path: &Path) -> Result<Self, ReadError> {
        let damaged = |what: &str| ReadError::from(Damage::new(path, what, REMEDY));
        let file_len = file.metadata().map_err(IoFailure::of("read", path))?.len();
        let Some(at) = file_len.checked_sub(TRAILER_LEN as u64) else {
            return Err(damaged("it is too short for a pack"));
        };
        let mut bytes = [0; TRAILER_LEN];
        file.read_exact_at(&mut bytes, at)
            .map_err(IoFailure::of("read", path))?;
        let crc = frame::u32_at(&bytes, TRAILER_LEN - 4);
        if bytes[..8] != SEAL || crc32fast::hash(&bytes[..TRAILER_LEN - 4]) != crc {
            return Err(damaged("its trailer is damaged or cut off"));
        }
        let (index_at, index_len) = (u64_at(&bytes, 8), u64_at(&bytes, 16));
        if index_at.checked_add(index_len) != Some(at) || index_at < MAGIC.len() as u64 {
            return Err(damaged("its length is not the one it was sealed with"));
        }
        Ok(Self {
            digest: Digest(array_at(&bytes, 24)),
            hash: Digest(array_at(&bytes, 56)),
            file_len,
            index_at,
            index_len,
        })
    }
}

/// An open pack with its index in memory.
#[derive(Debug)]
pub(crate) struct PackFile {
    path: PathBuf,
    file: File,
    trailer: Trailer,
    entries: BTreeMap<FrameId, (FrameHeader, u64)>,
}

impl PackFile {
    /// Opens the pack at `path`; checks its trailer and index.
    pub(crate) fn open(path: &Path) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(IoFailure::of("open", path))?;
        let trailer = Trailer::of(&file, path)?;
        let mut pack = Self {
            path: path.to_owned(),
            file,
            trailer,
            entries: BTreeMap::new(),
        };
        let mut magic = [0; MAGIC.len()];
        pack.read_at(&mut magic, 0)?;
        if magic != MAGIC {
            return Err(pack.damaged("it does not begin as a pack does"));
        }
        pack.entries = pack.read_index()?;
        let digest = frame::content_digest(pack.entries.values().map(|(header, _)| header));
        if digest != trailer.digest {
            return Err(pack.damaged("its index does not fit its digest"));
        }
        Ok(pack)
    }

    fn read_index(&self) -> Result<BTreeMap<FrameId, (FrameHeader, u64)>, ReadError> {
        let mut bytes = vec![0; self.trailer.index_len as usize];
        self.read_at(&mut bytes, self.trailer.index_at)?;
        let (header, stored) =
            frame::parse(&bytes).map_err(|what| self.damaged(format!("its index: {what}")))?;
        if header.id != frame::INDEX || stored.len() % ENTRY_LEN != 0 {
            return Err(self.damaged("its index is none"));
        }
        let mut entries = BTreeMap::new();
        for entry in stored.chunks_exact(ENTRY_LEN) {
            let header = FrameHeader::from_bytes(&array_at(entry, 0));
            let offset = u64_at(entry, ENTRY_LEN - 8);
            let inside = |h: &FrameHeader| {
                offset
                    .checked_add(h.frame_len())
                    .is_some_and(|end| end <= self.trailer.index_at)
            };
            match header.filter(inside) {
                Some(header) => entries.insert(header.id, (header, offset)),
                None => return Err(self.damaged("an entry of its index makes no sense")),
            };
        }
        Ok(entries)
    }

    /// What the trailer says.
    pub(crate) fn trailer(&self) -> &Trailer {
        &self.trailer
    }

    /// The frames' headers in the order of their ids, the store's own included.
    pub(crate) fn headers(&self) -> impl Iterator<Item = &FrameHeader> {
        self.entries.values().map(|(header, _)| header)
    }

    /// The frames' ids in their order, the store's own included.
    pub(crate) fn ids(&self) -> impl Iterator<Item = FrameId> {
        self.entries.keys().copied()
    }

    /// Reads one whole frame as it is stored, checked against its checksum.
    pub(crate) fn stored(&self, id: FrameId) -> Result<(FrameHeader, Vec<u8>), ReadError> {
        let Some((expected, offset)) = self.entries.get(&id) else {
            return Err(ReadError::NoSuchFrame {
                path: self.path.clone(),
                frame: id,
            });
        };
        let mut bytes = vec![0; expected.frame_len() as usize];
        self.read_at(&mut bytes, *offset)?;
        let (header, _) =
            frame::parse(&bytes).map_err(|what| self.damaged(format!("{id}: {what}")))?;
        if header != *expected {
            return Err(self.damaged(format!("{id} is not the one of the index")));
        }
        Ok((header, bytes))
    }

    /// Reads, checks and decodes one frame.
    pub(crate) fn frame(&self, id: FrameId) -> Result<Vec<u8>, ReadError> {
        let (header, bytes) = self.stored(id)?;
        let stored = &bytes[frame::HEADER_LEN..];
        let payload = frame::decode(&header, stored)
            .ok_or_else(|| self.damaged(format!("{id} does not decode")))?;
        if Digest::of(&payload) != header.hash {
            return Err(self.damaged(format!("the hash of {id} does not fit")));
        }
        Ok(payload)
    }

    /// The header of a step's pack.
    pub(crate) fn step_header(&self) -> Result<StepHeader, ReadError> {
        rmp_serde::from_slice(&self.frame(frame::HEADER)?)
            .map_err(|error| self.damaged(format!("its header does not decode ({error})")))
    }

    /// Reads everything: the whole file against its blake3, every frame against crc and hash.
    pub(crate) fn verify(&self) -> Result<(), ReadError> {
        // The hash stands in the trailer before the checksum; it covers all before itself.
        let mut left = self.trailer.file_len - 36;
        let mut hasher = blake3::Hasher::new();
        let mut buffer = vec![0; 1 << 18];
        let mut file = File::open(&self.path).map_err(IoFailure::of("open", &self.path))?;
        while left > 0 {
            let take = buffer.len().min(left as usize);
            file.read_exact(&mut buffer[..take])
                .map_err(IoFailure::of("read", &self.path))?;
            hasher.update(&buffer[..take]);
            left -= take as u64;
        }
        // Frames first: they name the place.
        for id in self.entries.keys() {
            self.frame(*id)?;
        }
        if hasher.finalize().as_bytes() != &self.trailer.hash.0 {
            return Err(self.damaged("its blake3 does not fit"));
        }
        Ok(())
    }

    pub(crate) fn damaged(&self, what: impl Into<String>) -> ReadError {
        Damage::new(&self.path, what, REMEDY).into()
    }

    fn read_at(&self, buffer: &mut [u8], offset: u64) -> Result<(), ReadError> {
        self.file
            .read_exact_at(buffer, offset)
            .map_err(|error| IoFailure::of("read", &self.path)(error).into())
    }
}

/// Bytes of the file, 0 where there is none.
pub(crate) fn stored_bytes(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |meta| meta.len())
}
