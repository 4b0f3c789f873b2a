//! The running step: one `.part` per wave while it runs, one sealed pack when it is committed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;

use crate::error::{CommitError, IoFailure, JournalError};
use crate::files;
use crate::frame::{self, Frame, FrameId};
use crate::id::{Digest, RunName, StepAddress, StepIndex, WaveIndex};
use crate::layout::Layout;
use crate::pack::{PackWriter, Predecessor, StepHeader};
use crate::part::{self, PartWriter, Prefix};
use crate::record::to_rmp;
use crate::store::Inner;

/// What is journalled of a wave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WaveContents {
    /// The header the wave was opened with.
    pub header: Vec<u8>,
    /// The frames in the order of their ids. Of frames with one id the last one counts.
    pub frames: Vec<Frame>,
    /// Bytes at the end of the file that are no whole frames: a write that a kill cut short, or damage.
    pub torn: u64,
}

/// What opening a wave found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaveOpening {
    /// Nothing usable: the wave begins.
    New,
    /// A journal of the same wave with the same header, which is continued.
    Continued {
        /// How many frames it has.
        frames: usize,
    },
    /// A journal with another header: other work than this, so it is replaced.
    Replaced,
}

/// What to commit beside the journalled frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Seal {
    /// The wave whose frames are carried over, if any.
    pub final_wave: Option<WaveIndex>,
    /// Frames that are in no wave: global fields, diagnostics.
    pub extra: Vec<Frame>,
    /// What lists of steps say about the step; not part of the digest.
    pub summary: Vec<u8>,
}

/// A step that is committed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Committed {
    /// Where it lies.
    pub address: StepAddress,
    /// Hash of its content.
    pub digest: Digest,
    /// Bytes of its pack.
    pub bytes: u64,
}

/// The exclusive writer of a run's next step. Dropping it keeps the journal on disk for later.
pub struct StepJournal {
    inner: Arc<Inner>,
    address: StepAddress,
    predecessor: Option<Predecessor>,
    writers: BTreeMap<WaveIndex, PartWriter>,
}

impl fmt::Debug for StepJournal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "StepJournal({})", self.address)
    }
}

/// Reads the valid prefix of a wave's journal.
pub(crate) fn read(
    layout: &Layout,
    run: &RunName,
    step: StepIndex,
    wave: WaveIndex,
) -> Result<Option<WaveContents>, JournalError> {
    let mut frames = BTreeMap::new();
    // Damage that the checksum lets through must not pass either: what follows it is not taken.
    let mut sound_until = None;
    let mut at = 0;
    let path = layout.part(run, step, wave);
    let prefix = part::scan(&path, step, wave, |header, bytes| {
        let decoded = frame::decode(header, &bytes[frame::HEADER_LEN..])
            .filter(|payload| Digest::of(payload) == header.hash);
        match decoded {
            Some(payload) if sound_until.is_none() => {
                let frame = Frame {
                    id: header.id,
                    role: header.role,
                    encoding: header.encoding,
                    payload,
                };
                frames.insert(header.id, frame);
            }
            _ => sound_until = sound_until.or(Some(at)),
        }
        at += header.frame_len();
        Ok(())
    })?;
    Ok(prefix.map(|prefix| WaveContents {
        header: prefix.header,
        frames: frames.into_values().collect(),
        torn: prefix.file - prefix.valid + sound_until.map_or(0, |sound| at - sound),
    }))
}

impl StepJournal {
    pub(crate) fn new(
        inner: Arc<Inner>,
        address: StepAddress,
        predecessor: Option<Predecessor>,
    ) -> Self {
        Self {
            inner,
            address,
            predecessor,
            writers: BTreeMap::new(),
        }
    }

    /// The step being journalled.
    pub fn address(&self) -> &StepAddress {
        &self.address
    }

    /// The journalled waves, ascending.
    pub fn waves(&self) -> Result<Vec<WaveIndex>, JournalError> {
        let StepAddress { run, step } = &self.address;
        Ok(self.inner.layout.waves(run, *step)?)
    }

    /// Opens a wave for appending. `header` is what makes the wave this wave (its input, or a hash of it): a
    /// journal on disk with the same header is continued after its valid prefix, any other one replaced.
    pub fn open_wave(
        &mut self,
        wave: WaveIndex,
        header: &[u8],
    ) -> Result<WaveOpening, JournalError> {
        let step = self.address.step;
        let path = self.inner.layout.part(&self.address.run, step, wave);
        if let Some(mut open) = self.writers.remove(&wave) {
            open.flush()?;
        }
        let mut ids = BTreeSet::new();
        let existed = path.exists();
        let found = part::scan(&path, step, wave, |frame, _| {
            ids.insert(frame.id);
            Ok(())
        })?;
        let (writer, opening) = match found {
            Some(Prefix {
                header: old, valid, ..
            }) if old == header => {
                let frames = ids.len();
                let writer = PartWriter::resume(&path, valid, ids)?;
                (writer, WaveOpening::Continued { frames })
            }
            other => {
                let writer = PartWriter::create(&path, step, wave, header)?;
                let opening = match other {
                    Some(_) => WaveOpening::Replaced,
                    None => WaveOpening::New,
                };
                if existed && opening == WaveOpening::New {
                    tracing::warn!(path = %path.display(), "a journal had nothing usable");
                }
                (writer, opening)
            }
        };
        self.writers.insert(wave, writer);
        Ok(opening)
    }

