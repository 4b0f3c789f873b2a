//! Holds a tree against the JSON Schema that is derived from the types of [`super::document`].
//!
//! The schema that `femdem-flow schema` publishes is the one that is applied here, so that an editor and the program
//! never disagree. Only the keywords that the derived schema uses are interpreted; a test holds the two together.
//! A general validator reports "not valid under any of the given schemas" where a choice is spelled wrongly; knowing
//! that our choices are maps with one key lets this one say which key was meant.

use std::collections::BTreeSet;

use serde_json::Value as Json;

use super::path::Path;
use super::plain::Plain;
use super::report::{Report, list, nearest, suggest};
use super::tree::{Entry, Node, Value};

/// The keywords that [`Checker`] applies.
#[cfg(test)]
pub const APPLIED: &[&str] = &[
    "$ref",
    "additionalProperties",
    "anyOf",
    "const",
    "enum",
    "exclusiveMaximum",
    "exclusiveMinimum",
    "format",
    "items",
    "maxItems",
    "maximum",
    "minItems",
    "minimum",
    "oneOf",
    "properties",
    "required",
    "type",
];

/// The keywords that carry no condition.
#[cfg(test)]
pub const IGNORED: &[&str] = &["$defs", "$schema", "default", "description", "title"];

/// Applies a schema to a tree.
pub struct Checker<'s, 'r, 't> {
    schema: &'s Json,
    report: &'r mut Report<'t>,
    unknown: BTreeSet<Path>,
}

/// Checks the whole tree; returns the keys that do not exist, for the reader of the values to skip.
pub fn check(schema: &Json, report: &mut Report<'_>) -> BTreeSet<Path> {
    let tree = report.tree();
    let mut checker = Checker {
        schema,
        report,
        unknown: BTreeSet::new(),
    };
    checker.node(tree, schema, &Path::root());
    checker.unknown
}

impl<'s> Checker<'s, '_, '_> {
    fn node(&mut self, node: &Node, schema: &'s Json, path: &Path) {
        match &node.value {
            Value::Invalid => return,
            Value::Null => {
                let help = "write a value, or leave the key out".to_owned();
                return self
                    .report
                    .at(path, format!("{} has no value", quoted(path)), help);
            }
            _ => {}
        }
        if let Some(target) = self.target(schema) {
            self.node(node, target, path);
        }
        for keyword in ["oneOf", "anyOf"] {
            if let Some(choices) = schema.get(keyword).and_then(Json::as_array) {
                self.choice(node, choices, path);
            }
        }
        if let Some(kind) = schema.get("type").and_then(Json::as_str)
            && !is_of_type(node, kind)
        {
            let help = match kind {
                "array" => self.as_list(node, schema),
                "object" if !path.segments().is_empty() => self.description(schema),
                _ => other_spelling(node, kind),
            };
            let message = format!(
                "{} must be {}, not {}",
                quoted(path),
                article(kind),
                describe(node)
            );
            return self.report.at(path, message, help);
        }
        if let Some(word) = schema.get("const").and_then(Json::as_str) {
            self.word(node, &[word], path);
        }
        if let Some(words) = schema.get("enum").and_then(Json::as_array) {
            let words: Vec<&str> = words.iter().filter_map(Json::as_str).collect();
            self.word(node, &words, path);
        }
        match &node.value {
            Value::Map(entries) => self.map(entries, schema, path),
            Value::List(entries) => self.list(entries, schema, path),
            Value::Integer(_) | Value::Float(_) => self.range(node, schema, path),
            _ => {}
        }
    }

