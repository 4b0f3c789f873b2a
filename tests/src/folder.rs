//! Folders: listed, copied.

use std::fs;
use std::path::{Path, PathBuf};

/// Every file below `folder`, in the order of their paths.
///
/// # Panics
/// Where a folder cannot be listed.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files
}

fn collect(folder: &Path, into: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("a folder of the test can be listed");
    let mut entries: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            collect(&path, into);
        } else {
            into.push(path);
        }
    }
}

/// Copies every file below `from` to the same place below `to`.
///
/// # Panics
/// Where a file cannot be copied.
pub fn copy(from: &Path, to: &Path) {
    for file in files_below(from) {
        let inside = file.strip_prefix(from).expect("it lies below");
        let target = to.join(inside);
        let folder = target.parent().expect("a file lies in a folder");
        fs::create_dir_all(folder).expect("a folder can be made");
        fs::copy(&file, target).expect("a file can be copied");
    }
}
