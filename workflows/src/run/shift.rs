//! A shift: the time that one process computes runs of a store.

use std::time::SystemTime;

use store::Store;

use super::{Context, control::Signals, error::RunError, open::explain, session::Equipment};
use crate::failure::Failure;

/// On what terms a process computes.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// When to stop in order, at the latest.
    pub deadline: Option<SystemTime>,
}

/// The time that a process computes.
pub struct Shift<'a> {
    /// Where and how.
    pub context: &'a Context<'a>,
    /// On what terms.
    pub terms: &'a Terms,
    signals: Signals,
}

impl<'a> Shift<'a> {
    /// Begins: from here on signals stop what is computed, and nothing else.
    pub fn begin(context: &'a Context<'a>, terms: &'a Terms) -> Result<Self, Failure> {
        let signals = Signals::listen().map_err(|error| {
            let why = RunError::Engine(format!("listen to signals: {error}"));
            explain("begin", why)
        })?;
        Ok(Self {
            context,
            terms,
            signals,
        })
    }

    /// What sessions on `store` work with.
    pub fn equipment(&'a self, store: &'a Store) -> Equipment<'a> {
        Equipment {
            store,
            threads: self.context.threads(),
            progress: self.context.progress,
            signals: &self.signals,
            deadline: self.terms.deadline,
        }
    }
}
