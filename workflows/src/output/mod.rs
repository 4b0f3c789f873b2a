//! Files for other programs. They are derived from committed steps, never the other way round, and each appears whole or
//! not at all.

mod base64;
pub mod csv;
mod file;
pub mod pvd;
mod vtk;
pub mod vtp;
pub mod vtu;

use std::path::{Path, PathBuf};

use thiserror::Error;

/// Writes `text` to `path`.
///
/// # Errors
/// The file system's refusal; then there is no file, or still the old one.
pub fn write_text(path: &Path, text: &str) -> Result<(), WriteError> {
    write_bytes(path, text.as_bytes())
}

/// Writes `bytes` to `path`.
///
/// # Errors
/// As [`write_text`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    file::write_whole(path, |out| out.write_all(bytes))
}

/// Why a file could not be written. Reads after "failed to write the output".
#[derive(Debug, Error)]
pub enum WriteError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Its reason.
        source: std::io::Error,
    },
    /// An array does not have one value for each point, cell or column.
    #[error("`{name}` has {found} values where {expected} belong")]
    Count {
        /// The array.
        name: String,
        /// The number of points, cells or columns.
        expected: usize,
        /// The number of its values.
        found: usize,
    },
    /// A cell refers to a point that does not exist.
    #[error("cell {cell} refers to point {point}, there are only {points}")]
    Connectivity {
        /// The cell, from 0.
        cell: usize,
        /// The point, from 0.
        point: u32,
        /// The number of points.
        points: usize,
    },
}
