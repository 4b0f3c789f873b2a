//! The `.part` file: the journal of one wave. Frames are appended as tasks finish; after a kill the
//! longest valid prefix counts, the rest is computed again.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::{IoFailure, JournalError};
use crate::frame::{self, Frame, FrameHeader, FrameId};
use crate::id::{StepIndex, WaveIndex};

const MAGIC: [u8; 8] = *b"FDFPART1";
/// Where the first frame, the header, begins.
pub(crate) const BEGIN: u64 = MAGIC.len() as u64;
/// Buffered bytes above which an append writes to the operating system.
const BUFFER: usize = 1 << 20;

/// What the valid prefix of a part holds.
#[derive(Clone, Debug)]
pub(crate) struct Prefix {
    /// The caller's header.
    pub(crate) header: Vec<u8>,
    /// Bytes of the valid prefix.
    pub(crate) valid: u64,
    /// Bytes of the file.
    pub(crate) file: u64,
}

/// Walks through the valid frames of a part in the order they were written; `visit` gets each header and
/// the whole frame's bytes. `None`: there is no such part, or nothing of it is valid.
pub(crate) fn scan(
    path: &Path,
    step: StepIndex,
    wave: WaveIndex,
    mut visit: impl FnMut(&FrameHeader, &[u8]) -> Result<(), JournalError>,
) -> Result<Option<Prefix>, JournalError> {
    let failed = || IoFailure::of("read", path);
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        other => other.map_err(failed())?,
    };
    let file_len = file.metadata().map_err(failed())?.len();
    let mut reader = BufReader::with_capacity(1 << 18, file).take(file_len);
    let mut magic = [0; MAGIC.len()];
    if file_len < MAGIC.len() as u64 {
        return Ok(None);
    }
    reader.read_exact(&mut magic).map_err(failed())?;
    if magic != MAGIC {
        return Ok(None);
    }
    let mut valid = MAGIC.len() as u64;
    let mut buffer = Vec::new();
    let mut next = |valid: u64, buffer: &mut Vec<u8>| {
        frame::read_next(&mut reader, file_len - valid, buffer).map_err(failed())
    };
    let Some(head) = next(valid, &mut buffer)? else {
        return Ok(None);
    };
    let identity = identity(step, wave);
    let payload = frame::decode(&head, &buffer[frame::HEADER_LEN..]);
    let Some(payload) = payload.filter(|p| head.id == frame::HEADER && p.starts_with(&identity))
    else {
        return Ok(None);
    };
    valid += head.frame_len();
    while let Some(header) = next(valid, &mut buffer)? {
        visit(&header, &buffer)?;
        valid += header.frame_len();
    }
    Ok(Some(Prefix {
        header: payload[identity.len()..].to_vec(),
        valid,
        file: file_len,
    }))
}

/// Begins the header frame's payload: whose journal this is.
fn identity(step: StepIndex, wave: WaveIndex) -> [u8; 8] {
    let mut out = [0; 8];
    out[..4].copy_from_slice(&step.0.to_le_bytes());
    out[4..].copy_from_slice(&wave.0.to_le_bytes());
    out
}

/// Appends to a part.
#[derive(Debug)]
pub(crate) struct PartWriter {
    path: PathBuf,
    file: File,
    /// Bytes of whole frames that the operating system has.
    written: u64,
    buffer: Vec<u8>,
    /// The frames so far, to notice at the commit if the file lost any.
    ids: BTreeSet<FrameId>,
}

impl PartWriter {
    /// Begins a part, replacing what was there.
    pub(crate) fn create(
        path: &Path,
        step: StepIndex,
        wave: WaveIndex,
        header: &[u8],
    ) -> Result<Self, JournalError> {
        let file = File::create(path).map_err(IoFailure::of("create", path))?;
        let mut payload = identity(step, wave).to_vec();
        payload.extend_from_slice(header);
        let mut buffer = MAGIC.to_vec();
        frame::encode(&Frame::diagnostic(frame::HEADER, payload), &mut buffer)?;
        let mut writer = Self {
            path: path.to_owned(),
            file,
            written: 0,
            buffer,
            ids: BTreeSet::new(),
        };
        writer.flush()?;
        Ok(writer)
    }

    /// Continues a part after its valid prefix.
    pub(crate) fn resume(
        path: &Path,
        valid: u64,
        ids: BTreeSet<FrameId>,
    ) -> Result<Self, IoFailure> {
        let file = OpenOptions::new()
            .write(true)
            .open(path)
            .map_err(IoFailure::of("open", path))?;
        let mut writer = Self {
            path: path.to_owned(),
            file,
            written: valid,
            buffer: Vec::new(),
            ids,
        };
        writer
            .cut_to_written()
            .map_err(IoFailure::of("truncate", path))?;
        Ok(writer)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn ids(&self) -> &BTreeSet<FrameId> {
        &self.ids
    }

    pub(crate) fn append(&mut self, frame: &Frame) -> Result<(), JournalError> {
        frame.validate()?;
        frame::encode(frame, &mut self.buffer)?;
        self.ids.insert(frame.id);
        if self.buffer.len() >= BUFFER {
            self.flush()?;
        }
        Ok(())
    }

    /// Hands everything to the operating system: a killed process loses nothing of it. Nothing is lost
    /// by a failure either (a full disk): the buffer stays for the next try.
    pub(crate) fn flush(&mut self) -> Result<(), IoFailure> {
        if let Err(error) = self.file.write_all(&self.buffer) {
            // Frames after a torn one would be unreachable.
            let _ = self.cut_to_written();
            return Err(IoFailure::of("write", &self.path)(error));
        }
        self.written += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }

    fn cut_to_written(&mut self) -> io::Result<()> {
        self.file.set_len(self.written)?;
        self.file.seek(SeekFrom::Start(self.written)).map(drop)
    }
}
