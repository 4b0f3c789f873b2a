//! A resolved input as a flat list of keys and values, each with the line of the YAML that says it: what two inputs
//! are compared by.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value as Json;

use super::Change;
use crate::input::mesh::Mesh;
use crate::input::path::Path;
use crate::input::plain::Plain;
use crate::input::problem::{Amount, Law, Material, Model, Problem};
use crate::input::programme::{Programme, Stage};
use crate::input::tree::{self, Node, Value};

/// One value of an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// What it is.
    pub value: String,
    /// Where it is said: `line 12 of the input`, or `default`.
    pub place: String,
}

/// All that decides about a run, by key. `earlier` has the places of values that the YAML does not say.
pub fn catalogue(problem: &Problem, earlier: &BTreeMap<String, String>) -> BTreeMap<String, Entry> {
    let source = problem
        .source
        .strip_prefix('\u{feff}')
        .unwrap_or(&problem.source);
    // A stored input was read without errors before.
    let mut ignored = Vec::new();
    let tree = tree::read(source, &mut ignored);
    let mut collector = Collector {
        tree: tree.as_ref(),
        earlier,
        entries: BTreeMap::new(),
    };
    let root = Path::root();
    for material in &problem.materials {
        collector.material(material);
    }
    collector.model(problem);
    for (name, initial) in problem.loads.iter().zip(&problem.programme.initial) {
        // What a later programme begins with is no choice of its own.
        if problem.programme.past.is_empty() {
            collector.leaf(
                &root.key("loads").key(name.as_str()),
                Plain(*initial).to_string(),
            );
        }
    }
    let programme = in_words(&problem.programme, &problem.loads);
    collector.leaf(&root.key("programme"), programme);
    collector.settings(&root.key("solver"), &problem.solver);
    collector.settings(&root.key("output"), &problem.output);
    collector.entries
}

/// What is different in `now`, in the order of the keys. `place` tells where a key of `now` is said, where that is not
/// its own input.
pub fn differences(
    before: &BTreeMap<String, Entry>,
    now: &BTreeMap<String, Entry>,
    place: impl Fn(&str) -> Option<String>,
) -> Vec<Change> {
    let keys: std::collections::BTreeSet<&String> = before.keys().chain(now.keys()).collect();
    let absent = || Entry {
        value: "nothing".to_owned(),
        place: "absent".to_owned(),
    };
    keys.into_iter()
        .filter_map(|key| {
            let from = before.get(key).cloned().unwrap_or_else(absent);
            let to = now.get(key).cloned().unwrap_or_else(absent);
            (from.value != to.value).then(|| Change {
                key: key.clone(),
                from: from.value,
                from_place: from.place,
                to: to.value,
                to_place: place(key).unwrap_or(to.place),
            })
        })
        .collect()
}

/// The stages in a line: `load: shortening −0.02 in 10, back: shortening 0 in 5`.
pub fn in_words(programme: &Programme, loads: &[String]) -> String {
    let stages: Vec<String> = programme
        .stages
        .iter()
        .map(|stage| stage_in_words(stage, loads))
        .collect();
    stages.join(", ")
}

/// A stage in words: `back (shortening to 0 in 5)`.
pub fn stage_in_words(stage: &Stage, loads: &[String]) -> String {
    let ways: Vec<String> = stage
        .ways
        .iter()
        .map(|way| {
            let targets: Vec<String> = way
                .targets
                .iter()
                .map(|(load, value)| {
                    let name = loads.get(*load).map_or("?", String::as_str);
                    format!("{name} to {}", Plain(*value))
                })
                .collect();
            match &way.control {
                Some(control) => control.words(loads),
                None if targets.is_empty() => "hold".to_owned(),
                None => targets.join(" and "),
            }
        })
        .collect();
    let times = match stage.times {
        1 => String::new(),
        times => format!("{times} × "),
    };
    let until: Vec<String> = stage.until.iter().map(|stop| stop.words(loads)).collect();
    let until = match until.is_empty() {
        true => String::new(),
        false => format!(" until {}", until.join(" or ")),
    };
    format!(
        "{} ({times}{} in {}{until})",
        stage.name,
        ways.join(", "),
        stage.steps
    )
}