    /// `{"$ref": "#/$defs/Name"}` → the definition.
    fn target(&self, schema: &'s Json) -> Option<&'s Json> {
        let name = schema.get("$ref")?.as_str()?.strip_prefix("#")?;
        self.schema.pointer(name)
    }

    /// How the list would have to be written whose only entry is perhaps meant by `node`.
    fn as_list(&self, node: &Node, schema: &'s Json) -> Option<String> {
        let items = schema.get("items")?;
        let items = self.target(items).unwrap_or(items);
        let kind = items.get("type").and_then(Json::as_str);
        let entry = match (&node.value, kind) {
            (Value::Invalid | Value::Null, _) => return None,
            (_, Some("number" | "integer")) => "1, 2".to_owned(),
            (Value::Map(_), Some("object")) => in_a_line(node),
            (_, Some("object")) => "{ … }".to_owned(),
            _ => in_a_line(node),
        };
        Some(format!("write a list, as in `[{entry}]`"))
    }

    fn word(&mut self, node: &Node, words: &[&str], path: &Path) {
        let found = match &node.value {
            Value::Text(text) if words.contains(&text.as_str()) => return,
            Value::Text(text) => text.clone(),
            _ => String::new(),
        };
        let message = format!("{} cannot be {}", quoted(path), describe(node));
        self.report.at(
            path,
            message,
            suggest(&found, words.iter().copied(), "choices"),
        );
    }

    fn map(&mut self, entries: &[Entry], schema: &'s Json, path: &Path) {
        let properties = schema.get("properties").and_then(Json::as_object);
        let others = schema.get("additionalProperties");
        let mut meant: Vec<&str> = Vec::new();
        for entry in entries {
            let inner = path.key(entry.key.as_str());
            if let Some(property) = properties.and_then(|properties| properties.get(&entry.key)) {
                self.node(&entry.value, property, &inner);
            } else if let Some(others @ Json::Object(_)) = others {
                self.node(&entry.value, others, &inner);
            } else if others == Some(&Json::Bool(false)) {
                let known: Vec<&str> = properties
                    .into_iter()
                    .flat_map(|map| map.keys().map(String::as_str))
                    .collect();
                let home = self.home(properties, &entry.key);
                self.unknown_key(&inner, &entry.key, &known, home);
                meant.extend(nearest(&entry.key, known.iter().copied()));
            }
        }
        for required in schema
            .get("required")
            .and_then(Json::as_array)
            .into_iter()
            .flatten()
        {
            let Some(key) = required.as_str() else {
                continue;
            };
            // A misspelt key is not also missing.
            if !entries.iter().any(|entry| entry.key == key) && !meant.contains(&key) {
                let about = properties
                    .and_then(|map| map.get(key))
                    .and_then(|property| self.description(property));
                let help = about.map_or(format!("add `{key}: …`"), |about| {
                    format!("add `{key}: …` ({about})")
                });
                let message = match path.segments() {
                    [] => format!("the key `{key}` is missing"),
                    _ => format!("the key `{key}` is missing in {}", quoted(path)),
                };
                self.report.at(path, message, help);
            }
        }
    }

    fn unknown_key(&mut self, path: &Path, key: &str, known: &[&str], inside: Option<&str>) {
        self.unknown.insert(path.clone());
        let help = match inside {
            Some(parent) => format!("it belongs inside `{parent}: {{ … }}`"),
            None => suggest(key, known.iter().copied(), "keys"),
        };
        self.report
            .at_key(path, format!("there is no key `{key}` here"), help);
    }

    /// The one of `properties` that is a map with this very key.
    fn home<'p>(
        &self,
        properties: Option<&'p serde_json::Map<String, Json>>,
        key: &str,
    ) -> Option<&'p str> {
        let has_it = |property: &Json| {
            let target = property
                .get("$ref")
                .and_then(Json::as_str)
                .and_then(|name| self.schema.pointer(name.strip_prefix('#')?));
            target
                .and_then(|target| target.get("properties")?.get(key))
                .is_some()
        };
        properties?
            .iter()
            .find(|(_, property)| has_it(property))
            .map(|(name, _)| name.as_str())
    }

    fn description(&self, schema: &'s Json) -> Option<String> {
        let own = schema.get("description").and_then(Json::as_str);
        let text = own.or_else(|| self.target(schema)?.get("description")?.as_str())?;
        let text = text.split("\n\n").next()?.replace('\n', " ");
        let sentence = text.split(". ").next()?.trim_end_matches('.');
        Some(sentence.to_owned())
    }

    fn list(&mut self, entries: &[Node], schema: &'s Json, path: &Path) {
        let bound = |key| {
            schema
                .get(key)
                .and_then(Json::as_u64)
                .and_then(|bound| usize::try_from(bound).ok())
        };
        let (least, most) = (
            bound("minItems").unwrap_or(0),
            bound("maxItems").unwrap_or(usize::MAX),
        );
        let count = entries.len();
        if count == 0 && least > 0 {
            self.report.at(
                path,
                format!("{} is empty", quoted(path)),
                "write at least one entry".to_owned(),
            );
        } else if count < least || count > most {
            let wanted = if least == most {
                format!("{least}")
            } else {
                format!("at least {least}")
            };
            let plural = if count == 1 { "entry" } else { "entries" };
            self.report.at(
                path,
                format!("{} has {count} {plural}, not {wanted}", quoted(path)),
                None,
            );
        }
        if let Some(items) = schema.get("items") {
            for (index, entry) in entries.iter().enumerate() {
                self.node(entry, items, &path.index(index));
            }
        }
    }

    fn range(&mut self, node: &Node, schema: &'s Json, path: &Path) {
        let number = match node.value {
            Value::Integer(integer) => integer as f64,
            Value::Float(float) => float,
            _ => return,
        };
        let bound = |key| schema.get(key).and_then(Json::as_f64);
        let largest = match schema.get("format").and_then(Json::as_str) {
            Some("uint32") => f64::from(u32::MAX),
            // What every reader of JSON keeps exactly, 2⁵³ − 1.
            Some("uint64") => 9_007_199_254_740_991.0,
            _ => f64::INFINITY,
        };
        let wanted = match (
            bound("minimum"),
            bound("exclusiveMinimum"),
            bound("maximum"),
            bound("exclusiveMaximum"),
        ) {
            (Some(least), ..) if number < least => format!("at least {}", Plain(least)),
            (_, Some(least), ..) if number <= least => format!("greater than {}", Plain(least)),
            (.., Some(most), _) if number > most => format!("at most {}", Plain(most)),
            (.., Some(most)) if number >= most => format!("less than {}", Plain(most)),
            _ if number > largest => format!("at most {largest}"),
            _ => return,
        };
        let message = format!("{} is {}, it must be {wanted}", quoted(path), Plain(number));
        self.report.at(path, message, self.description(schema));
    }

    /// One of several forms: bare words, maps with one key, or plain types.
    fn choice(&mut self, node: &Node, choices: &'s [Json], path: &Path) {
        let forms = Forms::of(choices);
        match &node.value {
            Value::Map(entries) if !forms.keyed.is_empty() => {
                let known: Vec<&str> = forms.keyed.iter().map(|(key, _)| *key).collect();
                for entry in entries {
                    let inner = path.key(entry.key.as_str());
                    match forms.keyed.iter().find(|(key, _)| *key == entry.key) {
                        Some((_, schema)) => self.node(&entry.value, schema, &inner),
                        None => self.unknown_key(&inner, &entry.key, &known, None),
                    }
                }
                if entries.len() != 1 {
                    let message = format!(
                        "{} must have exactly one key, it has {}",
                        quoted(path),
                        entries.len()
                    );
                    self.report.at(
                        path,
                        message,
                        format!("the keys here: {}", list(known.iter().copied())),
                    );
                }
            }
            Value::Text(text) if forms.keyed.iter().any(|(key, _)| key == text) => {
                let message = format!("{} cannot be {}", quoted(path), describe(node));
                let help = format!("`{text}` is a map: write `{{ {text}: {{}} }}`");
                self.report.at(path, message, help);
            }
            Value::Text(_) if !forms.words.is_empty() => {
                let keys = forms.keyed.iter().map(|(key, _)| *key);
                let known: Vec<&str> = forms.words.iter().copied().chain(keys).collect();
                self.word(node, &known, path);
            }
            _ => match forms.plain.iter().find(|(kind, _)| is_of_type(node, kind)) {
                Some((_, schema)) => self.node(node, schema, path),
                None => {
                    let mut wanted: Vec<String> = forms
                        .plain
                        .iter()
                        .map(|(kind, _)| article(kind).to_owned())
                        .collect();
                    wanted.extend(forms.words.iter().map(|word| format!("`{word}`")));
                    wanted.extend(forms.keyed.iter().map(|(key, _)| format!("`{{{key}: …}}`")));
                    let message = format!("{} cannot be {}", quoted(path), describe(node));
                    self.report
                        .at(path, message, format!("write {}", wanted.join(" or ")));
                }
            },
        }
    }
}

