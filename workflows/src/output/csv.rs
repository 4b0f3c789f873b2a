//! CSV: the global curves of a run, with a header that says what each column means and in which unit.
//!
//! ```text
//! # run hollow
//! # step: number of the load step
//! # cavity [stress]: pressure in the cavity, positive in compression
//! step,cavity
//! 0,1.0
//! ```

use std::fmt::Write as _;
use std::path::Path;

use super::{WriteError, write_text};

/// What one column holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, one word.
    pub name: String,
    /// Its unit, in the user's set: "stress", "length", "force per thickness", "s"; empty for a pure number.
    pub unit: String,
    /// What it means, with its sign.
    pub meaning: String,
}

impl Column {
    /// A column of this name, unit and meaning.
    pub fn new(
        name: impl Into<String>,
        unit: impl Into<String>,
        meaning: impl Into<String>,
    ) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            meaning: meaning.into(),
        }
    }
}

/// A table of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it is about; one line of the header each.
    pub title: Vec<String>,
    columns: Vec<Column>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// An empty table.
    pub fn new(columns: Vec<Column>) -> Self {
        Self {
            title: Vec::new(),
            columns,
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// When it does not have one value for each column.
    pub fn push(&mut self, row: Vec<f64>) -> Result<(), WriteError> {
        let (expected, found) = (self.columns.len(), row.len());
        if expected != found {
            return Err(WriteError::Count {
                name: format!("row {}", self.rows.len()),
                expected,
                found,
            });
        }
        self.rows.push(row);
        Ok(())
    }

    /// What the columns hold.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The rows, one value a column.
    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// The table as text. Numbers read back to the same bits.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for line in &self.title {
            text.push_str(&format!("# {}\n", line.replace(['\n', '\r'], " ")));
        }
        for Column {
            name,
            unit,
            meaning,
        } in &self.columns
        {
            let unit = if unit.is_empty() {
                String::new()
            } else {
                format!(" [{unit}]")
            };
            text.push_str(&format!("# {name}{unit}: {meaning}\n").replace('\r', " "));
        }
        let names: Vec<String> = self
            .columns
            .iter()
            .map(|column| quote(&column.name))
            .collect();
        text.push_str(&names.join(","));
        text.push('\n');
        for row in &self.rows {
            for (index, value) in row.iter().enumerate() {
                let comma = if index > 0 { "," } else { "" };
                // Debug is the shortest form that reads back the same and keeps small numbers short.
                write!(text, "{comma}{value:?}").expect("a String takes everything");
            }
            text.push('\n');
        }
        text
    }

    /// The table with those of its rows that `wanted` keeps.
    pub fn filtered(mut self, wanted: impl Fn(&[f64]) -> bool) -> Self {
        self.rows.retain(|row| wanted(row));
        self
    }

    /// Writes the table to `path`.
    ///
    /// # Errors
    /// The file system's refusal; then there is no file, or still the old one.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_text(path, &self.to_text())
    }
}

/// A name that would break the row is put in quotes.
fn quote(name: &str) -> String {
    if name.contains([',', '"', '\n']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
