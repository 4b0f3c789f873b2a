//! From one source to the alternatives that it stands for: the entries of `branches`, the lists of `--set`.

use serde_json::Value as Json;

use super::layer::Layer;
use crate::input::error::{InputErrors, Span};
use crate::input::path::Path;
use crate::input::report::Report;
use crate::input::schema;
use crate::input::tree::{Node, Value};

/// One of the futures that a source describes.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// The source, its tree reduced to this one.
    pub layer: Layer,
    /// What sets it apart from the others of the source, fit for a name; empty where it is alone.
    pub label: String,
}

/// All alternatives of a source, at least one.
pub fn alternatives(layer: Layer) -> Result<Vec<Alternative>, InputErrors> {
    if layer.tree.entry("branches").is_some() {
        return branches(&layer);
    }
    if !layer.sweeps {
        let label = String::new();
        return Ok(vec![Alternative { layer, label }]);
    }
    let schema = schema::schema();
    let mut found = vec![Alternative {
        layer,
        label: String::new(),
    }];
    // Each pass takes the first list that stands for alternatives out of all of them.
    while let Some(trail) = first_list(&found[0].layer.tree, &schema, &schema) {
        let mut next = Vec::new();
        for alternative in &found {
            next.extend(expanded(alternative, &trail));
        }
        found = next;
        if found.len() > super::MOST_VARIANTS || found.is_empty() {
            break;
        }
    }
    Ok(found)
}

fn branches(layer: &Layer) -> Result<Vec<Alternative>, InputErrors> {
    let mut report = Report::new(&layer.tree, Vec::new());
    let root = Path::root();
    let Value::Map(entries) = &layer.tree.value else {
        return Ok(Vec::new());
    };
    for entry in entries.iter().filter(|entry| entry.key != "branches") {
        let message = format!("`{}` stands beside `branches`", entry.key);
        let help = "write it into each of the branches".to_owned();
        report.at_key(&root.key(entry.key.as_str()), message, help);
    }
    let section = root.key("branches");
    let list = match layer.tree.locate(&section).map(|(node, _)| &node.value) {
        Some(Value::List(list)) if !list.is_empty() => list.as_slice(),
        _ => {
            let help = "write a list of maps, as in `branches: [ { name: back, programme: … } ]`";
            report.at_key(
                &section,
                "`branches` is no list of branches",
                help.to_owned(),
            );
            &[]
        }
    };
    if !report.is_clean() {
        return Err(layer.refuse(report.into_errors()));
    }
    Ok(list
        .iter()
        .map(|branch| Alternative {
            layer: Layer {
                tree: branch.clone(),
                ..layer.clone()
            },
            // They are named by themselves or by what they do.
            label: String::new(),
        })
        .collect())
}

/// The way to a value, as positions in maps: keys may repeat over levels, positions tell them apart.
type Trail = Vec<usize>;

/// The first list that stands where the input takes none.
fn first_list(node: &Node, schema: &Json, root: &Json) -> Option<Trail> {
    let schema = target(schema, root);
    match &node.value {
        Value::Map(entries) => entries.iter().enumerate().find_map(|(index, entry)| {
            let property = schema
                .pointer(&format!("/properties/{}", entry.key))
                .or_else(|| schema.get("additionalProperties").filter(|s| s.is_object()))?;
            let mut trail = first_list(&entry.value, property, root)?;
            trail.insert(0, index);
            Some(trail)
        }),
        // An empty list is no alternative; the check says what belongs there.
        Value::List(values) if !values.is_empty() => {
            match schema.get("type").and_then(Json::as_str) {
                Some("array") | None => None,
                Some(_) => Some(Vec::new()),
            }
        }
        _ => None,
    }
}

fn target<'s>(schema: &'s Json, root: &'s Json) -> &'s Json {
    let name = schema.get("$ref").and_then(Json::as_str);
    let name = name.and_then(|name| name.strip_prefix('#'));
    name.and_then(|name| root.pointer(name)).unwrap_or(schema)
}

/// The alternative once for each value of the list at `trail`.
fn expanded(alternative: &Alternative, trail: &[usize]) -> Vec<Alternative> {
    let mut key = String::new();
    let mut node = &alternative.layer.tree;
    for &index in trail {
        let Value::Map(entries) = &node.value else {
            return Vec::new();
        };
        let Some(entry) = entries.get(index) else {
            return Vec::new();
        };
        key.clone_from(&entry.key);
        node = &entry.value;
    }
    let Value::List(values) = &node.value else {
        return Vec::new();
    };
    let with = |value: &Node| {
        let mut layer = alternative.layer.clone();
        let written = excerpt(&layer.text, value.span);
        replace(&mut layer.tree, trail, value);
        let own = format!("{key}-{written}");
        let label = match alternative.label.as_str() {
            "" => own,
            before => format!("{before}-{own}"),
        };
        Alternative { layer, label }
    };
    values.iter().map(with).collect()
}

fn replace(node: &mut Node, trail: &[usize], with: &Node) {
    match (trail.split_first(), &mut node.value) {
        (Some((index, rest)), Value::Map(entries)) => {
            if let Some(entry) = entries.get_mut(*index) {
                replace(&mut entry.value, rest, with);
            }
        }
        (Some(_), _) => {}
        (None, _) => node.clone_from(with),
    }
}

/// The characters of a span.
fn excerpt(text: &str, span: Span) -> String {
    let line = text.lines().nth(span.line - 1).unwrap_or_default();
    let length = span.end.saturating_sub(span.column);
    line.chars().skip(span.column - 1).take(length).collect()
}