/// The forms among which a value may choose.
struct Forms<'s> {
    words: Vec<&'s str>,
    keyed: Vec<(&'s str, &'s Json)>,
    plain: Vec<(&'s str, &'s Json)>,
}

impl<'s> Forms<'s> {
    fn of(choices: &'s [Json]) -> Self {
        let mut forms = Forms {
            words: Vec::new(),
            keyed: Vec::new(),
            plain: Vec::new(),
        };
        for choice in choices {
            let only_key = choice
                .get("required")
                .and_then(Json::as_array)
                .filter(|keys| keys.len() == 1);
            let key = only_key.and_then(|keys| keys[0].as_str());
            if let Some(word) = choice.get("const").and_then(Json::as_str) {
                forms.words.push(word);
            } else if let Some(words) = choice.get("enum").and_then(Json::as_array) {
                forms.words.extend(words.iter().filter_map(Json::as_str));
            } else if let Some(key) = key
                && let Some(schema) = choice.pointer(&format!("/properties/{key}"))
            {
                forms.keyed.push((key, schema));
            } else if let Some(kind) = choice.get("type").and_then(Json::as_str) {
                forms.plain.push((kind, choice));
            }
        }
        forms
    }
}

fn is_of_type(node: &Node, kind: &str) -> bool {
    match (&node.value, kind) {
        (Value::Bool(_), "boolean") | (Value::Integer(_), "integer" | "number") => true,
        (Value::Float(float), "integer") => float.fract() == 0.0,
        (Value::Float(_), "number") | (Value::Text(_), "string") => true,
        (Value::List(_), "array") | (Value::Map(_), "object") => true,
        _ => false,
    }
}

