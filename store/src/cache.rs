//! The cache: payloads that can be computed again, under a key of the caller's.

use std::path::Path;

use crate::error::{CacheError, ReadError};
use crate::files;
use crate::frame::{Frame, FrameId};
use crate::id::Digest;
use crate::layout::Layout;
use crate::pack::{PackFile, PackWriter};

const PAYLOAD: FrameId = FrameId::new(0, 0);

/// The payload under `key`. A damaged entry counts as missing: what is cached can be computed again.
pub(crate) fn get(layout: &Layout, key: &Digest) -> Option<Vec<u8>> {
    let path = layout.cache_entry(key);
    match read(&path, key) {
        Ok(payload) => Some(payload),
        Err(ReadError::Io(error)) if error.is_missing() => None,
        Err(error) => {
            tracing::warn!(path = %path.display(), %error, "a cache entry cannot be used");
            None
        }
    }
}

/// Reads an entry and checks that it belongs to its key.
pub(crate) fn read(path: &Path, key: &Digest) -> Result<Vec<u8>, ReadError> {
    let pack = PackFile::open(path)?;
    if pack.frame(crate::frame::HEADER)? != key.0 {
        return Err(pack.damaged("it belongs to another key"));
    }
    pack.frame(PAYLOAD)
}

/// Puts `payload` under `key`, replacing what was there.
pub(crate) fn put(layout: &Layout, key: &Digest, payload: Vec<u8>) -> Result<(), CacheError> {
    let frame = Frame::content(PAYLOAD, payload);
    frame.validate()?;
    files::create_folder(&layout.cache())?;
    let mut pack = PackWriter::create(&layout.cache_entry(key), key.0.to_vec())?;
    pack.append(&frame)?;
    pack.seal()?;
    Ok(())
}
