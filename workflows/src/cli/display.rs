//! Outcomes as text or JSON.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use crate::failure::Failure;
use crate::report::Report;

/// The form of what goes to stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For people.
    Text,
    /// For machines.
    Json,
}

/// Shows what a verb has to say.
pub fn report(out: &mut dyn Write, report: &Report, format: Format) -> io::Result<()> {
    match format {
        Format::Text if report.text.is_empty() => Ok(()),
        Format::Text => writeln!(out, "{}", report.text.trim_end()),
        Format::Json => writeln!(out, "{:#}", report.json),
    }
}

/// Shows why a verb failed: on stderr for people, and on stdout for machines where they are asked for.
pub fn failure(
    out: &mut dyn Write,
    err: &mut dyn Write,
    failure: &Failure,
    format: Format,
) -> io::Result<()> {
    if let (Some(partial), Format::Text) = (failure.report(), format) {
        report(out, partial, format)?;
    }
    if let Some(input) = failure.input() {
        writeln!(err, "{input}")?;
    }
    let causes = failure.causes();
    for (depth, cause) in causes.iter().enumerate() {
        match depth {
            0 => writeln!(err, "Error: {cause}")?,
            _ => writeln!(err, "  because: {cause}")?,
        }
    }
    if let Some(hint) = failure.advice() {
        writeln!(err, "Hint: {hint}")?;
    }
    if format == Format::Json {
        let error = json!({
            "kind": failure.kind().word(),
            "causes": causes,
            "hint": failure.advice(),
            "input": failure.input(),
        });
        // What is known of the run stands where it does after a success.
        let mut data = match failure.report().map(|report| &report.json) {
            Some(Value::Object(fields)) => fields.clone(),
            _ => Map::new(),
        };
        data.insert("error".to_owned(), error);
        writeln!(out, "{:#}", Value::Object(data))?;
    }
    Ok(())
}
