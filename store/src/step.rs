//! Committed steps, as listed and as read.

use std::collections::BTreeSet;
use std::path::Path;

use crate::database::StepRow;
use crate::error::{IoFailure, ReadError};
use crate::frame::{self, FrameId, Role};
use crate::id::{Digest, RunName, StepAddress, StepIndex};
use crate::layout::Layout;
use crate::pack::{PackFile, StepHeader, Trailer, stored_bytes};
use crate::prune;
use crate::run;

/// The most steps between two packs that are taken for lost ones.
const LONGEST_GAP: usize = 100_000;

/// Whether a listed step can be read. Listing looks at ends and lengths; [`StepReader::verify`] and
/// `check` look at every byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StepHealth {
    /// Nothing against it.
    Sound,
    /// Its pack is damaged, in these words.
    Damaged(String),
    /// It was committed, but its pack is gone.
    Missing,
    /// Its pack was removed on purpose to save space; digest and summary are known still.
    Pruned,
}

/// A committed step in a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepRecord {
    /// Number of the step.
    pub index: StepIndex,
    /// The run whose folder holds it: the run itself or an ancestor.
    pub run: RunName,
    /// Hash of its content; `None` where a damaged step's is not known any more.
    pub digest: Option<Digest>,
    /// Bytes of its pack.
    pub bytes: u64,
    /// The caller's summary of the step; empty where a damaged step's is not known any more.
    pub summary: Vec<u8>,
    /// Whether it can be read.
    pub health: StepHealth,
}

impl StepRecord {
    /// Where the step lies.
    pub fn address(&self) -> StepAddress {
        StepAddress {
            run: self.run.clone(),
            step: self.index,
        }
    }

    /// Whether nothing speaks against the step.
    pub fn is_sound(&self) -> bool {
        self.health == StepHealth::Sound
    }

    /// Whether it cannot be read and nobody wanted that.
    pub fn is_lost(&self) -> bool {
        matches!(self.health, StepHealth::Damaged(_) | StepHealth::Missing)
    }

    fn lost(address: &StepAddress, row: Option<&StepRow>, health: StepHealth) -> Self {
        Self {
            index: address.step,
            run: address.run.clone(),
            digest: row.map(|row| row.digest),
            bytes: row.map_or(0, |row| row.bytes),
            summary: row
                .and_then(|row| row.summary.as_ref())
                .map_or_else(Vec::new, |summary| summary.to_vec()),
            health,
        }
    }
}

/// Looks at the pack of one step; `row` is what the database knows of it, which saves reading the summary.
pub(crate) fn inspect(layout: &Layout, address: &StepAddress, row: Option<&StepRow>) -> StepRecord {
    let path = layout.pack(&address.run, address.step);
    match look(&path, address, row) {
        Ok(record) => record,
        Err(ReadError::Io(error)) if error.is_missing() => match prune::read(layout, address) {
            Ok(Some(stub)) => StepRecord {
                index: address.step,
                run: address.run.clone(),
                digest: Some(stub.digest),
                bytes: 0,
                summary: stub.summary.into_vec(),
                health: StepHealth::Pruned,
            },
            Ok(None) => StepRecord::lost(address, row, StepHealth::Missing),
            Err(error) => StepRecord::lost(address, row, StepHealth::Damaged(error.to_string())),
        },
        Err(error) => {
            let mut record = StepRecord::lost(address, row, StepHealth::Damaged(error.to_string()));
            record.bytes = stored_bytes(&path);
            record
        }
    }
}

fn look(
    path: &Path,
    address: &StepAddress,
    row: Option<&StepRow>,
) -> Result<StepRecord, ReadError> {
    let trailer = Trailer::read(path)?;
    let known = row
        .filter(|row| row.digest == trailer.digest && row.bytes == trailer.file_len)
        .and_then(|row| row.summary.as_ref());
    let summary = match known {
        Some(summary) => summary.to_vec(),
        None => StepReader::open(path, address)?.summary()?,
    };
    Ok(StepRecord {
        index: address.step,
        run: address.run.clone(),
        digest: Some(trailer.digest),
        bytes: trailer.file_len,
        summary,
        health: StepHealth::Sound,
    })
}

