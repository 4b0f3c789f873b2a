//! The JSON Schema of the input, derived from [`super::document`].

use serde_json::Value;

use super::document::Document;
use crate::address::RUN_NAME_PATTERN;

/// The schema, as `femdem-flow schema` prints it and as every input is checked against it.
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(Document).to_value();
    forbid_null(&mut schema);
    schema
}

/// The schema as it is published: for editors it also tells what a run name looks like, which `resolve` checks.
pub fn published() -> Value {
    let mut schema = schema();
    if let Some(name) = schema
        .pointer_mut("/properties/name")
        .and_then(Value::as_object_mut)
    {
        name.insert("pattern".to_owned(), RUN_NAME_PATTERN.into());
    }
    schema
}

/// A derived schema lets every optional key be `null`. Here a key without a value is more likely forgotten than meant,
/// so that a key is either given a value or left out.
fn forbid_null(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            if map.get("default").is_some_and(Value::is_null) {
                map.remove("default");
            }
            if let Some(Value::Array(kinds)) = map.get_mut("type") {
                kinds.retain(|kind| kind != "null");
                if let [only] = kinds.as_slice() {
                    let only = only.clone();
                    map.insert("type".to_owned(), only);
                }
            }
            if let Some(Value::Array(choices)) = map.get_mut("anyOf") {
                choices.retain(|choice| choice.get("type").is_none_or(|kind| kind != "null"));
                if let [Value::Object(only)] = choices.as_slice() {
                    let only = only.clone();
                    map.remove("anyOf");
                    map.extend(only);
                }
            }
            map.values_mut().for_each(forbid_null);
        }
        Value::Array(values) => values.iter_mut().for_each(forbid_null),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::input::check::{APPLIED, IGNORED};

    /// A keyword that the check does not know would be promised to editors and not held by the program.
    #[test]
    fn the_check_knows_every_keyword_of_the_schema() {
        fn keywords(schema: &Value, found: &mut BTreeSet<String>) {
            let Value::Object(map) = schema else { return };
            for (key, value) in map {
                found.insert(key.clone());
                match (key.as_str(), value) {
                    ("properties" | "$defs", Value::Object(named)) => {
                        named.values().for_each(|v| keywords(v, found))
                    }
                    ("oneOf" | "anyOf", Value::Array(list)) => {
                        list.iter().for_each(|v| keywords(v, found))
                    }
                    ("items" | "additionalProperties", inner) => keywords(inner, found),
                    _ => {}
                }
            }
        }
        let mut found = BTreeSet::new();
        keywords(&schema(), &mut found);
        let unknown: Vec<_> = found
            .iter()
            .filter(|key| !APPLIED.contains(&key.as_str()) && !IGNORED.contains(&key.as_str()))
            .collect();
        assert!(unknown.is_empty(), "{unknown:?}");
    }

    /// `type: [..]` and `null` are not interpreted by the check.
    #[test]
    fn no_value_may_be_null() {
        let text = schema().to_string();
        assert!(!text.contains("\"null\"") && !text.contains("\"type\":["));
    }

    #[test]
    fn every_key_is_described() {
        let schema = schema();
        let definitions = schema["$defs"].as_object().unwrap();
        for (name, definition) in definitions
            .iter()
            .chain([(&"Document".to_owned(), &schema)])
        {
            for (key, property) in definition["properties"].as_object().into_iter().flatten() {
                assert!(
                    property["description"].is_string(),
                    "{name}.{key} has no description"
                );
            }
        }
    }
}