struct Collector<'a> {
    tree: Option<&'a Node>,
    earlier: &'a BTreeMap<String, String>,
    entries: BTreeMap<String, Entry>,
}

impl Collector<'_> {
    fn leaf(&mut self, path: &Path, value: String) {
        let line = self.line(path);
        self.put(path, value, line);
    }

    fn put(&mut self, path: &Path, value: String, line: Option<usize>) {
        let key = path.to_string();
        let place = match (self.earlier.get(&key), line) {
            (Some(place), _) => place.clone(),
            (None, Some(line)) => format!("line {line} of the input"),
            (None, None) => "default".to_owned(),
        };
        self.entries.insert(key, Entry { value, place });
    }

    fn line(&self, path: &Path) -> Option<usize> {
        Some(self.tree?.locate(path)?.1.line)
    }

    /// A map of plain values; lists in it are values.
    fn settings(&mut self, path: &Path, settings: &impl Serialize) {
        let Ok(Json::Object(fields)) = serde_json::to_value(settings) else {
            return;
        };
        for (key, value) in fields {
            self.leaf(&path.key(key), plain(&value));
        }
    }

    fn material(&mut self, material: &Material) {
        let (kind, json) = match &material.law {
            Law::Rev(rev) => ("rev", serde_json::to_value(rev)),
            Law::Elastic(elastic) => ("elastic", serde_json::to_value(elastic)),
        };
        let mut fields = Vec::new();
        flatten(String::new(), json.unwrap_or_default(), &mut fields);
        for (name, value) in fields {
            let path = Path::root()
                .key("materials")
                .key(material.name.as_str())
                .key(kind)
                .key(name.as_str());
            let line = self.material_line(&material.name, kind, &name);
            self.put(&path, value, line);
        }
    }

    /// The line of a material's value, its own or the one that it takes over by `like`.
    fn material_line(&self, name: &str, kind: &str, key: &str) -> Option<usize> {
        let section = Path::root().key("materials");
        let mut current = name.to_owned();
        // No chain is longer than there are materials; the input was checked for circles.
        for _ in 0..64 {
            let path = section.key(current.as_str());
            if let Some(line) = self.line(&path.key(kind).key(key)) {
                return Some(line);
            }
            current = like(self.tree?, &current)?;
        }
        None
    }

    fn model(&mut self, problem: &Problem) {
        let root = Path::root();
        let material = |index: usize| {
            let found = problem.materials.get(index);
            found.map_or_else(String::new, |material| material.name.clone())
        };
        match &problem.model {
            Model::ElementTest(test) => {
                let path = root.key("element_test");
                self.leaf(&root.key("material"), material(test.material));
                for (component, control) in [("xx", test.xx), ("yy", test.yy), ("xy", test.xy)] {
                    let value = words(&control, &problem.loads);
                    self.leaf(&path.key(component), value);
                }
            }
            Model::Body(body) => {
                self.leaf(&root.key("material"), material(body.material));
                self.mesh(&body.mesh);
                for (index, region) in body.regions.iter().enumerate() {
                    let selection = words(&region.selection, &problem.loads);
                    let value =
                        format!("{}: {} {selection}", region.name, material(region.material));
                    self.leaf(&root.key("regions").index(index), value);
                }
                let mut of_boundary: BTreeMap<String, Vec<String>> = BTreeMap::new();
                for condition in &body.conditions {
                    let kind = words(&condition.kind, &problem.loads);
                    of_boundary
                        .entry(condition.on.clone())
                        .or_default()
                        .push(kind);
                }
                for (axis, value) in ["x", "y"].iter().zip(body.body_force.iter().flatten()) {
                    let path = root.key("body_force").key(*axis);
                    self.leaf(&path, words(value, &problem.loads));
                }
                if let Some(spec) = &body.second_gradient {
                    let path = root.key("second_gradient");
                    self.leaf(&path.key("D"), Plain(spec.modulus).to_string());
                    for (region, modulus) in &spec.regions {
                        let path = path.key("regions").key(region.as_str());
                        self.leaf(&path, Plain(*modulus).to_string());
                    }
                    for (on, side) in &spec.sides {
                        let side = words(side, &problem.loads);
                        let of = of_boundary.entry(on.clone()).or_default();
                        of.push(format!("gradient {side}"));
                    }
                }
                for (on, kinds) in of_boundary {
                    let line = self.condition_line(&on);
                    let path = root.key("boundary").key(on);
                    self.put(&path, kinds.join("; "), line);
                }
            }
        }
    }

    fn mesh(&mut self, mesh: &Mesh) {
        let path = Path::root().key("mesh");
        if let Mesh::Imported(imported) = mesh {
            let path = path.key("gmsh");
            self.leaf(&path.key("file"), imported.in_words());
            let element = imported.element.in_words().to_owned();
            self.leaf(&path.key("element"), element);
            return;
        }
        let mut fields = Vec::new();
        let mesh = serde_json::to_value(mesh).unwrap_or_default();
        flatten_deep(path, mesh, &mut fields);
        for (path, value) in fields {
            self.leaf(&path, value);
        }
    }

    fn condition_line(&self, on: &str) -> Option<usize> {
        let Value::List(conditions) = &self.tree?.entry("boundary")?.value.value else {
            return None;
        };
        let is_it = |node: &&Node| {
            let named = node.entry("on").map(|entry| &entry.value.value);
            matches!(named, Some(Value::Text(name)) if name == on)
        };
        Some(conditions.iter().find(is_it)?.span.line)
    }
}

