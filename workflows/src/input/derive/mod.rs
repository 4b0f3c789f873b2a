//! What takes up a run at one of its load steps: the input of that run with another future.
//!
//! The past is a fact. A [`Scope::Branch`] may change what follows the step (programme, solver, output) and nothing
//! else; a [`Scope::Rerun`] keeps the programme and may besides replace contact laws and elastic constants, which
//! makes it a new start from the states of the step. What is refused is refused with the reason.
//!
//! 1. `layer`: a file, `--programme` and `--set` become trees with positions, as the input does;
//! 2. `sweep`: lists and branches files become alternatives;
//! 3. `apply`: each is held against the schema of the input, against the scope, and laid over the parent's problem.

mod apply;
mod catalogue;
mod laws;
mod layer;
mod sweep;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::error::InputErrors;
use super::problem::Problem;
use super::programme::PastStage;
use crate::address::RunName;

pub use catalogue::{Entry, catalogue, differences, stage_in_words};

/// What a run that takes up another one may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Another future: programme, solver, output.
    Branch,
    /// The same programme once more: solver, output, and the laws of materials.
    Rerun,
}

/// The changes, as the user wrote them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Request {
    /// A file with `programme`, `solver`, `output`, or a list of such under `branches`.
    pub file: Option<PathBuf>,
    /// The stages that follow, as YAML: a list as in the input, or a map from name to stage.
    pub programme: Option<Text>,
    /// `KEY=VALUE`, the value in YAML.
    pub sets: Vec<String>,
}

/// YAML from the command line, and the option that it came with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// The option, as in `--programme`.
    pub option: String,
    /// Its value.
    pub yaml: String,
}

/// The load step that is taken up, and the run that it is of.
#[derive(Debug, Clone, Copy)]
pub struct Junction<'a> {
    /// The step as the user knows it: `hollow@12`.
    pub address: &'a str,
    /// The input of that run, as resolved.
    pub problem: &'a Problem,
    /// Values of the loads at the step.
    pub loads: &'a [f64],
    /// What of the programme is done or begun there.
    pub past: &'a [PastStage],
    /// Where values came from that the YAML of the run does not say, by key: a change in an ancestor.
    pub earlier: &'a BTreeMap<String, String>,
}

/// One key that is not what it was.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// The key: `solver.iterations`, `programme`.
    pub key: String,
    /// Its value before.
    pub from: String,
    /// Where that was said: `line 12 of the input`, `default`.
    pub from_place: String,
    /// Its value now.
    pub to: String,
    /// Where that is said: `unload.yaml:3`, `--set`.
    pub to_place: String,
}

/// One run to come.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// The name that is asked for it, where one is.
    pub name: Option<RunName>,
    /// What sets it apart from its siblings and its parent, fit for a name; empty where nothing does.
    pub label: String,
    /// What it computes.
    pub problem: Problem,
    /// What differs from the parent.
    pub changes: Vec<Change>,
    /// Materials, by index, whose laws are replaced.
    pub relawed: BTreeSet<usize>,
}

/// The most runs that one command makes.
pub const MOST_VARIANTS: usize = 256;

/// The runs that `request` asks for, at least one.
///
/// # Errors
/// All that is wrong with one of its sources: the file, `--programme`, or all of `--set`.
pub fn variants(
    junction: &Junction<'_>,
    request: &Request,
    scope: Scope,
) -> Result<Vec<Variant>, InputErrors> {
    let mut combinations: Vec<Vec<sweep::Alternative>> = vec![Vec::new()];
    for layer in layer::of_request(request)? {
        let alternatives = sweep::alternatives(layer)?;
        combinations = combinations
            .into_iter()
            .flat_map(|before| {
                alternatives.iter().map(move |alternative| {
                    let mut layers = before.clone();
                    layers.push(alternative.clone());
                    layers
                })
            })
            .collect();
        if combinations.len() > MOST_VARIANTS {
            let message = format!("more than {MOST_VARIANTS} runs are asked for at once");
            return Err(InputErrors::whole("the command line", message, None));
        }
    }
    combinations
        .iter()
        .map(|layers| apply::apply(junction, layers, scope))
        .collect()
}
