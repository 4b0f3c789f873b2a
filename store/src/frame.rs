//! The frame, the unit of everything the store writes in bulk: a header that protects itself and its
//! payload by a checksum and a hash. The bytes are laid down in `docs/design/store.md`.

use std::fmt;
use std::io::{self, Read};

use crate::MAX_PAYLOAD;
use crate::codec;
use crate::error::FrameError;
use crate::id::Digest;

/// Bytes of a frame before its payload.
pub(crate) const HEADER_LEN: usize = 56;
const MAGIC: [u8; 4] = *b"FDF1";

/// The store's own frames: index of a pack, header of a pack or part, summary of a step.
pub(crate) const INDEX: FrameId = FrameId::new(0xffff, 0);
pub(crate) const HEADER: FrameId = FrameId::new(0xfffe, 0);
pub(crate) const SUMMARY: FrameId = FrameId::new(0xfffd, 0);

/// What a frame is, within its step or wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId {
    /// Its class, numbered by the caller, at most [`FrameId::LAST_KIND`].
    pub kind: u16,
    /// Which one of its class: a Gauss point's number, or 0.
    pub index: u32,
}

impl FrameId {
    /// The highest kind a caller may use.
    pub const LAST_KIND: u16 = 0xffef;

    /// The frame `index` of class `kind`.
    pub const fn new(kind: u16, index: u32) -> Self {
        Self { kind, index }
    }
}

impl fmt::Display for FrameId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            INDEX => f.write_str("the index"),
            SUMMARY => f.write_str("the summary"),
            HEADER => f.write_str("the header"),
            Self { kind, index } => write!(f, "frame {kind}.{index}"),
        }
    }
}

/// Whether a frame is part of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Part of the result: enters the step's digest.
    Content,
    /// About the computation (timings, counts): protected as well, but no part of the digest.
    Diagnostic,
}

/// How a payload is stored. It is no part of a frame's meaning: the digest is over decoded bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As it is.
    Raw,
    /// Shuffled by 8-byte words and compressed: for payloads that are mostly `f64`.
    Floats,
    /// As it is in the journal, [`Encoding::Floats`] in a pack: for payloads of which few are committed,
    /// so that compressing the others would be work for nothing.
    FloatsOnceSealed,
}

impl Encoding {
    /// The encoding in a pack.
    pub(crate) fn sealed(self) -> Self {
        match self {
            Self::Raw => Self::Raw,
            Self::Floats | Self::FloatsOnceSealed => Self::Floats,
        }
    }
}

/// A frame as the caller gives and gets it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What it is.
    pub id: FrameId,
    /// Whether it enters the step's digest.
    pub role: Role,
    /// How it is stored.
    pub encoding: Encoding,
    /// Its bytes, decoded.
    pub payload: Vec<u8>,
}

impl Frame {
    /// A frame of the result, compressed as floating-point numbers.
    pub fn content(id: FrameId, payload: Vec<u8>) -> Self {
        Self {
            id,
            role: Role::Content,
            encoding: Encoding::Floats,
            payload,
        }
    }

    /// A frame about the computation, stored as it is.
    pub fn diagnostic(id: FrameId, payload: Vec<u8>) -> Self {
        Self {
            id,
            role: Role::Diagnostic,
            encoding: Encoding::Raw,
            payload,
        }
    }

    /// Refuses what a caller may not store.
    pub(crate) fn validate(&self) -> Result<(), FrameError> {
        if self.id.kind > FrameId::LAST_KIND {
            return Err(FrameError::ReservedKind(self.id));
        }
        if self.payload.len() > MAX_PAYLOAD {
            return Err(FrameError::TooLong {
                id: self.id,
                len: self.payload.len(),
            });
        }
        Ok(())
    }
}

/// A frame's header without magic and checksum: what an index says of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameHeader {
    pub(crate) id: FrameId,
    pub(crate) role: Role,
    pub(crate) encoding: Encoding,
    pub(crate) stored_len: u32,
    pub(crate) decoded_len: u32,
    /// blake3 of the decoded payload.
    pub(crate) hash: Digest,
}

/// Bytes of a header without magic and checksum.
pub(crate) const BARE_LEN: usize = 48;

impl FrameHeader {
    /// Kind, role, encoding, index, lengths, hash; little-endian.
    pub(crate) fn to_bytes(self) -> [u8; BARE_LEN] {
        let mut out = [0; BARE_LEN];
        out[0..2].copy_from_slice(&self.id.kind.to_le_bytes());
        out[2] = match self.role {
            Role::Content => 0,
            Role::Diagnostic => 1,
        };
        out[3] = match self.encoding {
            Encoding::Raw => 0,
            Encoding::Floats => 1,
            Encoding::FloatsOnceSealed => 2,
        };
        out[4..8].copy_from_slice(&self.id.index.to_le_bytes());
        out[8..12].copy_from_slice(&self.stored_len.to_le_bytes());
        out[12..16].copy_from_slice(&self.decoded_len.to_le_bytes());
        out[16..48].copy_from_slice(&self.hash.0);
        out
    }

    pub(crate) fn from_bytes(bytes: &[u8; BARE_LEN]) -> Option<Self> {
        let role = match bytes[2] {
            0 => Role::Content,
            1 => Role::Diagnostic,
            _ => return None,
        };
        let encoding = match bytes[3] {
            0 => Encoding::Raw,
            1 => Encoding::Floats,
            2 => Encoding::FloatsOnceSealed,
            _ => return None,
        };
        Some(Self {
            id: FrameId::new(u16::from_le_bytes([bytes[0], bytes[1]]), u32_at(bytes, 4)),
            role,
            encoding,
            stored_len: u32_at(bytes, 8),
            decoded_len: u32_at(bytes, 12),
            hash: Digest(array_at(bytes, 16)),
        })
    }

