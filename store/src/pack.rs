//! The sealed pack: frames, then an index, then a trailer; written once, never changed.

mod reader;
mod writer;

use serde::{Deserialize, Serialize};

pub(crate) use reader::{PackFile, Trailer, stored_bytes};
pub(crate) use writer::{PackWriter, Sealed};

use crate::id::{Digest, RunName, StepAddress, StepIndex};

/// First bytes of a pack.
const MAGIC: [u8; 8] = *b"FDFPACK1";
/// First bytes of its trailer.
const SEAL: [u8; 8] = *b"FDFSEAL1";
/// Bytes of the trailer: seal, offset and length of the index frame, digest, blake3, crc32.
const TRAILER_LEN: usize = 92;
/// Bytes of an entry of the index: a frame's bare header and its offset.
const ENTRY_LEN: usize = crate::frame::BARE_LEN + 8;

/// What a step's pack says of itself, in its header frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct StepHeader {
    pub(crate) run: RunName,
    pub(crate) step: StepIndex,
    pub(crate) predecessor: Option<Predecessor>,
}

/// The step that a step continues from, by address and content: the chain that shows a lost link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Predecessor {
    pub(crate) address: StepAddress,
    pub(crate) digest: Digest,
}
