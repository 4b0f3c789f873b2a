//! A file that appears whole or not at all.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use super::WriteError;

/// Writes `path` through a temporary neighbour that is renamed when it is complete. Missing folders are made.
pub fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), WriteError> {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    // The number keeps two processes that export the same run apart.
    let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let write = || {
        if let Some(folder) = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty())
        {
            fs::create_dir_all(folder)?;
        }
        let mut file = BufWriter::new(File::create(&temporary)?);
        content(&mut file)?;
        file.into_inner()
            .map_err(|error| error.into_error())?
            .sync_data()?;
        fs::rename(&temporary, path)
    };
    write().map_err(|source| {
        // Nothing more can be done where even this fails; the reason to report is the first one.
        let _ = fs::remove_file(&temporary);
        WriteError::Io {
            path: path.to_owned(),
            source,
        }
    })
}
