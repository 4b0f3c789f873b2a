//! The sources of changes as trees that know where they stand: a file, the YAML of an option, `KEY=VALUE`.

use super::{Request, Text};
use crate::input::error::{InputError, InputErrors, Span};
use crate::input::tree::{self, Entry, Node, Value};

/// One source of changes.
#[derive(Debug, Clone)]
pub struct Layer {
    /// What it is called in messages: the file, or the option.
    pub name: String,
    /// Its text.
    pub text: String,
    /// What it says: a map with the keys of the input.
    pub tree: Node,
    /// Whether lists stand for alternatives where the input has no list.
    pub sweeps: bool,
}

impl Layer {
    /// All `errors` of this source.
    pub fn refuse(&self, errors: Vec<InputError>) -> InputErrors {
        InputErrors::new(&self.name, &self.text, errors)
    }
}

/// The sources of a request; each is laid over those before it.
pub fn of_request(request: &Request) -> Result<Vec<Layer>, InputErrors> {
    let mut layers = Vec::new();
    if let Some(path) = &request.file {
        let (name, text) = crate::input::read_text(path)?;
        layers.push(of_yaml(name, text)?);
    }
    if let Some(Text { option, yaml }) = &request.programme {
        let layer = of_yaml(option.clone(), yaml.clone())?;
        let span = layer.tree.span;
        let entry = Entry {
            key: "programme".to_owned(),
            key_span: span,
            value: layer.tree,
        };
        let tree = Node {
            span,
            value: Value::Map(vec![entry]),
        };
        layers.push(Layer { tree, ..layer });
    }
    if !request.sets.is_empty() {
        layers.push(of_sets(&request.sets)?);
    }
    for layer in &mut layers {
        name_stages(&mut layer.tree);
    }
    Ok(layers)
}

fn of_yaml(name: String, text: String) -> Result<Layer, InputErrors> {
    let mut errors = Vec::new();
    let tree = tree::read(text.strip_prefix('\u{feff}').unwrap_or(&text), &mut errors);
    match tree {
        Some(tree) if errors.is_empty() => Ok(Layer {
            name,
            text,
            tree,
            sweeps: false,
        }),
        _ if errors.is_empty() => {
            let message = format!("{name} says nothing");
            Err(InputErrors::whole(&name, message, None))
        }
        _ => Err(InputErrors::new(&name, &text, errors)),
    }
}

/// Each `KEY=VALUE` is a line of one text, so that messages can point into it.
fn of_sets(sets: &[String]) -> Result<Layer, InputErrors> {
    let name = "--set";
    let text = sets.join("\n");
    let mut errors = Vec::new();
    let mut entries = Vec::new();
    for (index, line) in sets.iter().enumerate() {
        let line_number = index + 1;
        match of_set(line, line_number) {
            Ok((keys, value)) => insert(&mut entries, &keys, value, &mut errors),
            Err(mut found) => errors.append(&mut found),
        }
    }
    if !errors.is_empty() {
        return Err(InputErrors::new(name, &text, errors));
    }
    let span = Span {
        line: 1,
        column: 1,
        end: 1,
    };
    Ok(Layer {
        name: name.to_owned(),
        text,
        tree: Node {
            span,
            value: Value::Map(entries),
        },
        sweeps: true,
    })
}

type Keys = Vec<(String, Span)>;