fn article(kind: &str) -> &str {
    match kind {
        "integer" => "a whole number",
        "number" => "a number",
        "string" => "a text",
        "array" => "a list `[…]`",
        "object" => "a map `{key: …}`",
        "boolean" => "`true` or `false`",
        other => other,
    }
}

fn describe(node: &Node) -> String {
    match &node.value {
        Value::Null | Value::Invalid => "empty".to_owned(),
        Value::Bool(bool) => format!("`{bool}`"),
        Value::Integer(integer) => format!("the number {integer}"),
        Value::Float(float) => format!("the number {}", Plain(*float)),
        Value::Text(text) => format!(
            "the text `{}`",
            text.chars().take(40).collect::<String>().escape_debug()
        ),
        Value::List(_) => "a list".to_owned(),
        Value::Map(_) => "a map".to_owned(),
    }
}

/// A value as it stands in a line, what is inside its entries left out.
fn in_a_line(node: &Node) -> String {
    let inner = |node: &Node| match node.is_plain() {
        true => in_a_line(node),
        false => "…".to_owned(),
    };
    match &node.value {
        Value::Null | Value::Invalid | Value::List(_) => "…".to_owned(),
        Value::Bool(bool) => bool.to_string(),
        Value::Integer(integer) => integer.to_string(),
        Value::Float(float) => Plain(*float).to_string(),
        Value::Text(text) => text
            .chars()
            .take(40)
            .collect::<String>()
            .escape_debug()
            .to_string(),
        Value::Map(entries) => {
            let entries = entries.iter().take(4);
            let entries = entries.map(|entry| format!("{}: {}", entry.key, inner(&entry.value)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
    }
}

/// How the value would have to be written, where that can be guessed.
fn other_spelling(node: &Node, kind: &str) -> Option<String> {
    match (&node.value, kind) {
        (Value::Text(text), "number" | "integer") => {
            if let Some((over, under)) = text.split_once('/')
                && let (Ok(over), Ok(under)) =
                    (over.trim().parse::<f64>(), under.trim().parse::<f64>())
                && (over / under).is_finite()
            {
                return Some(format!("write the quotient, {}", over / under));
            }
            let number = text.replace(',', ".").replace('_', "");
            number
                .parse::<f64>()
                .ok()
                .filter(|number| number.is_finite())
                .map(|_| format!("write {number}, without quotes"))
        }
        (Value::Integer(number), "string") => {
            Some(format!("put it in quotes to make it a text: \"{number}\""))
        }
        _ => None,
    }
}

fn quoted(path: &Path) -> String {
    if path.segments().is_empty() {
        "the input".to_owned()
    } else {
        format!("`{path}`")
    }
}
