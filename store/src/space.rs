//! Disk space: what the store takes, and whether the next step fits.

use std::path::Path;

use crate::error::{IoFailure, ReadError, SpaceError};
use crate::files;
use crate::layout::Layout;
use crate::source::Source;

/// Bytes kept free for everything but the steps: database, records, events.
pub(crate) const RESERVE: u64 = 64 << 20;
/// Free bytes below which the database is left alone: sled does not survive a full disk.
pub(crate) const DATABASE_FLOOR: u64 = 16 << 20;
/// A step at its largest: the wave it started from, its last wave, and the pack made of that.
const COPIES: u64 = 3;

/// Sizes and counts of a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreInfo {
    /// Number of runs.
    pub runs: usize,
    /// Number of committed steps, each counted once.
    pub steps: usize,
    /// Bytes of the runs' folders: packs, journals, records, events.
    pub pack_bytes: u64,
    /// Bytes of the database.
    pub meta_bytes: u64,
    /// Bytes of the cache.
    pub cache_bytes: u64,
    /// Bytes free for this user on the store's disk.
    pub free_bytes: u64,
}

pub(crate) fn info(source: &impl Source) -> Result<StoreInfo, ReadError> {
    let layout = source.layout();
    let names = layout.run_names()?;
    let mut steps = 0;
    for name in &names {
        steps += source.own_steps(name)?.len();
    }
    Ok(StoreInfo {
        runs: names.len(),
        steps,
        pack_bytes: files::bytes_below(&layout.packs()),
        meta_bytes: files::bytes_below(&layout.meta()),
        cache_bytes: files::bytes_below(&layout.cache()),
        free_bytes: free(layout)?,
    })
}

/// Bytes free for this user on the disk where a store in `dir` is or would be.
///
/// # Errors
/// The system does not say.
pub fn free_space_at(dir: &Path) -> Result<u64, IoFailure> {
    let there = dir.ancestors().find(|folder| folder.is_dir());
    free(&Layout::new(there.unwrap_or(Path::new("."))))
}

/// Bytes free for this user on the store's disk.
pub(crate) fn free(layout: &Layout) -> Result<u64, IoFailure> {
    let stat = rustix::fs::statvfs(layout.root())
        .map_err(|errno| IoFailure::of("ask for the free space of", layout.root())(errno.into()))?;
    Ok(stat.f_bavail.saturating_mul(stat.f_frsize))
}

/// Refuses where less than 1.2 × (three copies of a step) + 64 MiB is free.
pub(crate) fn guard(layout: &Layout, expected_step: u64) -> Result<(), SpaceError> {
    let copies = expected_step.saturating_mul(COPIES);
    let needed = copies.saturating_add(copies / 5).saturating_add(RESERVE);
    let free = free(layout)?;
    if free < needed {
        let dir = layout.root().to_owned();
        return Err(SpaceError::Full { dir, free, needed });
    }
    Ok(())
}