    /// Bytes of the whole frame in the file.
    pub(crate) fn frame_len(&self) -> u64 {
        HEADER_LEN as u64 + u64::from(self.stored_len)
    }
}

/// `N` bytes at `at`, which the caller knows to be there.
pub(crate) fn array_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut out = [0; N];
    out.copy_from_slice(&bytes[at..at + N]);
    out
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(array_at(bytes, at))
}

pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(array_at(bytes, at))
}

/// Appends the frame's bytes to `out` and says what its header is.
pub(crate) fn encode(frame: &Frame, out: &mut Vec<u8>) -> Result<FrameHeader, FrameError> {
    encode_as(frame.encoding, frame, out)
}

/// The same in another encoding than the frame's own.
pub(crate) fn encode_as(
    encoding: Encoding,
    frame: &Frame,
    out: &mut Vec<u8>,
) -> Result<FrameHeader, FrameError> {
    let too_long = || FrameError::TooLong {
        id: frame.id,
        len: frame.payload.len(),
    };
    let compressed = match encoding {
        Encoding::Raw | Encoding::FloatsOnceSealed => None,
        // Compression fails only for want of memory, and what does not shrink is better stored as it is.
        Encoding::Floats => codec::compress(&frame.payload)
            .ok()
            .filter(|c| c.len() < frame.payload.len()),
    };
    let (encoding, stored) = match &compressed {
        Some(bytes) => (Encoding::Floats, bytes.as_slice()),
        None if encoding == Encoding::FloatsOnceSealed => {
            (Encoding::FloatsOnceSealed, frame.payload.as_slice())
        }
        None => (Encoding::Raw, frame.payload.as_slice()),
    };
    let header = FrameHeader {
        id: frame.id,
        role: frame.role,
        encoding,
        stored_len: u32::try_from(stored.len()).map_err(|_| too_long())?,
        decoded_len: u32::try_from(frame.payload.len()).map_err(|_| too_long())?,
        hash: Digest::of(&frame.payload),
    };
    let bare = header.to_bytes();
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&bare);
    out.extend_from_slice(&checksum(&bare, stored).to_le_bytes());
    out.extend_from_slice(stored);
    Ok(header)
}

/// crc32 (IEEE) of the header without magic, followed by the stored payload.
fn checksum(bare: &[u8; BARE_LEN], stored: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(bare);
    hasher.update(stored);
    hasher.finalize()
}

/// Checks the bytes of one whole frame; returns its header and its stored payload.
pub(crate) fn parse(bytes: &[u8]) -> Result<(FrameHeader, &[u8]), &'static str> {
    let head = bytes
        .get(..HEADER_LEN)
        .ok_or("it ends within a frame's header")?;
    if head[..4] != MAGIC {
        return Err("no frame begins where one should");
    }
    let bare: [u8; BARE_LEN] = array_at(head, 4);
    let header = FrameHeader::from_bytes(&bare).ok_or("a frame's header makes no sense")?;
    let stored = &bytes[HEADER_LEN..];
    if stored.len() != header.stored_len as usize {
        return Err("a frame has not the length it states");
    }
    if checksum(&bare, stored) != u32_at(head, 52) {
        return Err("the checksum does not fit");
    }
    Ok((header, stored))
}

/// Id and length of the frame with these first bytes, unchecked.
pub(crate) fn peek(head: &[u8; HEADER_LEN]) -> Option<(FrameId, u64)> {
    let header = FrameHeader::from_bytes(&array_at(head, 4))?;
    (head[..4] == MAGIC).then(|| (header.id, header.frame_len()))
}

/// Decodes a checked payload; `None` where it does not decode to its stated length.
pub(crate) fn decode(header: &FrameHeader, stored: &[u8]) -> Option<Vec<u8>> {
    match header.encoding {
        Encoding::Raw | Encoding::FloatsOnceSealed => {
            (header.stored_len == header.decoded_len).then(|| stored.to_vec())
        }
        Encoding::Floats => codec::decompress(stored, header.decoded_len as usize),
    }
}

/// Reads the next frame into `buffer` (the whole frame, header included) if it is sound; `None` at the
/// end of the file and at anything that is no sound frame. `left` is what the file still holds: a damaged
/// length must not make us allocate more.
pub(crate) fn read_next(
    reader: &mut impl Read,
    left: u64,
    buffer: &mut Vec<u8>,
) -> io::Result<Option<FrameHeader>> {
    if left < HEADER_LEN as u64 {
        return Ok(None);
    }
    buffer.resize(HEADER_LEN, 0);
    reader.read_exact(buffer)?;
    let stored_len = u32_at(buffer, 12);
    if HEADER_LEN as u64 + u64::from(stored_len) > left {
        return Ok(None);
    }
    buffer.resize(HEADER_LEN + stored_len as usize, 0);
    reader.read_exact(&mut buffer[HEADER_LEN..])?;
    Ok(parse(buffer).ok().map(|(header, _)| header))
}

/// The digest of a set of frames: blake3 over the content frames in the order of their ids, each as kind,
/// index, decoded length (little-endian, 2 + 4 + 4 bytes) and the blake3 of its decoded payload.
///
/// It depends on what the frames say and on nothing else: not on compression, order of arrival or file.
pub(crate) fn content_digest<'a>(sorted: impl Iterator<Item = &'a FrameHeader>) -> Digest {
    let mut hasher = blake3::Hasher::new();
    for header in sorted.filter(|h| h.role == Role::Content) {
        hasher.update(&header.id.kind.to_le_bytes());
        hasher.update(&header.id.index.to_le_bytes());
        hasher.update(&header.decoded_len.to_le_bytes());
        hasher.update(&header.hash.0);
    }
    Digest(*hasher.finalize().as_bytes())
}
