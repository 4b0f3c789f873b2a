//! The names by which a user points at things: a run, a committed step of a run, one REV in it.
//!
//! ```text
//! hollow                the run
//! hollow@12             its load step 12 (0 is the initial state)
//! hollow@last           its last committed load step
//! hollow@12:e46.2       the REV of element 46, Gauss point 2 (both counted from 0, as ParaView does)
//! ```

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The longest name of a run, in characters: it becomes a folder name.
pub const LONGEST_RUN_NAME: usize = 64;

/// What a run name must look like, as a regular expression (published in the schema of the input).
pub const RUN_NAME_PATTERN: &str = "^[A-Za-z0-9_-]{1,64}$";

/// Why a text is no run, step or REV address. Reads after "failed to understand the address".
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AddressError {
    /// Nothing was written where a run name belongs.
    #[error("the name of the run is missing")]
    NoName,
    /// The name holds a character that is neither letter, digit, `-` nor `_`.
    #[error("{character:?} cannot be part of a run name; letters, digits, `-` and `_` can")]
    Character {
        /// The first such character.
        character: char,
    },
    /// The name is longer than [`LONGEST_RUN_NAME`].
    #[error("a run name has at most {LONGEST_RUN_NAME} characters, this one has {length}")]
    TooLong {
        /// Its length in characters.
        length: usize,
    },
    /// A REV is named where a run or a load step is asked for.
    #[error("`{found}` names a REV; name a load step, as in `hollow@12` (`rev export` takes REVs)")]
    RevForStep {
        /// What stands behind `@`.
        found: String,
    },
    /// What follows `@` is neither a number nor `last`.
    #[error("`{found}` is no load step; write a number or `last`, as in `hollow@12`")]
    Step {
        /// What stands there.
        found: String,
    },
    /// What follows `:` is not of the form `e46.2`.
    #[error("`{found}` is no REV; write element and Gauss point, as in `hollow@12:e46.2`")]
    Rev {
        /// What stands there.
        found: String,
    },
    /// The address does not say which step it means.
    #[error("the load step is missing; write for example `{run}@last`")]
    NoStep {
        /// The run that is named.
        run: String,
    },
}

/// The readable name of a run: letters, digits, `-` and `_`, at most [`LONGEST_RUN_NAME`] characters.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct RunName(String);

impl RunName {
    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for RunName {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        if text.is_empty() {
            return Err(AddressError::NoName);
        }
        let allowed = |c: &char| c.is_ascii_alphanumeric() || *c == '-' || *c == '_';
        if let Some(character) = text.chars().find(|c| !allowed(c)) {
            return Err(AddressError::Character { character });
        }
        if text.len() > LONGEST_RUN_NAME {
            return Err(AddressError::TooLong { length: text.len() });
        }
        Ok(Self(text.to_owned()))
    }
}

impl TryFrom<String> for RunName {
    type Error = AddressError;

    fn try_from(text: String) -> Result<Self, AddressError> {
        text.parse()
    }
}

impl From<RunName> for String {
    fn from(name: RunName) -> String {
        name.0
    }
}

impl fmt::Display for RunName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Which committed load step of a run is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StepSelector {
    /// The step of this number; 0 is the initial state.
    Index(u64),
    /// The last committed one.
    Last,
}

impl FromStr for StepSelector {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        match whole_number(text) {
            Some(index) => Ok(Self::Index(index)),
            None if text == "last" => Ok(Self::Last),
            None if text.contains(':') => Err(AddressError::RevForStep {
                found: text.to_owned(),
            }),
            None => Err(AddressError::Step {
                found: text.to_owned(),
            }),
        }
    }
}

impl fmt::Display for StepSelector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => write!(f, "{index}"),
            Self::Last => f.write_str("last"),
        }
    }
}

/// A run, and perhaps one of its steps: `hollow`, `hollow@12`, `hollow@last`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RunAddress {
    /// The run.
    pub run: RunName,
    /// The step, where one is named.
    pub step: Option<StepSelector>,
}

impl FromStr for RunAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        match text.split_once('@') {
            None => Ok(Self {
                run: text.parse()?,
                step: None,
            }),
            Some((run, step)) => Ok(Self {
                run: run.parse()?,
                step: Some(step.parse()?),
            }),
        }
    }
}

impl fmt::Display for RunAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.step {
            None => write!(f, "{}", self.run),
            Some(step) => write!(f, "{}@{step}", self.run),
        }
    }
}

/// Which load steps of a run a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepSpan {
    /// All of them, or the last one: none is named.
    Whole,
    /// One.
    At(StepSelector),
    /// What happened from the first to the second.
    Between(StepSelector, StepSelector),
}

