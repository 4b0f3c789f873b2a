//! Bringing the running step onto the disk.

use std::fs::File;

use crate::error::IoFailure;
use crate::files;
use crate::id::RunName;
use crate::layout::RunFile;
use crate::store::Store;

impl Store {
    /// Has the operating system write what is journalled of the run's next step, and its event log, onto the disk: what
    /// was flushed ([`StepJournal::flush`](crate::StepJournal::flush)) survives a power cut from here on. Committed steps
    /// always do. Safe beside the writer of the journal. Returns the bytes of the journal.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn sync_run(&self, run: &RunName) -> Result<u64, IoFailure> {
        let layout = &self.inner.layout;
        let parts = layout
            .run_files(run)?
            .into_iter()
            .filter(|(_, file)| matches!(file, RunFile::Part(..)))
            .map(|(path, _)| path);
        let mut bytes = 0;
        for path in parts.chain([layout.events(run)]) {
            match File::open(&path) {
                Ok(file) => {
                    file.sync_all().map_err(IoFailure::of("flush", &path))?;
                    if path.extension().is_some_and(|end| end == "part") {
                        bytes += file.metadata().map_or(0, |data| data.len());
                    }
                }
                // Its step was committed or cut meanwhile.
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                Err(error) => return Err(IoFailure::of("open", &path)(error)),
            }
        }
        files::sync_folder(&layout.run(run))?;
        Ok(bytes)
    }
}