/// The steps a run committed itself, ascending, lost ones included as far as anything still knows of them:
/// `rows` (the database), a gap between packs, the parent's step, the run's state.
pub(crate) fn scan<'a>(
    layout: &Layout,
    run: &RunName,
    row: impl Fn(StepIndex) -> Option<&'a StepRow>,
    known: impl Iterator<Item = StepIndex>,
) -> Result<Vec<StepRecord>, IoFailure> {
    let packs = layout.pack_steps(run)?;
    let address = |step| StepAddress {
        run: run.clone(),
        step,
    };
    let mut steps: BTreeSet<StepIndex> = packs.into_iter().chain(known).collect();
    steps.extend(
        run::read_state(layout, run)
            .ok()
            .and_then(|state| state.last_own),
    );
    if let Some(first) = steps.first().copied() {
        steps.extend(first_expected(layout, &address(first)));
    }
    let steps = with_gaps_filled(&steps).into_iter();
    Ok(steps
        .map(|step| inspect(layout, &address(step), row(step)))
        .collect())
}

/// The steps and those between them: steps are consecutive.
fn with_gaps_filled(steps: &BTreeSet<StepIndex>) -> Vec<StepIndex> {
    let mut filled: Vec<StepIndex> = Vec::new();
    for step in steps {
        if let Some(last) = filled.last() {
            // A longer gap is not one of lost steps but a file that does not belong here.
            let gap = last.0 + 1..step.0;
            if gap.len() <= LONGEST_GAP {
                filled.extend(gap.map(StepIndex));
            }
        }
        filled.push(*step);
    }
    filled
}

/// The first step that the run must have, by its parent or by what its first pack continues from.
fn first_expected(layout: &Layout, first: &StepAddress) -> Option<StepIndex> {
    match run::read(layout, &first.run) {
        Ok(file) => match file.parent {
            Some(parent) => Some(StepIndex(parent.step.0.saturating_add(1))),
            None => {
                let pack = StepReader::open(&layout.pack(&first.run, first.step), first).ok()?;
                let before = pack.header.predecessor?.address;
                (before.run == first.run).then_some(before.step)
            }
        },
        Err(_) => None,
    }
}

/// What a committed frame is, without its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameInfo {
    /// Which frame.
    pub id: FrameId,
    /// Whether it enters the digest.
    pub role: Role,
    /// Bytes of its payload, decoded.
    pub len: u64,
    /// Bytes of its payload as stored.
    pub stored: u64,
    /// blake3 of its payload, decoded: two steps differ in those frames whose hashes do.
    pub hash: Digest,
}

/// An open committed step. Reading goes by position: several threads may read at once.
#[derive(Debug)]
pub struct StepReader {
    address: StepAddress,
    pub(crate) pack: PackFile,
    pub(crate) header: StepHeader,
}

impl StepReader {
    pub(crate) fn open(path: &Path, address: &StepAddress) -> Result<Self, ReadError> {
        let pack = PackFile::open(path)?;
        let header = pack.step_header()?;
        if (&header.run, header.step) != (&address.run, address.step) {
            let what = format!("it is the pack of {}@{}", header.run, header.step);
            return Err(pack.damaged(what));
        }
        Ok(Self {
            address: address.clone(),
            pack,
            header,
        })
    }

    /// Where the step lies: in the run asked for or in an ancestor.
    pub fn address(&self) -> &StepAddress {
        &self.address
    }

    /// The step this one continues from, with its digest.
    pub fn predecessor(&self) -> Option<(&StepAddress, Digest)> {
        let before = self.header.predecessor.as_ref()?;
        Some((&before.address, before.digest))
    }

    /// Hash of the step's content, see `docs/design/store.md`.
    pub fn digest(&self) -> Digest {
        self.pack.trailer().digest
    }

    /// Bytes of the pack.
    pub fn bytes(&self) -> u64 {
        self.pack.trailer().file_len
    }

    /// The frames in the order of their ids.
    pub fn frames(&self) -> Vec<FrameInfo> {
        self.pack
            .headers()
            .filter(|header| header.id.kind <= FrameId::LAST_KIND)
            .map(|header| FrameInfo {
                id: header.id,
                role: header.role,
                len: u64::from(header.decoded_len),
                stored: u64::from(header.stored_len),
                hash: header.hash,
            })
            .collect()
    }

    /// The frames' ids in their order.
    pub fn ids(&self) -> Vec<FrameId> {
        self.frames().into_iter().map(|frame| frame.id).collect()
    }

    /// One frame's payload, checked against checksum and hash.
    pub fn frame(&self, id: FrameId) -> Result<Vec<u8>, ReadError> {
        self.pack.frame(id)
    }

    /// The summary given at the commit.
    pub fn summary(&self) -> Result<Vec<u8>, ReadError> {
        self.pack.frame(frame::SUMMARY)
    }

    /// Checks every byte of the pack.
    pub fn verify(&self) -> Result<(), ReadError> {
        self.pack.verify()
    }
}
