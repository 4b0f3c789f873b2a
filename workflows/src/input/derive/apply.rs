//! Lays changes over the problem of the run that is taken up.

use std::collections::BTreeSet;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;

use super::catalogue::{catalogue, differences};
use super::layer::Layer;
use super::sweep::Alternative;
use super::{Junction, Scope, Variant, laws};
use crate::address::RunName;
use crate::input::check;
use crate::input::error::InputErrors;
use crate::input::path::Path;
use crate::input::problem::Problem;
use crate::input::programme::Programme;
use crate::input::report::Report;
use crate::input::resolve::{Loads, Reader, Subject, check_solver, read_programme};
use crate::input::schema;

/// The run that `layers` ask for, one of each source, the later ones over the earlier.
pub fn apply(
    junction: &Junction<'_>,
    layers: &[Alternative],
    scope: Scope,
) -> Result<Variant, InputErrors> {
    let mut problem = junction.problem.clone();
    let mut name = None;
    let mut labels: Vec<String> = Vec::new();
    for alternative in layers {
        let own = lay_over(junction, &alternative.layer, scope, &mut problem)?;
        name = own.or(name);
        if !alternative.label.is_empty() {
            labels.push(alternative.label.clone());
        }
    }
    let before = catalogue(junction.problem, junction.earlier);
    let now = catalogue(&problem, junction.earlier);
    // A law that changes without being named follows one that is.
    let follows = |key: &str| {
        key.starts_with("materials.")
            .then(|| "by its `like`".to_owned())
    };
    let place = |key: &str| said_in(key, layers).or_else(|| follows(key));
    let mut changes = differences(&before, &now, place);
    // A later programme begins with the values that the loads have: nobody has changed them.
    changes.retain(|change| !change.key.starts_with("loads."));
    let programme = &problem.programme;
    let replaced = *programme != junction.problem.programme;
    if replaced && !changes.iter().any(|change| change.key == "programme") {
        // The same words for other increments: the rest of a stage is not the stage.
        let words = super::catalogue::in_words(programme, &problem.loads);
        changes.push(super::Change {
            key: "programme".to_owned(),
            from: words.clone(),
            from_place: before
                .get("programme")
                .map_or_else(String::new, |entry| entry.place.clone()),
            to: format!("{words}, anew"),
            to_place: said_in("programme", layers).unwrap_or_default(),
        });
    }
    if labels.is_empty() && replaced {
        labels.extend(programme.stages.first().map(|stage| stage.name.clone()));
    }
    let relawed = relawed(junction.problem, &problem);
    Ok(Variant {
        name,
        label: fit_for_a_name(&labels.join("-")),
        problem,
        changes,
        relawed,
    })
}

/// Materials whose laws differ.
fn relawed(before: &Problem, now: &Problem) -> BTreeSet<usize> {
    let pairs = before.materials.iter().zip(&now.materials);
    let changed = pairs.enumerate().filter(|(_, (before, now))| before != now);
    changed.map(|(index, _)| index).collect()
}

/// The option or file and line that sets `key`, where one of the sources does.
fn said_in(key: &str, layers: &[Alternative]) -> Option<String> {
    let path = key
        .split('.')
        .fold(Path::root(), |path, segment| path.key(segment));
    layers.iter().rev().find_map(|alternative| {
        let layer = &alternative.layer;
        let (_, span) = layer.tree.locate(&path)?;
        Some(match layer.name.strip_prefix("--") {
            Some(_) => layer.name.clone(),
            None => format!("{}:{}", layer.name, span.line),
        })
    })
}

