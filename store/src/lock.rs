//! One process owns a store: `flock` on `LOCK`, which names the owner for the others.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, Write};

use rustix::fs::{FlockOperation, flock};

use crate::error::{IoFailure, OpenError};
use crate::layout::Layout;

/// The lock, held until dropped. The file stays: removing it would let two owners lock two files.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
}

impl Lock {
    pub(crate) fn take(layout: &Layout) -> Result<Self, OpenError> {
        let path = layout.lock();
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(IoFailure::of("open", &path))?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(rustix::io::Errno::WOULDBLOCK) => {
                let (pid, host) = holder(&mut file);
                let dir = layout.root().to_owned();
                return Err(OpenError::Held { dir, pid, host });
            }
            Err(errno) => return Err(IoFailure::of("lock", &path)(errno.into()).into()),
        }
        let host = rustix::system::uname()
            .nodename()
            .to_string_lossy()
            .into_owned();
        let text = format!("pid {}\nhost {host}\n", std::process::id());
        file.set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(text.as_bytes()))
            .map_err(IoFailure::of("write", &path))?;
        Ok(Self { file })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing alone would not do: a child that this process is just starting has a copy of the descriptor until
        // it runs its own program, and the lock lasts as long as any copy is open.
        if let Err(errno) = flock(&self.file, FlockOperation::Unlock) {
            tracing::warn!(%errno, "the store's lock could not be released before its file is closed");
        }
    }
}

/// What `LOCK` says of its owner, which may be nothing in the instant after it was taken.
fn holder(file: &mut File) -> (Option<u32>, Option<String>) {
    let mut bytes = Vec::new();
    if file.take(4096).read_to_end(&mut bytes).is_err() {
        return (None, None);
    }
    let text = String::from_utf8_lossy(&bytes);
    let value = |key: &str| {
        text.lines()
            .find_map(|line| line.strip_prefix(key).map(str::trim))
    };
    (
        value("pid ").and_then(|pid| pid.parse().ok()),
        value("host ").map(str::to_owned),
    )
}
