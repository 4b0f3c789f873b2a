//! YAML text → a tree of values that know where they stand.
//!
//! Stricter than YAML, on purpose: a key given twice, anchors, aliases, tags and a second document are errors.
//! Each would let the file say something other than what its reader sees.

use saphyr_parser::{Event, Parser, ScalarStyle, Tag};

use super::error::{InputError, Span};
use super::path::{Path, Segment};
use super::scalar::{self, Scalar};

/// Maps and lists inside one another; the language needs 6.
const DEEPEST: usize = 32;

/// A value and where it stands.
#[derive(Debug, Clone)]
pub struct Node {
    /// Where.
    pub span: Span,
    /// What.
    pub value: Value,
}

/// What a value is.
#[derive(Debug, Clone)]
pub enum Value {
    /// Nothing stands there.
    Null,
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A finite number.
    Float(f64),
    /// A text.
    Text(String),
    /// A list.
    List(Vec<Node>),
    /// A map, in the order of the file.
    Map(Vec<Entry>),
    /// Already reported as wrong: nobody need say more about it.
    Invalid,
}

/// One key of a map with its value.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Where the key stands.
    pub key_span: Span,
    /// The value.
    pub value: Node,
}

impl Node {
    /// The entry of `key`, if this is a map that has it.
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        match &self.value {
            Value::Map(entries) => entries.iter().find(|entry| entry.key == key),
            _ => None,
        }
    }

    /// The value at `path`, and the place to point at when it is wrong: the value itself, or the key where the
    /// value is a map, a list or missing.
    pub fn locate(&self, path: &Path) -> Option<(&Node, Span)> {
        let mut node = self;
        let mut span = self.span;
        for segment in path.segments() {
            match segment {
                Segment::Key(key) => {
                    let entry = node.entry(key)?;
                    node = &entry.value;
                    span = if node.is_plain() {
                        node.span
                    } else {
                        entry.key_span
                    };
                }
                Segment::Index(index) => {
                    let Value::List(entries) = &node.value else {
                        return None;
                    };
                    node = entries.get(*index)?;
                    span = node.span;
                }
            }
        }
        Some((node, span))
    }

    /// Whether it is one value: no list, no map, not missing.
    pub fn is_plain(&self) -> bool {
        matches!(
            self.value,
            Value::Bool(_) | Value::Integer(_) | Value::Float(_) | Value::Text(_)
        )
    }
}

/// Reads `text`; what is no YAML, or YAML that this language does not take, goes into `errors`.
pub fn read(text: &str, errors: &mut Vec<InputError>) -> Option<Node> {
    let mut builder = Builder {
        errors,
        open: Vec::new(),
        root: None,
    };
    for event in Parser::new_from_str(text) {
        match event {
            Ok((event, span)) => {
                if builder.take(event, convert(span)).is_break() {
                    return None;
                }
            }
            Err(error) => {
                let column = error.marker().col() + 1;
                let span = Span {
                    line: error.marker().line().max(1),
                    column,
                    end: column,
                };
                builder.report(
                    span,
                    format!("this is not valid YAML: {}", error.info()),
                    hint(text, span),
                );
                return None;
            }
        }
    }
    builder.root
}

fn convert(span: saphyr_parser::Span) -> Span {
    let column = span.start.col() + 1;
    // A value that runs on over several lines is pointed at where it begins.
    let end = if span.end.line() == span.start.line() {
        span.end.col() + 1
    } else {
        column
    };
    Span {
        line: span.start.line().max(1),
        column,
        end: end.max(column),
    }
}

/// What usually is behind a syntax error at `span`.
fn hint(text: &str, span: Span) -> Option<String> {
    let indent_has_tab = |line: &str| {
        line.chars()
            .take_while(|c| c.is_whitespace())
            .any(|c| c == '\t')
    };
    if text
        .lines()
        .skip(span.line.saturating_sub(2))
        .take(2)
        .any(indent_has_tab)
    {
        return Some("indent with spaces; YAML forbids tabs there".to_owned());
    }
    Some("look for a missing `:`, quote or bracket, or for an indentation that differs from its neighbours".to_owned())
}

/// A list or map whose end has not come yet.
enum Open {
    List {
        span: Span,
        entries: Vec<Node>,
    },
    Map {
        span: Span,
        entries: Vec<Entry>,
        key: Key,
    },
}

/// The key that waits for its value.
enum Key {
    None,
    Good(String, Span),
    /// Reported; its value is read and dropped.
    Bad,
}

struct Builder<'a> {
    errors: &'a mut Vec<InputError>,
    open: Vec<Open>,
    root: Option<Node>,
}

