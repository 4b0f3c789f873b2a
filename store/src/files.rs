//! The few file operations a crash must not tear: whole-file replacement and folder synchronisation.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::IoFailure;

/// `path` with `.tmp` appended: where a file is written before it takes its name.
pub(crate) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".tmp");
    PathBuf::from(name)
}

/// Replaces `path` by `bytes`: a crash leaves the old file or the new one, never a mixture.
pub(crate) fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), IoFailure> {
    let tmp = temporary(path);
    write_synced(&tmp, bytes)?;
    rename_durably(&tmp, path)
}

/// Writes a file that nobody looks at yet; nothing of it is left after a failure.
pub(crate) fn write_synced(path: &Path, bytes: &[u8]) -> Result<(), IoFailure> {
    let written = File::create(path)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .map_err(IoFailure::of("write", path));
    if written.is_err() {
        // Best effort: a full disk is the usual reason, and the torn file would keep it full.
        let _ = fs::remove_file(path);
    }
    written
}

/// Renames and makes the new name survive a power cut.
pub(crate) fn rename_durably(from: &Path, to: &Path) -> Result<(), IoFailure> {
    fs::rename(from, to).map_err(IoFailure::of("rename", from))?;
    match to.parent() {
        // A bare name lies in the working folder.
        Some(parent) if parent.as_os_str().is_empty() => sync_folder(Path::new(".")),
        Some(parent) => sync_folder(parent),
        None => Ok(()),
    }
}

/// Flushes a folder's entries to the disk.
pub(crate) fn sync_folder(dir: &Path) -> Result<(), IoFailure> {
    File::open(dir)
        .and_then(|file| file.sync_all())
        .map_err(IoFailure::of("flush the folder", dir))
}

/// Creates a folder and its parents; an existing one is fine.
pub(crate) fn create_folder(dir: &Path) -> Result<(), IoFailure> {
    fs::create_dir_all(dir).map_err(IoFailure::of("create the folder", dir))
}

/// Removes a file; a missing one is fine.
pub(crate) fn remove_file(path: &Path) -> Result<(), IoFailure> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(IoFailure::of("remove", path)(error))
        }
        _ => Ok(()),
    }
}

/// The entries of a folder in the order of their names, those that are not Unicode left out (the store
/// writes none); a missing folder has none.
pub(crate) fn list(dir: &Path) -> Result<Vec<String>, IoFailure> {
    let entries = match fs::read_dir(dir) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(IoFailure::of("list the folder", dir))?,
    };
    let mut names = Vec::new();
    for entry in entries {
        let entry = entry.map_err(IoFailure::of("list the folder", dir))?;
        if let Ok(name) = entry.file_name().into_string() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Bytes of all files below `path`, links not followed; what vanishes meanwhile counts as nothing.
pub(crate) fn bytes_below(path: &Path) -> u64 {
    let Ok(meta) = fs::symlink_metadata(path) else {
        return 0;
    };
    if !meta.is_dir() {
        return meta.len();
    }
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    entries.map(|entry| bytes_below(&entry.path())).sum()
}
