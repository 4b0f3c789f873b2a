//! Small checked files: magic, length, payload, blake3. Written whole, atomically.

use std::fs;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{Damage, IoFailure, ReadError};
use crate::files;
use crate::frame::u64_at;

const MAGIC: [u8; 8] = *b"FDFREC1\n";
const HASH_LEN: usize = 32;
const MIN_LEN: usize = MAGIC.len() + 8 + HASH_LEN;

/// The file's bytes for `value`.
fn seal(value: &impl Serialize) -> Vec<u8> {
    let payload = to_rmp(value);
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&payload);
    let hash = blake3::hash(&bytes);
    bytes.extend_from_slice(hash.as_bytes());
    bytes
}

fn open(bytes: &[u8]) -> Result<&[u8], &'static str> {
    if bytes.len() < MIN_LEN {
        return Err("it is too short");
    }
    let (body, hash) = bytes.split_at(bytes.len() - HASH_LEN);
    if body[..8] != MAGIC {
        return Err("it does not begin as a record does");
    }
    if blake3::hash(body).as_bytes() != hash {
        return Err("its hash does not fit");
    }
    if u64_at(body, 8) != (body.len() - 16) as u64 {
        return Err("it has not the length it states");
    }
    Ok(&body[16..])
}

/// The store's own small values as MessagePack, structs as arrays.
pub(crate) fn to_rmp(value: &impl Serialize) -> Vec<u8> {
    rmp_serde::to_vec(value).expect("the store's own plain types always serialise into memory")
}

/// Writes `value` to `path`: the old record or the new one survives a crash.
pub(crate) fn write(path: &Path, value: &impl Serialize) -> Result<(), IoFailure> {
    files::write_atomic(path, &seal(value))
}

/// The value of a whole record in memory; what is wrong with it otherwise.
pub(crate) fn unseal<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let payload = open(bytes)?;
    rmp_serde::from_slice(payload).map_err(|error| format!("it does not decode ({error})"))
}

/// Reads the record at `path`.
pub(crate) fn read<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<T, ReadError> {
    let bytes = fs::read(path).map_err(IoFailure::of("read", path))?;
    unseal(&bytes).map_err(|what| Damage::new(path, what, remedy).into())
}
