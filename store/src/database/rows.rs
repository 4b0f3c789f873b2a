//! What the database holds, as keys and values.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;

use crate::frame::{array_at, u32_at};
use crate::id::{Digest, RunName, StepAddress, StepIndex};
use crate::record::to_rmp;
use crate::run::RunState;

/// Longest summary or note, in bytes, that goes into a value; longer ones stay in their files.
pub(crate) const INLINE: usize = 3072;

const RUN: u8 = b'r';
const STEP: u8 = b's';

/// A run as the database knows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RunRow {
    pub(crate) created: u64,
    pub(crate) parent: Option<StepAddress>,
    pub(crate) state: RunState,
    pub(crate) note: Option<String>,
}

/// A committed step as the database knows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct StepRow {
    pub(crate) digest: Digest,
    pub(crate) bytes: u64,
    /// `None`: too long for a value, or not read yet; the pack has it.
    pub(crate) summary: Option<ByteBuf>,
}

/// Everything in the database.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contents {
    pub(crate) runs: BTreeMap<RunName, RunRow>,
    pub(crate) steps: BTreeMap<RunName, BTreeMap<StepIndex, StepRow>>,
}

/// One change of a batch.
#[derive(Clone, Debug)]
pub(crate) enum Change {
    PutRun(RunName, RunRow),
    PutStep(RunName, StepIndex, StepRow),
    DropStep(RunName, StepIndex),
    DropRun(RunName),
}

impl Change {
    /// Key and value; no value means removal.
    pub(crate) fn to_bytes(&self) -> (Vec<u8>, Option<Vec<u8>>) {
        match self {
            Self::PutRun(run, row) => (run_key(run), Some(to_value(row))),
            Self::PutStep(run, step, row) => (step_key(run, *step), Some(to_value(row))),
            Self::DropStep(run, step) => (step_key(run, *step), None),
            Self::DropRun(run) => (run_key(run), None),
        }
    }
}

impl Contents {
    /// Takes in one row; an error names one that makes no sense.
    pub(crate) fn take(&mut self, key: &[u8], value: &[u8]) -> Result<(), String> {
        let nonsense = || format!("the row {:?} makes no sense", String::from_utf8_lossy(key));
        let (kind, rest) = key.split_first().ok_or_else(nonsense)?;
        match *kind {
            RUN => {
                let run = parse_name(rest).ok_or_else(nonsense)?;
                let row = from_value(value).ok_or_else(nonsense)?;
                self.runs.insert(run, row);
            }
            STEP if rest.len() > 5 => {
                let (name, step) = rest.split_at(rest.len() - 5);
                let run = parse_name(name).ok_or_else(nonsense)?;
                let step = StepIndex(u32::from_be_bytes(array_at(step, 1)));
                let row = from_value(value).ok_or_else(nonsense)?;
                self.steps.entry(run).or_default().insert(step, row);
            }
            _ => return Err(nonsense()),
        }
        Ok(())
    }
}

fn run_key(run: &RunName) -> Vec<u8> {
    let mut key = vec![RUN];
    key.extend_from_slice(run.as_str().as_bytes());
    key
}

fn step_key(run: &RunName, step: StepIndex) -> Vec<u8> {
    let mut key = vec![STEP];
    key.extend_from_slice(run.as_str().as_bytes());
    key.push(0);
    key.extend_from_slice(&step.0.to_be_bytes());
    key
}

fn parse_name(bytes: &[u8]) -> Option<RunName> {
    RunName::new(std::str::from_utf8(bytes).ok()?).ok()
}

/// MessagePack, then its crc32: sled's own checksums are not on every read.
fn to_value(row: &impl Serialize) -> Vec<u8> {
    let mut value = to_rmp(row);
    let crc = crc32fast::hash(&value);
    value.extend_from_slice(&crc.to_le_bytes());
    value
}

fn from_value<T: DeserializeOwned>(value: &[u8]) -> Option<T> {
    let at = value.len().checked_sub(4)?;
    if crc32fast::hash(&value[..at]) != u32_at(value, at) {
        return None;
    }
    rmp_serde::from_slice(&value[..at]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_sort_by_number_not_by_digits() {
        let run = RunName::new("a").unwrap();
        assert!(step_key(&run, StepIndex(255)) < step_key(&run, StepIndex(256)));
        let longer = RunName::new("a-2").unwrap();
        assert!(step_key(&run, StepIndex(u32::MAX)) < step_key(&longer, StepIndex(0)));
    }

    #[test]
    fn a_flipped_bit_in_a_value_is_no_row() {
        let row = StepRow {
            digest: Digest([7; 32]),
            bytes: 5,
            summary: Some(ByteBuf::from(vec![1, 2])),
        };
        let value = to_value(&row);
        assert_eq!(from_value::<StepRow>(&value), Some(row));
        for bit in 0..value.len() * 8 {
            let mut bad = value.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(from_value::<StepRow>(&bad), None, "bit {bit}");
        }
    }
}
