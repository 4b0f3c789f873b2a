//! A failure as the command line reports it: what failed, why, what to do about it, and with which exit code.

use std::error::Error;
use std::fmt;

use crate::input::InputErrors;
use crate::report::Report;

/// The classes of failure, each with its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureKind {
    /// The computation failed, or something else went wrong: 1.
    Run,
    /// The command line or the input is wrong; nothing was touched: 2.
    Usage,
    /// The store is locked, damaged, full or not there: 3.
    Store,
    /// Stopped in order because the deadline of `--until` came; the run can be resumed: 75, the code of sysexits(3) for
    /// "try again later".
    Deadline,
    /// Stopped by SIGINT, in order; the run can be resumed: 130.
    Interrupted,
    /// Stopped by SIGTERM or `cancel`, in order; the run can be resumed: 143.
    Terminated,
}

impl FailureKind {
    /// The exit code of the process.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Run => 1,
            Self::Usage => 2,
            Self::Store => 3,
            Self::Deadline => 75,
            Self::Interrupted => 130,
            Self::Terminated => 143,
        }
    }

    /// The class with this exit code; `None` for success.
    pub fn of_exit_code(code: u64) -> Option<Self> {
        match code {
            0 => None,
            2 => Some(Self::Usage),
            3 => Some(Self::Store),
            75 => Some(Self::Deadline),
            130 => Some(Self::Interrupted),
            143 => Some(Self::Terminated),
            _ => Some(Self::Run),
        }
    }

    /// The class of a computation that this signal stopped in order.
    pub fn of_signal(signal: i32) -> Self {
        const SIGTERM: i32 = 15;
        if signal == SIGTERM {
            Self::Terminated
        } else {
            Self::Interrupted
        }
    }

    /// One word for machines.
    pub fn word(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Usage => "usage",
            Self::Store => "store",
            Self::Deadline => "deadline",
            Self::Interrupted => "interrupted",
            Self::Terminated => "terminated",
        }
    }
}

/// A verb that did not do what it was asked for.
#[derive(Debug)]
pub struct Failure {
    kind: FailureKind,
    message: String,
    source: Option<Box<dyn Error + Send + Sync>>,
    input: Option<Box<InputErrors>>,
    hint: Option<String>,
    report: Option<Box<Report>>,
}

impl Failure {
    /// A failure of this kind; `message` is a whole phrase ("failed to open the store").
    pub fn new(kind: FailureKind, message: impl Into<String>) -> Self {
        Self {
            kind,
            message: message.into(),
            source: None,
            input: None,
            hint: None,
            report: None,
        }
    }

    /// With its cause.
    pub fn because(mut self, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        self.source = Some(source.into());
        self
    }

    /// With what the user can do about it.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// With what there is to report in spite of it; it goes to stdout.
    pub fn with(mut self, report: Report) -> Self {
        self.report = Some(Box::new(report));
        self
    }

    /// The class it belongs to.
    pub fn kind(&self) -> FailureKind {
        self.kind
    }

    /// What the user can do about it.
    pub fn advice(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// What there is to report in spite of it.
    pub fn report(&self) -> Option<&Report> {
        self.report.as_deref()
    }

    /// All that is wrong with the input, where that is the reason.
    pub fn input(&self) -> Option<&InputErrors> {
        self.input.as_deref()
    }

    /// The message and its causes, outermost first. A cause that its predecessor already quotes is left out.
    pub fn causes(&self) -> Vec<String> {
        let mut causes = vec![self.message.clone()];
        let mut next = self.source.as_deref().map(|source| source as &dyn Error);
        while let Some(cause) = next {
            let text = cause.to_string();
            if !causes.last().is_some_and(|last| last.ends_with(&text)) {
                causes.push(text);
            }
            next = cause.source();
        }
        causes
    }
}

impl From<InputErrors> for Failure {
    fn from(errors: InputErrors) -> Self {
        let count = errors.errors.len();
        let problems = if count == 1 {
            "one problem".to_owned()
        } else {
            format!("{count} problems")
        };
        let message = format!("failed to read the input: {problems} in {}", errors.file);
        Self {
            input: Some(Box::new(errors)),
            ..Self::new(FailureKind::Usage, message)
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Failure {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.source
            .as_deref()
            .map(|source| source as &(dyn Error + 'static))
    }
}