fn of_set(set: &str, line: usize) -> Result<(Keys, Node), Vec<InputError>> {
    let whole = |from: usize, to: usize| Span {
        line,
        column: from + 1,
        end: to + 1,
    };
    let wrong = |span: Span, message: &str, help: &str| {
        vec![InputError {
            span: Some(span),
            path: String::new(),
            message: message.to_owned(),
            help: Some(help.to_owned()),
        }]
    };
    let length = set.chars().count();
    let example = "write KEY=VALUE, as in `solver.iterations=20`";
    if set.contains(['\n', '\r']) {
        let message = "the value of `--set` is more than one line";
        let help = "write it on one line, as in `[1, 2]`, or put it into a file";
        return Err(wrong(whole(0, length), message, help));
    }
    let Some((path, value)) = set.split_once('=') else {
        return Err(wrong(whole(0, length), "there is no `=` in it", example));
    };
    let mut keys = Vec::new();
    let mut at = 0;
    for key in path.split('.') {
        let length = key.chars().count();
        if key.trim().is_empty() {
            return Err(wrong(whole(at, at + length), "a key is empty", example));
        }
        keys.push((key.trim().to_owned(), whole(at, at + length)));
        at += length + 1;
    }
    // Blanks in front bring the positions of the value to where it stands on the command line.
    let padded = format!("{}{}{value}", "\n".repeat(line - 1), " ".repeat(at));
    let mut errors = Vec::new();
    match tree::read(&padded, &mut errors) {
        Some(node) if errors.is_empty() => Ok((keys, node)),
        _ if errors.is_empty() => Err(wrong(whole(at, length), "there is no value", example)),
        _ => Err(errors),
    }
}

/// Puts `value` where `keys` lead to.
fn insert(
    entries: &mut Vec<Entry>,
    keys: &[(String, Span)],
    value: Node,
    errors: &mut Vec<InputError>,
) {
    let Some(((key, key_span), rest)) = keys.split_first() else {
        return;
    };
    let found = entries.iter_mut().find(|entry| entry.key == *key);
    let entry = match found {
        Some(entry) if rest.is_empty() || !matches!(entry.value.value, Value::Map(_)) => {
            errors.push(InputError {
                span: Some(*key_span),
                path: key.clone(),
                message: format!("`{key}` is set twice"),
                help: Some(format!(
                    "it is first set in argument {}; keep one of the two",
                    entry.key_span.line
                )),
            });
            return;
        }
        Some(entry) => entry,
        None if rest.is_empty() => {
            entries.push(Entry {
                key: key.clone(),
                key_span: *key_span,
                value,
            });
            return;
        }
        None => {
            entries.push(Entry {
                key: key.clone(),
                key_span: *key_span,
                value: Node {
                    span: *key_span,
                    value: Value::Map(Vec::new()),
                },
            });
            entries.last_mut().expect("it was pushed just now")
        }
    };
    if let Value::Map(inner) = &mut entry.value.value {
        insert(inner, rest, value, errors);
    }
}

/// `programme: { unload: { ramp: …, steps: … } }` means `programme: [ { name: unload, ramp: …, steps: … } ]`, and
/// one stage alone needs no list. What is no stage there is left for the check to find.
fn name_stages(tree: &mut Node) {
    let Value::Map(entries) = &mut tree.value else {
        return;
    };
    for entry in entries.iter_mut() {
        match entry.key.as_str() {
            "programme" => name_stages_of(&mut entry.value),
            "branches" => {
                if let Value::List(branches) = &mut entry.value.value {
                    branches.iter_mut().for_each(name_stages);
                }
            }
            _ => {}
        }
    }
}

fn name_stages_of(programme: &mut Node) {
    let span = programme.span;
    let Value::Map(entries) = &mut programme.value else {
        return;
    };
    let is_map = |entry: &Entry| matches!(entry.value.value, Value::Map(_));
    let is_of_stage = |entry: &Entry| match entry.key.as_str() {
        "steps" => true,
        // A stage may be called so.
        "name" | "times" | "until" => !is_map(entry),
        _ => false,
    };
    if entries.iter().any(is_of_stage) {
        let stage = std::mem::replace(&mut programme.value, Value::Null);
        programme.value = Value::List(vec![Node { span, value: stage }]);
        return;
    }
    let stages = entries.drain(..).map(|entry| {
        let Entry {
            key,
            key_span,
            mut value,
        } = entry;
        if let Value::Map(inner) = &mut value.value {
            let name = Entry {
                key: "name".to_owned(),
                key_span,
                value: Node {
                    span: key_span,
                    value: Value::Text(key),
                },
            };
            inner.insert(0, name);
        }
        value
    });
    let stages = stages.collect();
    programme.value = Value::List(stages);
}
