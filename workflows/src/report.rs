//! What a verb has to say at its end: for people and for machines.

use serde::Serialize;
use serde_json::Value;

/// The outcome of a verb; it goes to stdout in one of its two forms.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// For people: lines of text.
    pub text: String,
    /// For machines (`--json`): one JSON value.
    pub json: Value,
}

impl Report {
    /// A report of `text`, and of `data` for machines. Data that JSON cannot hold becomes an error text in it.
    pub fn new(text: impl Into<String>, data: &impl Serialize) -> Self {
        let json =
            serde_json::to_value(data).unwrap_or_else(|error| Value::from(error.to_string()));
        Self {
            text: text.into(),
            json,
        }
    }
}
