//! From a part of the tree to its type.

use std::collections::BTreeSet;

use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json};

use crate::input::path::Path;
use crate::input::report::Report;
use crate::input::tree::{Node, Value};

/// Reads parts of a checked tree.
pub struct Reader<'r, 't> {
    /// What is wrong so far, and the tree.
    pub report: &'r mut Report<'t>,
    /// Keys that do not exist; they are reported and otherwise passed over.
    pub unknown: &'r BTreeSet<Path>,
}

impl Reader<'_, '_> {
    /// The value at `path`; `None` where it is wrong or missing, which the check has reported.
    pub fn required<T: DeserializeOwned>(&mut self, path: &Path) -> Option<T> {
        let json = self.json(path)?;
        self.value(json, path)
    }

    /// The value at `path`, or its default where nothing is written; `None` where it is wrong.
    pub fn optional<T: DeserializeOwned + Default>(&mut self, path: &Path) -> Option<T> {
        match self.report.tree().locate(path) {
            None => Some(T::default()),
            Some(_) => self.required(path),
        }
    }

    /// `json` as a `T`; `None` where it is none.
    pub fn value<T: DeserializeOwned>(&mut self, json: Json, path: &Path) -> Option<T> {
        match serde_json::from_value(json) {
            Ok(value) => Some(value),
            Err(error) => {
                // Normally the check has found the same already, in better words.
                if self.report.is_clean() {
                    self.report.at(path, error.to_string(), None);
                }
                None
            }
        }
    }

    /// The value at `path` as JSON, without the keys that do not exist.
    pub fn json(&self, path: &Path) -> Option<Json> {
        let (node, _) = self.report.tree().locate(path)?;
        self.convert(node, path)
    }

    /// The keys of the map at `path`, in the order of the file; `None` where there is no map.
    pub fn keys(&self, path: &Path) -> Option<Vec<String>> {
        match &self.report.tree().locate(path)?.0.value {
            Value::Map(entries) => Some(entries.iter().map(|entry| entry.key.clone()).collect()),
            _ => None,
        }
    }

    /// The number of entries of the list at `path`; 0 where there is none.
    pub fn count(&self, path: &Path) -> usize {
        match self.report.tree().locate(path).map(|(node, _)| &node.value) {
            Some(Value::List(entries)) => entries.len(),
            _ => 0,
        }
    }

    /// Whether something is written at `path`.
    pub fn has(&self, path: &Path) -> bool {
        self.report.tree().locate(path).is_some()
    }

    /// Whether the map at `path` has a key that does not exist: what seems to be missing there is then misspelt.
    pub fn is_misspelt(&self, path: &Path) -> bool {
        self.unknown.iter().any(|key| {
            key.segments()
                .split_last()
                .is_some_and(|(_, parent)| parent == path.segments())
        })
    }

    fn convert(&self, node: &Node, path: &Path) -> Option<Json> {
        Some(match &node.value {
            Value::Null | Value::Invalid => return None,
            Value::Bool(bool) => Json::from(*bool),
            Value::Integer(integer) => Json::from(*integer),
            // `1e3` is a good number of steps; serde would refuse a float for it.
            Value::Float(float)
                if float.fract() == 0.0 && float.abs() < 2f64.powi(53) && *float != 0.0 =>
            {
                Json::from(*float as i64)
            }
            Value::Float(float) => Json::from(*float),
            Value::Text(text) => Json::from(text.as_str()),
            Value::List(entries) => {
                let convert = |(index, entry)| self.convert(entry, &path.index(index));
                Json::Array(
                    entries
                        .iter()
                        .enumerate()
                        .map(convert)
                        .collect::<Option<_>>()?,
                )
            }
            Value::Map(entries) => {
                let mut map = Map::new();
                for entry in entries {
                    let inner = path.key(entry.key.as_str());
                    if !self.unknown.contains(&inner) {
                        map.insert(entry.key.clone(), self.convert(&entry.value, &inner)?);
                    }
                }
                Json::Object(map)
            }
        })
    }
}
