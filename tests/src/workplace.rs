//! A folder with a store, and `femdem-flow` at work in it.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};

use rustix::process::{Pid, kill_process};
use tempfile::TempDir;

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
        Self {
            dir: tempfile::tempdir().expect("the system has room for a temporary folder"),
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

    /// Runs `femdem-flow` with these arguments on the store of this place, to its end.
    pub fn run<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Outcome {
        self.start(args).wait()
    }

    /// Starts `femdem-flow` with these arguments on the store of this place.
    pub fn start<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Session {
        // Files rather than pipes: nobody has to read them for the program to go on.
        let new = |what: &str| {
            let file = tempfile::Builder::new()
                .prefix(what)
                .tempfile_in(self.dir());
            file.and_then(|file| file.keep().map_err(Into::into))
                .expect("a temporary folder can be written to")
        };
        let ((out, out_path), (err, err_path)) = (new("stdout-"), new("stderr-"));
        Session {
            child: self.spawn(args, out, err),
            out: out_path,
            err: err_path,
        }
    }

    fn spawn<S: AsRef<OsStr>>(
        &self,
        args: impl IntoIterator<Item = S>,
        out: File,
        err: File,
    ) -> Child {
        Command::new(crate::binary::femdem_flow())
            .args(args)
            .arg("--store")
            .arg(self.store())
            .current_dir(self.dir())
            .env_remove("RUST_LOG")
            .stdin(std::process::Stdio::null())
            .stdout(out)
            .stderr(err)
            .spawn()
            .expect("femdem-flow can be started")
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
    pub fn wait(mut self) -> Outcome {
        let status = self.child.wait().expect("a child can be waited for");
        Outcome::new(status, &self.out, &self.err)
    }
}

impl Outcome {
    fn new(status: ExitStatus, out: &Path, err: &Path) -> Self {
        let read = |path: &Path| {
            let bytes = fs::read(path).expect("what the program wrote can be read");
            let _ = fs::remove_file(path);
            String::from_utf8(bytes).expect("the program writes UTF-8")
        };
        let outcome = Self {
            code: status.code(),
            signal: status.signal(),
            out: read(out),
            err: read(err),
        };
        assert!(
            outcome.code != Some(101) && !outcome.err.contains("panicked at"),
            "{}",
            outcome.err
        );
        outcome
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