/// A run and the steps of it that a picture shows: `hollow`, `hollow@12`, `hollow@12..20`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotAddress {
    /// The run.
    pub run: RunName,
    /// The steps.
    pub steps: StepSpan,
}

impl FromStr for PlotAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let (run, steps) = match text.split_once('@') {
            None => (text, StepSpan::Whole),
            Some((run, steps)) => match steps.split_once("..") {
                None => (run, StepSpan::At(steps.parse()?)),
                Some((from, to)) => (run, StepSpan::Between(from.parse()?, to.parse()?)),
            },
        };
        Ok(Self {
            run: run.parse()?,
            steps,
        })
    }
}

impl fmt::Display for PlotAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.steps {
            StepSpan::Whole => write!(f, "{}", self.run),
            StepSpan::At(step) => write!(f, "{}@{step}", self.run),
            StepSpan::Between(from, to) => write!(f, "{}@{from}..{to}", self.run),
        }
    }
}

/// Where in the mesh a REV sits: `e46.2` is element 46, Gauss point 2, both counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct RevPlace {
    /// Number of the element, from 0.
    pub element: u32,
    /// Number of the Gauss point in the element, from 0.
    pub point: u32,
}

impl FromStr for RevPlace {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let parse = || {
            let (element, point) = text.strip_prefix('e')?.split_once('.')?;
            let number = |part| u32::try_from(whole_number(part)?).ok();
            Some(Self {
                element: number(element)?,
                point: number(point)?,
            })
        };
        parse().ok_or_else(|| AddressError::Rev {
            found: text.to_owned(),
        })
    }
}

impl fmt::Display for RevPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "e{}.{}", self.element, self.point)
    }
}

/// One REV of one step of one run: `hollow@12:e46.2`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RevAddress {
    /// The run.
    pub run: RunName,
    /// The step.
    pub step: StepSelector,
    /// The place in the mesh.
    pub place: RevPlace,
}

impl FromStr for RevAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let (step, place) = text.split_once(':').ok_or_else(|| AddressError::Rev {
            found: text.to_owned(),
        })?;
        let RunAddress { run, step } = step.parse()?;
        let step = step.ok_or_else(|| AddressError::NoStep {
            run: run.to_string(),
        })?;
        Ok(Self {
            run,
            step,
            place: place.parse()?,
        })
    }
}

impl fmt::Display for RevAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}:{}", self.run, self.step, self.place)
    }
}

/// Digits only: `str::parse` would also take a leading `+`.
fn whole_number(text: &str) -> Option<u64> {
    if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    text.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_of_steps_reads_back_as_it_is_written() {
        for text in [
            "hollow",
            "hollow@12",
            "hollow@last",
            "hollow@12..20",
            "hollow@0..last",
        ] {
            assert_eq!(text.parse::<PlotAddress>().unwrap().to_string(), text);
        }
        for text in [
            "hollow@",
            "hollow@12..",
            "hollow@..12",
            "hollow@1..2..3",
            "@1..2",
            "hollow@1:e0.0",
        ] {
            assert!(text.parse::<PlotAddress>().is_err(), "{text}");
        }
    }

    #[test]
    fn addresses_read_back_what_they_print() {
        for text in ["hollow", "hollow-2@12", "a_b@last"] {
            assert_eq!(text.parse::<RunAddress>().unwrap().to_string(), text);
        }
        for text in ["hollow@12:e46.2", "h@last:e0.0"] {
            assert_eq!(text.parse::<RevAddress>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_run_name_cannot_leave_its_folder() {
        for text in ["", "..", "a/b", "a\\b", "a b", "é", "a@1@2", "a\0"] {
            assert!(text.parse::<RunAddress>().is_err(), "{text:?} was taken");
        }
        assert!("x".repeat(LONGEST_RUN_NAME + 1).parse::<RunName>().is_err());
    }

    #[test]
    fn a_malformed_step_or_rev_is_told_apart_from_a_missing_one() {
        assert!(matches!(
            "h@-1".parse::<RunAddress>(),
            Err(AddressError::Step { .. })
        ));
        assert!(matches!(
            "h@+1".parse::<RunAddress>(),
            Err(AddressError::Step { .. })
        ));
        assert!(matches!(
            "h@99999999999999999999".parse::<RunAddress>(),
            Err(AddressError::Step { .. })
        ));
        assert!(matches!(
            "h:e1.0".parse::<RevAddress>(),
            Err(AddressError::NoStep { .. })
        ));
        assert!(matches!(
            "h@1:46.2".parse::<RevAddress>(),
            Err(AddressError::Rev { .. })
        ));
    }
}
