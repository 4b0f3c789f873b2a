//! Writes a pack under a temporary name and seals it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{ENTRY_LEN, MAGIC, SEAL, TRAILER_LEN};
use crate::error::{FrameError, IoFailure, PackError};
use crate::files;
use crate::frame::{self, Encoding, Frame, FrameHeader, FrameId, Role};
use crate::id::Digest;

/// A pack being written. Dropped before it is sealed, it leaves nothing.
pub(crate) struct PackWriter {
    path: PathBuf,
    tmp: PathBuf,
    out: BufWriter<File>,
    hasher: blake3::Hasher,
    offset: u64,
    entries: BTreeMap<FrameId, (FrameHeader, u64)>,
    buffer: Vec<u8>,
    sealed: bool,
}

/// A pack that is committed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sealed {
    pub(crate) digest: Digest,
    pub(crate) bytes: u64,
}

impl PackWriter {
    /// Begins the pack that will be `path`; `header` is the payload of its header frame.
    pub(crate) fn create(path: &Path, header: Vec<u8>) -> Result<Self, PackError> {
        let tmp = files::temporary(path);
        let file = File::create(&tmp).map_err(IoFailure::of("create", &tmp))?;
        let mut writer = Self {
            path: path.to_owned(),
            tmp,
            out: BufWriter::with_capacity(1 << 18, file),
            hasher: blake3::Hasher::new(),
            offset: 0,
            entries: BTreeMap::new(),
            buffer: Vec::new(),
            sealed: false,
        };
        writer.put(&MAGIC)?;
        writer.append(&Frame::diagnostic(frame::HEADER, header))?;
        Ok(writer)
    }

    /// Encodes and adds a frame.
    pub(crate) fn append(&mut self, frame: &Frame) -> Result<(), PackError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        let header = frame::encode_as(frame.encoding.sealed(), frame, &mut buffer)?;
        let result = self.append_encoded(header, &buffer);
        self.buffer = buffer;
        result
    }

    /// Adds a journalled frame, compressed now where that was put off; `bytes` is the whole frame.
    pub(crate) fn carry_over(
        &mut self,
        header: FrameHeader,
        bytes: &[u8],
    ) -> Result<(), PackError> {
        if header.encoding.sealed() == header.encoding {
            return self.append_encoded(header, bytes);
        }
        self.append(&Frame {
            id: header.id,
            role: header.role,
            encoding: header.encoding,
            payload: bytes[frame::HEADER_LEN..].to_vec(),
        })
    }

    /// Adds a frame that is encoded already; `bytes` is the whole frame.
    fn append_encoded(&mut self, header: FrameHeader, bytes: &[u8]) -> Result<(), PackError> {
        if self.entries.contains_key(&header.id) {
            return Err(FrameError::Duplicate(header.id).into());
        }
        self.entries.insert(header.id, (header, self.offset));
        Ok(self.put(bytes)?)
    }

    /// Adds index and trailer and gives the pack its name. When this returns, the pack is committed: it
    /// survives a power cut.
    pub(crate) fn seal(mut self) -> Result<Sealed, PackError> {
        let digest = frame::content_digest(self.entries.values().map(|(header, _)| header));
        let (index_at, index_len) = self.put_index()?;
        let mut trailer = Vec::with_capacity(TRAILER_LEN);
        trailer.extend_from_slice(&SEAL);
        trailer.extend_from_slice(&index_at.to_le_bytes());
        trailer.extend_from_slice(&index_len.to_le_bytes());
        trailer.extend_from_slice(&digest.0);
        self.hasher.update(&trailer);
        trailer.extend_from_slice(self.hasher.finalize().as_bytes());
        let crc = crc32fast::hash(&trailer);
        trailer.extend_from_slice(&crc.to_le_bytes());
        self.put(&trailer)?;
        self.out
            .flush()
            .and_then(|()| self.out.get_ref().sync_data())
            .map_err(IoFailure::of("write", &self.tmp))?;
        files::rename_durably(&self.tmp, &self.path)?;
        self.sealed = true;
        Ok(Sealed {
            digest,
            bytes: self.offset,
        })
    }

    fn put_index(&mut self) -> Result<(u64, u64), PackError> {
        let mut payload = Vec::with_capacity(self.entries.len() * ENTRY_LEN);
        for (header, offset) in self.entries.values() {
            payload.extend_from_slice(&header.to_bytes());
            payload.extend_from_slice(&offset.to_le_bytes());
        }
        let index = Frame {
            id: frame::INDEX,
            role: Role::Diagnostic,
            encoding: Encoding::Raw,
            payload,
        };
        let mut bytes = Vec::new();
        frame::encode(&index, &mut bytes)?;
        let at = self.offset;
        self.put(&bytes)?;
        Ok((at, bytes.len() as u64))
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), IoFailure> {
        self.hasher.update(bytes);
        self.offset += bytes.len() as u64;
        self.out
            .write_all(bytes)
            .map_err(IoFailure::of("write", &self.tmp))
    }
}

impl Drop for PackWriter {
    fn drop(&mut self) {
        if !self.sealed {
            // Best effort: opening the store sweeps what stays behind.
            let _: io::Result<()> = std::fs::remove_file(&self.tmp);
        }
    }
}
