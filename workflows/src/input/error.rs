//! Everything that is wrong with one input, and how it is shown.

use std::fmt;

use serde::Serialize;

/// The most problems that are shown; a file of another kind would otherwise fill the terminal.
const MOST_SHOWN: usize = 50;

/// The longest part of a line that is shown, in characters.
const LONGEST_LINE: usize = 120;

/// A stretch of the input: line from 1, columns in characters from 1, `end` exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Span {
    /// Line, counted from 1.
    pub line: usize,
    /// First column, counted from 1 in characters.
    pub column: usize,
    /// The column after the last one; equal to `column` where only a place is meant.
    pub end: usize,
}

/// One thing that is wrong with an input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputError {
    /// Where; absent when the whole file is meant (it cannot be read, say).
    pub span: Option<Span>,
    /// The way to the value, as in `boundary[2].pressure`; empty for the whole input.
    pub path: String,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

/// All that is wrong with one input, in the order of the file.
///
/// `Display` gives the plain text for a terminal, with the lines concerned; `Serialize` the form for `--json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputErrors {
    /// The file, as the user named it.
    pub file: String,
    /// The problems; never empty.
    pub errors: Vec<InputError>,
    /// The input itself, to show its lines.
    #[serde(skip)]
    pub(super) text: String,
}

impl InputErrors {
    /// All `errors` of an input, brought into the order of the file.
    pub(super) fn new(file: &str, text: &str, mut errors: Vec<InputError>) -> Self {
        errors.sort_by_key(|error| error.span.map(|span| (span.line, span.column)));
        Self {
            file: file.to_owned(),
            errors,
            text: text.to_owned(),
        }
    }

    /// One problem with the file as a whole.
    pub(super) fn whole(file: &str, message: String, help: Option<String>) -> Self {
        let error = InputError {
            span: None,
            path: String::new(),
            message,
            help,
        };
        Self::new(file, "", vec![error])
    }
}

impl std::error::Error for InputErrors {}

impl fmt::Display for InputErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines: Vec<&str> = self.text.lines().collect();
        for (index, error) in self.errors.iter().take(MOST_SHOWN).enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            self.show(f, error, &lines)?;
        }
        match self.errors.len().saturating_sub(MOST_SHOWN) {
            0 => Ok(()),
            hidden => writeln!(f, "\n… and {hidden} more problems"),
        }
    }
}

impl InputErrors {
    fn show(&self, f: &mut fmt::Formatter<'_>, error: &InputError, lines: &[&str]) -> fmt::Result {
        writeln!(f, "error: {}", harmless(&error.message))?;
        let number = error
            .span
            .map_or(String::new(), |span| span.line.to_string());
        let gutter = " ".repeat(number.len());
        match error.span {
            None => writeln!(f, "{gutter} --> {}", self.file)?,
            Some(span) => {
                writeln!(f, "{gutter}--> {}:{}:{}", self.file, span.line, span.column)?;
                if let Some(line) = lines.get(span.line - 1) {
                    let (line, caret) = excerpt(line, span);
                    writeln!(f, "{gutter} |\n{number} | {line}\n{gutter} | {caret}")?;
                }
            }
        }
        match &error.help {
            Some(help) => writeln!(f, "{gutter} = help: {}", harmless(help)),
            None => Ok(()),
        }
    }
}

/// A word of the file that a message quotes cannot steer the terminal.
fn harmless(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}

/// The part of a line around a span, and the line of carets under it. Control characters become spaces, so that
/// the carets stand where they belong and a file cannot steer the terminal.
fn excerpt(line: &str, span: Span) -> (String, String) {
    let characters: Vec<char> = line
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let start = (span.column - 1).min(characters.len());
    let end = (span.end - 1).clamp(start, characters.len().max(start));
    let first = if start > LONGEST_LINE * 3 / 4 {
        start - LONGEST_LINE / 2
    } else {
        0
    };
    let last = characters.len().min(first + LONGEST_LINE);
    let before = if first > 0 { "…" } else { "" };
    let after = if last < characters.len() { "…" } else { "" };
    let shown: String = characters[first..last].iter().collect();
    let carets = end.min(last).saturating_sub(start).max(1);
    let pad = " ".repeat(start - first + before.chars().count());
    (
        format!("{before}{}{after}", shown.trim_end()),
        format!("{pad}{}", "^".repeat(carets)),
    )
}
