//! Why a session was stopped in order.

use super::{Asker, Extent};
use crate::failure::FailureKind;

/// Why a session was stopped in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// By this signal to the process.
    Signal(i32),
    /// Its deadline came.
    Deadline,
    /// Somebody asked for it.
    Request(Asker, Extent),
}

impl Stop {
    /// For lists and logs.
    pub fn in_words(&self) -> String {
        match self {
            Self::Signal(number) => format!("stopped by signal {number}"),
            Self::Deadline => "stopped at its deadline".to_owned(),
            Self::Request(by, _) => format!("cancelled by {by}"),
        }
    }

    /// The class of the failure of a command that ended so.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Signal(number) => FailureKind::of_signal(*number),
            Self::Deadline => FailureKind::Deadline,
            // The same as the signal that it stands for.
            Self::Request(..) => FailureKind::Terminated,
        }
    }

    /// Whether the process ends too, rather than going on with what else it has to compute.
    pub fn ends_the_process(&self) -> bool {
        !matches!(self, Self::Request(_, Extent::Run))
    }
}