/// The material that `name` is like in the input `tree`.
pub fn like(tree: &Node, name: &str) -> Option<String> {
    let path = Path::root().key("materials").key(name).key("like");
    match &tree.locate(&path)?.0.value {
        Value::Text(like) => Some(like.clone()),
        _ => None,
    }
}

/// The fields of a law by their own names: what an enum puts around them is no part of the language. The friction of the
/// preparation is the one name that both levels have.
fn flatten(name: String, value: Json, into: &mut Vec<(String, String)>) {
    match value {
        Json::Object(fields) => {
            for (key, value) in fields {
                match (name.as_str(), key.as_str()) {
                    ("Prepared", "friction") => {
                        flatten("preparation_friction".to_owned(), value, into);
                    }
                    ("Prepared", "sizes") if value["uniform"].is_object() => {
                        let ratio = value["uniform"]["ratio"].clone();
                        flatten("size_ratio".to_owned(), ratio, into);
                    }
                    // One choice with all that belongs to it; what is not there has nothing to say.
                    ("Prepared", _) if value.is_object() => into.push((key, value.to_string())),
                    ("Prepared", _) if value.is_null() => {}
                    _ => flatten(key, value, into),
                }
            }
        }
        other => into.push((name.to_lowercase(), plain(&other))),
    }
}

/// A plain value as a user would write it.
fn plain(value: &Json) -> String {
    match (value.as_f64(), value) {
        (Some(number), Json::Number(_)) => {
            let size = number.abs();
            if size >= 1e16 || (size > 0.0 && size < 1e-3) {
                format!("{number:e}")
            } else {
                number.to_string()
            }
        }
        (_, Json::String(text)) => text.clone(),
        (_, Json::Array(values)) => {
            let values: Vec<String> = values.iter().map(plain).collect();
            format!("[{}]", values.join(", "))
        }
        _ => value.to_string(),
    }
}

fn flatten_deep(path: Path, value: Json, into: &mut Vec<(Path, String)>) {
    match value {
        Json::Object(fields) => {
            for (key, value) in fields {
                flatten_deep(path.key(key.to_lowercase()), value, into);
            }
        }
        other => into.push((path, plain(&other))),
    }
}

/// A part of the model in one line, loads by their names.
fn words(part: &impl Serialize, loads: &[String]) -> String {
    let json = serde_json::to_value(part).unwrap_or_default();
    named(json, loads).to_string().replace('"', "")
}

fn named(value: Json, loads: &[String]) -> Json {
    match value {
        Json::Object(fields) => {
            let amount: Option<Amount> = serde_json::from_value(Json::Object(fields.clone())).ok();
            match amount {
                Some(Amount::Constant(value)) => Json::from(value),
                Some(Amount::Load(index)) => Json::from(loads.get(index).cloned()),
                None => Json::Object(
                    fields
                        .into_iter()
                        .map(|(key, value)| (key.to_lowercase(), named(value, loads)))
                        .collect(),
                ),
            }
        }
        Json::Array(values) => values
            .into_iter()
            .map(|value| named(value, loads))
            .collect(),
        other => other,
    }
}
