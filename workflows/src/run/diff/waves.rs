//! The iteration of a load step at which two runs part.

use serde_json::{Value, json};
use store::{FrameId, StepReader};

use crate::run::{
    asked::AskedWave,
    frames::{ASKED, decode},
    summary::StepSummary,
};

/// Where in a step two runs part. Iterations are counted from 1, as everywhere for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Parting {
    /// The runs ask the same of every point up to this iteration, and get different answers.
    Answers(usize),
    /// This iteration asks for another F, or from other states.
    Questions(usize),
    /// This iteration asks for the same F, of REV solvers with other settings.
    Settings(usize),
    /// The first iteration that left another residual; what it asked for is not recorded in both.
    Residual(usize),
    /// All iterations are alike; one of the runs went on.
    Length(usize),
}

impl Parting {
    fn iteration(&self) -> usize {
        match self {
            Self::Answers(k)
            | Self::Questions(k)
            | Self::Settings(k)
            | Self::Residual(k)
            | Self::Length(k) => *k,
        }
    }

    /// For people.
    pub fn phrase(&self) -> String {
        let k = self.iteration();
        match self {
            Self::Answers(_) => {
                format!("{k}: both ask the same of every REV and get different answers")
            }
            Self::Questions(_) => format!("{k}: it asks for another deformation"),
            Self::Settings(_) => format!("{k}: it solves the REVs with other settings"),
            Self::Residual(_) => format!("{k}: it leaves another residual"),
            Self::Length(_) => format!("{k}: all before it are alike, and only one run went on"),
        }
    }

    /// For machines.
    pub fn to_json(&self) -> Value {
        let what = match self {
            Self::Answers(_) => "answers",
            Self::Questions(_) => "questions",
            Self::Settings(_) => "settings",
            Self::Residual(_) => "residual",
            Self::Length(_) => "length",
        };
        json!({ "number": self.iteration(), "differs_in": what })
    }
}

/// Where the iterations of a step part; `None` for steps that have none.
pub fn parting(readers: &[StepReader; 2], summaries: [&StepSummary; 2]) -> Option<Parting> {
    let [a, b] = summaries.map(|summary| &summary.sweeps);
    if a.is_empty() && b.is_empty() {
        return None;
    }
    let same = |k: &usize| {
        a[*k].residual.to_bits() == b[*k].residual.to_bits()
            && a[*k].correction.to_bits() == b[*k].correction.to_bits()
    };
    let common = a.len().min(b.len());
    let Some(first) = (0..common).find(|k| !same(k)) else {
        return Some(Parting::Length(common + 1));
    };
    // A residual differs where the answers do, or already what was asked for.
    let asked = |reader: &StepReader, wave: u32| -> Option<AskedWave> {
        let id = FrameId::new(ASKED, wave);
        let bytes = reader
            .ids()
            .contains(&id)
            .then(|| reader.frame(id).ok())??;
        decode(id, &bytes).ok()
    };
    let wave = a[first].wave;
    let questions = [&readers[0], &readers[1]].map(|reader| asked(reader, wave));
    Some(match &questions {
        [Some(one), Some(other)] if one == other => Parting::Answers(first + 1),
        [Some(one), Some(other)] if one.asks_the_same(other) => Parting::Settings(first + 1),
        [Some(_), Some(_)] => Parting::Questions(first + 1),
        _ => Parting::Residual(first + 1),
    })
}
