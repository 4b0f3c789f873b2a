//! Outcomes as text or JSON.

use std::io::{self, Write};
use std::path::Path;

use serde_json::{Map, Value, json};

use super::args::{DEFAULT_STORE, Global};
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

/// How outcomes are shown.
pub struct Display<'a> {
    format: Format,
    /// The store where it is not the default: commands that are proposed must name it to work when pasted.
    store: Option<&'a Path>,
}

impl<'a> Display<'a> {
    /// As the options ask for.
    pub fn new(global: &'a Global) -> Self {
        let store = global.store.as_path();
        Self {
            format: global.format(),
            store: (store != Path::new(DEFAULT_STORE)).then_some(store),
        }
    }

    /// As text, whatever the options ask for.
    pub fn for_people(global: &'a Global) -> Self {
        Self {
            format: Format::Text,
            ..Self::new(global)
        }
    }

    /// A text whose proposed commands name the store.
    fn proposing(&self, text: &str) -> String {
        match self.store {
            Some(store) => {
                let command = format!("femdem-flow --store {} ", store.display());
                text.replace("femdem-flow ", &command)
            }
            None => text.to_owned(),
        }
    }

    /// Shows what a verb has to say.
    pub fn report(&self, out: &mut dyn Write, report: &Report) -> io::Result<()> {
        match self.format {
            Format::Text if report.text.is_empty() => Ok(()),
            Format::Text => writeln!(out, "{}", self.proposing(report.text.trim_end())),
            Format::Json => writeln!(out, "{:#}", report.json),
        }
    }

    /// Shows why a verb failed: on stderr for people, and on stdout for machines where they are asked for.
    pub fn failure(
        &self,
        out: &mut dyn Write,
        err: &mut dyn Write,
        failure: &Failure,
    ) -> io::Result<()> {
        let hint = failure.advice().map(|hint| self.proposing(hint));
        if let (Some(partial), Format::Text) = (failure.report(), self.format) {
            self.report(out, partial)?;
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
        if let Some(hint) = &hint {
            writeln!(err, "Hint: {hint}")?;
        }
        if self.format == Format::Json {
            let error = json!({
                "kind": failure.kind().word(),
                "causes": causes,
                "hint": hint,
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
}