    /// Adds a frame to an open wave. Buffered: see [`Self::flush`].
    pub fn append(&mut self, wave: WaveIndex, frame: &Frame) -> Result<(), JournalError> {
        let writer = self.writers.get_mut(&wave);
        writer.ok_or(JournalError::WaveNotOpen(wave))?.append(frame)
    }

    /// Hands everything appended to the operating system: from here on a killed process loses none of it.
    pub fn flush(&mut self) -> Result<(), JournalError> {
        for writer in self.writers.values_mut() {
            writer.flush()?;
        }
        Ok(())
    }

    /// What is journalled of a wave, appended frames included; `None` where there is nothing sound.
    pub fn read_wave(&mut self, wave: WaveIndex) -> Result<Option<WaveContents>, JournalError> {
        if let Some(writer) = self.writers.get_mut(&wave) {
            writer.flush()?;
        }
        read(
            &self.inner.layout,
            &self.address.run,
            self.address.step,
            wave,
        )
    }

    /// Deletes the journals of all waves but these.
    pub fn keep(&mut self, waves: &[WaveIndex]) -> Result<(), JournalError> {
        for wave in self.waves()? {
            if !waves.contains(&wave) {
                self.writers.remove(&wave);
                files::remove_file(&self.part(wave))?;
            }
        }
        Ok(())
    }

    /// Deletes the journals of all waves: the step was cut back, nothing of it counts.
    pub fn abandon(mut self) -> Result<(), JournalError> {
        self.keep(&[])
    }

    /// Seals the step: the frames of the final wave for which `carry` says so, as they are, the extra frames
    /// and the summary. When this returns `Ok` the step is committed and survives a power cut. After an
    /// error the step did not happen and its journal is as before: open it again to try again.
    pub fn commit(
        mut self,
        seal: Seal,
        carry: impl Fn(FrameId) -> bool,
    ) -> Result<Committed, CommitError> {
        self.flush()?;
        let header = StepHeader {
            run: self.address.run.clone(),
            step: self.address.step,
            predecessor: self.predecessor.clone(),
        };
        let StepAddress { run, step } = &self.address;
        let path = self.inner.layout.pack(run, *step);
        let mut pack = PackWriter::create(&path, to_rmp(&header))?;
        if let Some(wave) = seal.final_wave {
            self.carry_over(wave, carry, &mut pack)?;
        }
        for frame in &seal.extra {
            frame.validate()?;
            pack.append(frame)?;
        }
        pack.append(&Frame::diagnostic(frame::SUMMARY, seal.summary.clone()))?;
        let sealed = pack.seal()?;
        // Committed: nothing below can take that back, so nothing below fails.
        self.inner.committed(&self.address, sealed, seal.summary);
        if let Err(error) = self.keep(&[]) {
            tracing::warn!(%error, "a journal could not be removed; the next opening removes it");
        }
        Ok(Committed {
            address: self.address.clone(),
            digest: sealed.digest,
            bytes: sealed.bytes,
        })
    }

    /// Copies the last frame of each id.
    fn carry_over(
        &self,
        wave: WaveIndex,
        carry: impl Fn(FrameId) -> bool,
        pack: &mut PackWriter,
    ) -> Result<(), CommitError> {
        let path = self.part(wave);
        let step = self.address.step;
        let mut last = BTreeMap::new();
        let mut at = 0_u64;
        part::scan(&path, step, wave, |header, _| {
            last.insert(header.id, at);
            at += 1;
            Ok(())
        })?
        .ok_or(CommitError::NoSuchWave(wave))?;
        if let Some(writer) = self.writers.get(&wave) {
            let lost = writer.ids().iter().filter(|id| !last.contains_key(id));
            let lost = lost.count();
            if lost > 0 {
                let path = writer.path().to_owned();
                return Err(CommitError::FramesLost { wave, path, lost });
            }
        }
        let mut failed = None;
        at = 0;
        part::scan(&path, step, wave, |header, bytes| {
            if failed.is_none() && last.get(&header.id) == Some(&at) && carry(header.id) {
                failed = pack.carry_over(*header, bytes).err();
            }
            at += 1;
            Ok(())
        })?;
        failed.map_or(Ok(()), |error| Err(error.into()))
    }

    fn part(&self, wave: WaveIndex) -> std::path::PathBuf {
        let StepAddress { run, step } = &self.address;
        self.inner.layout.part(run, *step, wave)
    }
}

impl Drop for StepJournal {
    fn drop(&mut self) {
        // Best effort, like closing a file: who needs to know calls `flush`.
        let flushed: Result<(), IoFailure> =
            self.writers.values_mut().try_for_each(PartWriter::flush);
        if let Err(error) = flushed {
            tracing::warn!(%error, "the journal lost its last frames");
        }
        self.inner.release_journal(&self.address.run);
    }
}
