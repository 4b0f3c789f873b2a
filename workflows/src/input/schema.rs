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

/// The schema as it is published: for editors it also tells what a run name looks like, which [`super::resolve`] checks.
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
