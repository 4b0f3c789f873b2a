//! A folder with a store, and `femdem-flow` at work in it.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::process::{Pid, kill_process};
use tempfile::TempDir;

use crate::folder;

pub use rustix::process::Signal;

/// A temporary folder with a store called `store`. It goes when this is dropped.
#[derive(Debug)]
pub struct Workplace {
    dir: TempDir,
}

/// How a command ended.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code; `None` where a signal ended it.
    pub code: Option<i32>,
    /// The signal that ended it.
    pub signal: Option<i32>,
    /// What it wrote to stdout.
    pub out: String,
    /// What it wrote to stderr.
    pub err: String,
}

/// A command that is at work.
#[derive(Debug)]
pub struct Session {
    child: Child,
    out: PathBuf,
    err: PathBuf,
}

impl Default for Workplace {
    fn default() -> Self {
        Self::new()
    }
}

impl Workplace {
    /// A new, empty one.
    pub fn new() -> Self {
        Self::below(&std::env::temp_dir())
    }

    /// A new, empty one in this folder.
    pub fn below(folder: &Path) -> Self {
        let dir = tempfile::tempdir_in(folder);
        Self {
            dir: dir.expect("the system has room for a temporary folder"),
        }
    }

    /// Its folder.
    pub fn dir(&self) -> &Path {
        self.dir.path()
    }

    /// The folder of its store, which may not exist yet.
    pub fn store(&self) -> PathBuf {
        self.dir().join("store")
    }

    /// Writes the file `name` and returns its path.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.dir().join(name);
        fs::write(&path, text).expect("a temporary folder can be written to");
        path
    }

    /// A new one with copies of all its files, the store among them.
    pub fn copy(&self) -> Self {
        let copy = Self::new();
        folder::copy(self.dir(), copy.dir());
        copy
    }

    /// Runs `femdem-flow` with these arguments on the store of this place, to its end.
    pub fn run<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Outcome {
        self.start(args).wait()
    }

    /// Starts `femdem-flow` with these arguments on the store of this place.
    pub fn start<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Session {
        self.start_in(args, &[])
    }

    /// The same with these additions to its environment.
    pub fn start_in<S: AsRef<OsStr>>(
        &self,
        args: impl IntoIterator<Item = S>,
        environment: &[(&str, OsString)],
    ) -> Session {
        let mut command = Command::new(crate::binary::femdem_flow());
        command.envs(environment.iter().map(|(key, value)| (key, value)));
        self.launch(command, args)
    }

    /// The same where no file may grow beyond so many blocks of 512 bytes.
    pub fn start_with_file_limit<S: AsRef<OsStr>>(
        &self,
        args: impl IntoIterator<Item = S>,
        blocks: u32,
    ) -> Session {
        // Without the trap the system would end the process by a signal instead of refusing the write.
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command
            .args(["-c", &script])
            .arg(crate::binary::femdem_flow());
        self.launch(command, args)
    }

    fn launch<S: AsRef<OsStr>>(
        &self,
        mut command: Command,
        args: impl IntoIterator<Item = S>,
    ) -> Session {
        // Files rather than pipes: nobody has to read them for the program to go on. Not beside the store, which may
        // lie on a full disk.
        let new = |what: &str| {
            let file = tempfile::Builder::new().prefix(what).tempfile();
            file.and_then(|file| file.keep().map_err(Into::into))
                .expect("the system has room for a temporary file")
        };
        let ((out, out_path), (err, err_path)) = (new("stdout-"), new("stderr-"));
        let child = command
            .args(args)
            .arg("--store")
            .arg(self.store())
            .current_dir(self.dir())
            .env_remove("RUST_LOG")
            .stdin(std::process::Stdio::null())
            .stdout(out)
            .stderr(err)
            .spawn();
        Session {
            child: child.expect("femdem-flow can be started"),
            out: out_path,
            err: err_path,
        }
    }
}

impl Session {
    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Whether it is still at work.
    pub fn is_alive(&mut self) -> bool {
        self.child
            .try_wait()
            .expect("a child can be asked")
            .is_none()
    }

    /// Sends it a signal; a process that has ended already does not mind.
    pub fn signal(&self, signal: Signal) {
        // The child is not yet waited for where it is alive, so the id cannot be another's.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// Where the program panicked: whatever happens, it must end in words of its own.
    pub fn wait(self) -> Outcome {
        self.end(Duration::MAX)
            .unwrap_or_else(|error| panic!("{error}"))
    }

    /// Waits for its end, no longer than `limit`; then it is killed.
    ///
    /// # Errors
    /// It took longer, or panicked.
    pub fn end(mut self, limit: Duration) -> Result<Outcome, String> {
        let since = Instant::now();
        while limit < Duration::MAX && self.is_alive() && since.elapsed() < limit {
            sleep(Duration::from_millis(1));
        }
        let hangs = limit < Duration::MAX && self.is_alive();
        if hangs {
            self.signal(Signal::KILL);
        }
        let status = self.child.wait().expect("a child can be waited for");
        let outcome = Outcome::new(status, &self.out, &self.err);
        if hangs {
            return Err(format!("it hangs, after {limit:?}: {outcome:#?}"));
        }
        match outcome.panicked() {
            true => Err(format!("it panicked: {}", outcome.err)),
            false => Ok(outcome),
        }
    }
}

impl Outcome {
    fn new(status: ExitStatus, out: &Path, err: &Path) -> Self {
        let read = |path: &Path| {
            let bytes = fs::read(path).expect("what the program wrote can be read");
            let _ = fs::remove_file(path);
            String::from_utf8(bytes).expect("the program writes UTF-8")
        };
        Self {
            code: status.code(),
            signal: status.signal(),
            out: read(out),
            err: read(err),
        }
    }

    /// Whether the program met a bug of its own, in the words of Rust or in its own, or was brought down by the system.
    fn panicked(&self) -> bool {
        let words = ["panicked at", "has a bug"];
        self.code == Some(101)
            || self.signal == Some(6)
            || self.signal == Some(11)
            || words.iter().any(|words| self.err.contains(words))
    }

    /// This, if the command succeeded.
    ///
    /// # Panics
    /// Where it did not, with what it wrote.
    pub fn success(self) -> Self {
        self.ended_with(0)
    }

    /// This, if the command ended with this exit code.
    ///
    /// # Panics
    /// Where it ended otherwise, with what it wrote.
    pub fn ended_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{self:#?}");
        self
    }
}
