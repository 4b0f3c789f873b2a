//! The `FORMAT` file: one line of text that says what the folder is.

use std::fs;
use std::io;

use crate::error::{Damage, IoFailure, OpenError};
use crate::files;
use crate::layout::Layout;

/// The version of the on-disk format that this crate writes.
pub const VERSION: u64 = 2;
/// The oldest version that it reads, and takes along when it opens a store for writing.
pub(crate) const OLDEST: u64 = 1;
/// The whole content of `FORMAT`.
pub(crate) const LINE: &str = "femdem-flow store format 2\n";
const PREFIX: &str = "femdem-flow store format ";

/// What `FORMAT` says about the folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// A store of this version.
    Known,
    /// A store of this earlier version. All that is in it means the same in the present one.
    Earlier(u64),
    /// No store yet, and nothing in the way of making one.
    Nothing,
}

/// Reads `FORMAT`. A folder that holds anything beside what an interrupted creation leaves is refused.
pub(crate) fn read(layout: &Layout) -> Result<Found, OpenError> {
    let path = layout.format();
    match fs::read(&path) {
        Ok(bytes) => parse(layout, &bytes),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let entries = files::list(layout.root())?;
            if entries.iter().any(|name| name == "FORMAT") {
                // Somebody is just making the store.
                return read(layout);
            }
            if entries
                .iter()
                .all(|name| name == "LOCK" || name == "FORMAT.tmp")
            {
                Ok(Found::Nothing)
            } else {
                Err(OpenError::NotAStore {
                    dir: layout.root().to_owned(),
                })
            }
        }
        Err(error) => Err(IoFailure::of("read", &path)(error).into()),
    }
}

fn parse(layout: &Layout, bytes: &[u8]) -> Result<Found, OpenError> {
    if bytes == LINE.as_bytes() {
        return Ok(Found::Known);
    }
    let number = std::str::from_utf8(bytes)
        .ok()
        .and_then(|text| text.strip_prefix(PREFIX)?.strip_suffix('\n'))
        .and_then(|number| number.parse::<u64>().ok());
    match number {
        Some(found) if (OLDEST..VERSION).contains(&found) => Ok(Found::Earlier(found)),
        Some(found) if found != VERSION => Err(OpenError::UnknownFormat {
            dir: layout.root().to_owned(),
            found,
        }),
        _ => Err(Damage::new(
            &layout.format(),
            "it does not name a format",
            format!(
                "if this version wrote the store, its only line is `{}`",
                LINE.trim_end()
            ),
        )
        .into()),
    }
}

/// Writes `FORMAT`: the first file of a new store, the only one that an upgrade changes.
pub(crate) fn write(layout: &Layout) -> Result<(), IoFailure> {
    files::write_atomic(&layout.format(), LINE.as_bytes())
}