impl Builder<'_> {
    fn take(&mut self, event: Event<'_>, span: Span) -> std::ops::ControlFlow<()> {
        match event {
            Event::Scalar(word, style, anchor, tag) => {
                self.forbid(anchor, tag.as_deref(), span);
                self.scalar(&word, style, span);
            }
            Event::SequenceStart(anchor, tag) => {
                self.forbid(anchor, tag.as_deref(), span);
                self.open.push(Open::List {
                    span,
                    entries: Vec::new(),
                });
            }
            Event::MappingStart(anchor, tag) => {
                self.forbid(anchor, tag.as_deref(), span);
                self.open.push(Open::Map {
                    span,
                    entries: Vec::new(),
                    key: Key::None,
                });
            }
            Event::SequenceEnd | Event::MappingEnd => self.close(),
            Event::Alias(_) => {
                self.report(
                    span,
                    "aliases (`*name`) are not part of the input language".to_owned(),
                    instead(),
                );
                self.push(Node {
                    span,
                    value: Value::Invalid,
                });
            }
            Event::DocumentStart(_) if self.root.is_some() => {
                self.report(
                    span,
                    "a second document begins here".to_owned(),
                    Some("one file holds one input".into()),
                );
                return std::ops::ControlFlow::Break(());
            }
            _ => {}
        }
        if self.open.len() > DEEPEST {
            self.report(
                span,
                format!("more than {DEEPEST} maps and lists inside one another"),
                None,
            );
            return std::ops::ControlFlow::Break(());
        }
        std::ops::ControlFlow::Continue(())
    }

    fn forbid(&mut self, anchor: usize, tag: Option<&Tag>, span: Span) {
        if anchor != 0 {
            self.report(
                span,
                "anchors (`&name`) are not part of the input language".to_owned(),
                instead(),
            );
        }
        if tag.is_some() {
            let help = "write the bare value; put it in quotes if it is a text";
            self.report(
                span,
                "tags (`!name`) are not part of the input language".to_owned(),
                Some(help.into()),
            );
        }
    }

    fn scalar(&mut self, word: &str, style: ScalarStyle, span: Span) {
        if let Some(Open::Map {
            key: key @ Key::None,
            entries,
            ..
        }) = self.open.last_mut()
        {
            let first = entries
                .iter()
                .find(|entry| entry.key == word)
                .map(|entry| entry.key_span.line);
            *key = if first.is_some() {
                Key::Bad
            } else {
                Key::Good(word.to_owned(), span)
            };
            if let Some(line) = first {
                let help = format!("it is first given on line {line}; keep one of the two");
                self.report(span, format!("the key `{word}` is given twice"), Some(help));
            }
            return;
        }
        let value = if style == ScalarStyle::Plain {
            scalar::read(word)
        } else {
            Scalar::Text
        };
        let value = match value {
            Scalar::Null => Value::Null,
            Scalar::Bool(bool) => Value::Bool(bool),
            Scalar::Integer(integer) => Value::Integer(integer),
            Scalar::Float(float) => Value::Float(float),
            Scalar::Text => Value::Text(word.to_owned()),
            Scalar::NotFinite => {
                self.report(span, format!("`{word}` is no finite number"), None);
                Value::Invalid
            }
        };
        self.push(Node { span, value });
    }

    fn close(&mut self) {
        match self.open.pop() {
            Some(Open::List { span, entries }) => self.push(Node {
                span,
                value: Value::List(entries),
            }),
            Some(Open::Map { span, entries, .. }) => self.push(Node {
                span,
                value: Value::Map(entries),
            }),
            None => {}
        }
    }

    /// A value is complete: it goes where one is waited for.
    fn push(&mut self, node: Node) {
        let bad_key = match self.open.last_mut() {
            None => {
                self.root = Some(node);
                None
            }
            Some(Open::List { entries, .. }) => {
                entries.push(node);
                None
            }
            Some(Open::Map { entries, key, .. }) => match std::mem::replace(key, Key::None) {
                Key::Good(key, key_span) => {
                    entries.push(Entry {
                        key,
                        key_span,
                        value: node,
                    });
                    None
                }
                Key::Bad => None,
                Key::None => {
                    *key = Key::Bad;
                    Some(node.span)
                }
            },
        };
        if let Some(span) = bad_key {
            self.report(span, "a key must be a single word".to_owned(), None);
        }
    }

    fn report(&mut self, span: Span, message: String, help: Option<String>) {
        self.errors.push(InputError {
            span: Some(span),
            path: String::new(),
            message,
            help,
        });
    }
}

fn instead() -> Option<String> {
    Some(
        "write the value out; a material can take over another one's values with `like:`"
            .to_owned(),
    )
}
