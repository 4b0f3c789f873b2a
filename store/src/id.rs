//! The names of things in a store: runs, load steps, waves, frames, digests.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Readable name of a run, also the name of its folder.
///
/// 1 to 64 characters out of `A–Z a–z 0–9 . _ -`, the first a letter or a digit: safe as a folder name
/// everywhere, and free of the `@` and `:` of addresses.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct RunName(String);

/// Why a text is no run name.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "`{0}` is no run name: 1 to 64 letters, digits, `.`, `_` or `-`, the first a letter or a digit"
)]
pub struct RunNameError(String);

impl RunName {
    /// Longest name, in bytes.
    pub const MAX_LEN: usize = 64;

    /// Checks `name` and makes it a run name.
    pub fn new(name: impl Into<String>) -> Result<Self, RunNameError> {
        let name = name.into();
        let good_start = name
            .bytes()
            .next()
            .is_some_and(|b| b.is_ascii_alphanumeric());
        let good_rest = name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'_' | b'-'));
        if good_start && good_rest && name.len() <= Self::MAX_LEN {
            Ok(Self(name))
        } else {
            Err(RunNameError(name))
        }
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// `base-n`, shortened at the end of `base` where the whole would be too long.
    pub(crate) fn with_suffix(&self, n: u64) -> Self {
        let suffix = format!("-{n}");
        let kept = self.0.len().min(Self::MAX_LEN - suffix.len());
        Self(format!("{}{suffix}", &self.0[..kept]))
    }
}

impl fmt::Display for RunName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for RunName {
    type Err = RunNameError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Self::new(s)
    }
}

impl TryFrom<String> for RunName {
    type Error = RunNameError;
    fn try_from(s: String) -> Result<Self, Self::Error> {
        Self::new(s)
    }
}

impl From<RunName> for String {
    fn from(name: RunName) -> Self {
        name.0
    }
}

/// Number of a committed load step; consecutive along a run and its ancestors.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Default,
)]
#[serde(transparent)]
pub struct StepIndex(pub u32);

impl fmt::Display for StepIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Number of a wave (one Newton iteration's tasks) inside the running step.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Default,
)]
#[serde(transparent)]
pub struct WaveIndex(pub u32);

impl fmt::Display for WaveIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Where a committed step lies: `RUN@STEP`, the run being the one whose folder holds the pack.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct StepAddress {
    /// The run that committed the step.
    pub run: RunName,
    /// The step.
    pub step: StepIndex,
}

impl fmt::Display for StepAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.run, self.step)
    }
}

/// A blake3 hash: of a step's content, of a cache key. Displays as 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Digest(#[serde(with = "serde_bytes")] pub [u8; 32]);

impl Digest {
    /// The blake3 hash of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// The first twelve hexadecimal digits, for tables.
    pub fn short(&self) -> String {
        self.to_string()[..12].to_owned()
    }

    pub(crate) fn from_hex(text: &str) -> Option<Self> {
        let canonical = text
            .bytes()
            .all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
        let hash = blake3::Hash::from_hex(text).ok()?;
        canonical.then(|| Self(*hash.as_bytes()))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Digest({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_escape_their_folder_are_refused() {
        for bad in ["", ".", "..", ".x", "-x", "a/b", "a@1", "a:b", "é", "a b"] {
            assert!(RunName::new(bad).is_err(), "{bad:?} was taken");
        }
        assert!(RunName::new("x".repeat(65)).is_err());
        assert!(RunName::new("hollow-2.test_A").is_ok());
    }

    #[test]
    fn a_suffix_never_makes_a_name_too_long() {
        let name = RunName::new("x".repeat(64)).unwrap().with_suffix(12);
        assert_eq!(name.as_str().len(), 64);
        assert!(name.as_str().ends_with("x-12"));
    }
}