/// Applies one source; returns the name that it asks for.
fn lay_over(
    junction: &Junction<'_>,
    layer: &Layer,
    scope: Scope,
    problem: &mut Problem,
) -> Result<Option<RunName>, InputErrors> {
    let mut report = Report::new(&layer.tree, Vec::new());
    let mut schema = schema::schema();
    if let Some(fields) = schema.as_object_mut() {
        // It is laid over an input that has all that is required.
        fields.remove("required");
    }
    let unknown = check::check(&schema, &mut report);
    let mut refused = Vec::new();
    let mut reader = Reader {
        report: &mut report,
        unknown: &unknown,
    };
    let root = Path::root();
    let mut name = None;
    for key in reader.keys(&root).unwrap_or_default() {
        let path = root.key(key.as_str());
        if unknown.contains(&path) {
            continue;
        }
        match (key.as_str(), scope) {
            ("name", _) => name = named(&mut reader, &path),
            ("solver", _) => {
                if let Some(settings) = merged(&mut reader, &path, &problem.solver) {
                    check_solver(&mut reader, &settings);
                    problem.solver = settings;
                }
            }
            ("output", _) => {
                if let Some(settings) = merged(&mut reader, &path, &problem.output) {
                    problem.output = settings;
                }
            }
            ("programme", Scope::Branch) => {
                if let Some(programme) = programme(&mut reader, junction) {
                    problem.programme = programme;
                }
            }
            ("materials", Scope::Rerun) => laws::apply(&mut reader, problem),
            _ => {
                refuse(&mut reader, &path, junction.address, scope);
                refused.push(key);
            }
        }
    }
    if report.is_clean() {
        return Ok(name);
    }
    let mut errors = report.into_errors();
    // What stands inside a key that is refused does not matter any more.
    let inside = |path: &str, key: &String| {
        let rest = path.strip_prefix(key.as_str());
        rest.is_some_and(|rest| rest.starts_with(['.', '[']))
    };
    errors.retain(|error| !refused.iter().any(|key| inside(&error.path, key)));
    Err(layer.refuse(errors))
}

/// Why a key of the input is none that may change here.
fn refuse(reader: &mut Reader<'_, '_>, path: &Path, address: &str, scope: Scope) {
    let key = path.to_string();
    let (message, help) = match (key.as_str(), scope) {
        ("programme", _) => (
            "a rerun keeps the programme".to_owned(),
            format!("another future is a branch: `femdem-flow branch {address} …`"),
        ),
        ("materials", _) => (
            format!("other materials would change what came before {address}"),
            format!(
                "`femdem-flow rerun {address} --set …` takes contact laws and elastic constants, as a new start from the states there"
            ),
        ),
        _ => (
            format!("`{key}` decided what came before {address} and cannot change after it"),
            "what a branch can change: `programme`, `solver`, `output`; a rerun takes laws of materials too; anything else is a run of its own, `femdem-flow submit FILE`".to_owned(),
        ),
    };
    reader.report.at_key(path, message, help);
}

fn named(reader: &mut Reader<'_, '_>, path: &Path) -> Option<RunName> {
    let name: String = reader.required(path)?;
    let help = "letters, digits, `-` and `_` make a name, as in `hollow-unloaded`".to_owned();
    name.parse()
        .map_err(|error| {
            let message = format!("`{path}` is no run name: {error}");
            reader.report.at(path, message, help);
        })
        .ok()
}

/// `settings` with the keys at `path` replaced.
fn merged<T: Serialize + DeserializeOwned>(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    settings: &T,
) -> Option<T> {
    let Some(Json::Object(over)) = reader.json(path) else {
        return None;
    };
    let mut whole = serde_json::to_value(settings).unwrap_or_default();
    if let Some(fields) = whole.as_object_mut() {
        fields.extend(over);
    }
    reader.value(whole, path)
}

/// The stages at `programme`, from the values that the loads have at the step.
fn programme(reader: &mut Reader<'_, '_>, junction: &Junction<'_>) -> Option<Programme> {
    let mut loads = Loads::given(&junction.problem.loads, junction.loads);
    let subject = Subject::of(&junction.problem.model, junction.loads.len());
    let programme = read_programme(reader, &mut loads, Some(&subject))?;
    Some(Programme {
        past: junction.past.to_vec(),
        ..programme
    })
}

/// The longest label: a name has to hold the parent's too.
const LONGEST_LABEL: usize = 32;

/// Letters, digits, `-` and `_` only: `1e-4` stays, `0.5` becomes `0_5`.
fn fit_for_a_name(label: &str) -> String {
    let fit = label.chars().map(|c| match c {
        c if c.is_ascii_alphanumeric() || c == '-' => c,
        _ => '_',
    });
    let fit: String = fit.take(LONGEST_LABEL).collect();
    fit.trim_matches(['-', '_']).to_owned()
}
