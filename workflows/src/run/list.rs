//! The table of the runs of a store.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::json;
use store::{Names, RunName};

use super::{
    Context,
    text::{self, Align, Table},
    view::{RunView, Standing, View},
};
use crate::{failure::Failure, report::Report};

#[derive(Serialize)]
struct Line {
    name: String,
    parent: Option<String>,
    state: &'static str,
    killed: bool,
    steps: u32,
    done: f64,
    of: u64,
    stage: String,
    /// Names and values of the loads at the last step.
    loads: BTreeMap<String, f64>,
    kind: Option<&'static str>,
    bytes: u64,
    cpu_s: f64,
    created: u64,
    note: String,
    /// Whether the note is a user's.
    #[serde(skip)]
    noted: bool,
    /// Depth in the tree of branches.
    #[serde(skip)]
    depth: usize,
    #[serde(skip)]
    phrase: &'static str,
}

/// All runs in the order of the names they were born with, branches under the run they come from.
pub fn runs(context: &Context<'_>) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let mut lines = Vec::new();
    let mut damaged = Vec::new();
    let names = view.names()?;
    for id in view.ids()? {
        match view.read(&id) {
            Ok(run) => lines.push(Line::new(&run, &names)),
            Err(error) => damaged.push((names.shown(&id), error.to_string())),
        }
    }
    let lines = as_tree(lines);
    let unreadable: Vec<_> = damaged
        .iter()
        .map(|(name, why)| json!({ "name": name.as_str(), "error": why }))
        .collect();
    let data = json!({ "runs": &lines, "unreadable": unreadable });
    if lines.is_empty() && damaged.is_empty() {
        let text = format!(
            "No runs in {}. `femdem-flow submit FILE` computes one.",
            context.store.display()
        );
        return Ok(Report::new(text, &data));
    }
    let mut text = table(&lines).render("");
    for (name, why) in &damaged {
        text.push_str(&format!("{name}: cannot be read: failed to {why}\n"));
    }
    Ok(Report::new(text, &data))
}

impl Line {
    fn new(run: &RunView, names: &Names) -> Self {
        let (done, of) = run.increments();
        Self {
            name: run.name().to_string(),
            parent: run
                .record
                .parent
                .as_ref()
                .map(|parent| names.shown_address(parent).to_string()),
            state: run.standing.word(),
            killed: run.standing == Standing::Killed,
            steps: run.last_index(),
            done,
            of,
            stage: run
                .last()
                .map(|step| step.summary.stage.clone())
                .unwrap_or_default(),
            loads: run
                .last()
                .map(|step| {
                    let names = run.manifest.problem.loads.iter().cloned();
                    names.zip(step.summary.loads.iter().copied()).collect()
                })
                .unwrap_or_default(),
            kind: run
                .manifest
                .descent
                .as_ref()
                .map(|descent| descent.kind.word()),
            bytes: run.bytes(),
            cpu_s: run.own_cpu_s(),
            created: run.record.created,
            note: match run.place.notes.last() {
                Some(note) => note.clone(),
                None => run.record.note.clone(),
            },
            noted: !run.place.notes.is_empty(),
            depth: 0,
            phrase: run.standing.phrase(),
        }
    }

    fn parent_name(&self) -> Option<&str> {
        self.parent
            .as_deref()
            .and_then(|parent| parent.split('@').next())
    }
}

/// Depth first, children in the order of their names. A run whose parent is not there stands at the root.
fn as_tree(lines: Vec<Line>) -> Vec<Line> {
    let names: std::collections::BTreeSet<String> =
        lines.iter().map(|line| line.name.clone()).collect();
    let (mut waiting, rest): (Vec<Line>, Vec<Line>) = lines.into_iter().partition(|line| {
        line.parent_name()
            .is_none_or(|parent| !names.contains(parent))
    });
    waiting.reverse();
    let mut children = rest;
    let mut ordered = Vec::new();
    while let Some(line) = waiting.pop() {
        let (own, others): (Vec<Line>, Vec<Line>) = children
            .into_iter()
            .partition(|child| child.parent_name() == Some(&line.name));
        children = others;
        let depth = line.depth + 1;
        waiting.extend(own.into_iter().rev().map(|child| Line { depth, ..child }));
        ordered.push(line);
    }
    // Runs that are each other's ancestors; damage, but no reason to hide them.
    ordered.extend(children);
    ordered
}

fn table(lines: &[Line]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("run", Left),
        ("from", Left),
        ("state", Left),
        ("steps", Right),
        ("done", Right),
        ("stage", Left),
        ("loads", Left),
        ("size", Right),
        ("CPU", Right),
        ("created (UTC)", Left),
        ("note", Left),
    ]);
    for (index, line) in lines.iter().enumerate() {
        let branch = twigs(&lines[index..]);
        table.row([
            format!("{branch}{}", line.name),
            line.parent.clone().unwrap_or_default(),
            line.phrase.to_owned(),
            line.steps.to_string(),
            format!("{}/{}", increments(line.done), line.of),
            line.stage.clone(),
            loads(&line.loads),
            text::bytes(line.bytes),
            text::duration(line.cpu_s),
            text::utc(line.created),
            // A complete run's note says what its state does.
            if matches!(line.state, "completed" | "damaged") && !line.noted {
                String::new()
            } else {
                short(&line.note)
            },
        ]);
    }
    table
}

/// What stands before the name of the first of `lines`: how it hangs in the tree.
fn twigs(lines: &[Line]) -> String {
    let Some((line, below)) = lines.split_first() else {
        return String::new();
    };
    // Whether another twig of this depth comes before the bough itself ends.
    let goes_on = |depth: usize| {
        let next = below.iter().find(|other| other.depth <= depth);
        next.is_some_and(|other| other.depth == depth)
    };
    (1..=line.depth)
        .map(|depth| match (depth == line.depth, goes_on(depth)) {
            (true, true) => "├ ",
            (true, false) => "└ ",
            (false, true) => "│ ",
            (false, false) => "  ",
        })
        .collect()
}

/// The values of at most two loads: a table has no room for more.
fn loads(loads: &BTreeMap<String, f64>) -> String {
    let shown: Vec<String> = loads
        .iter()
        .take(2)
        .map(|(name, value)| format!("{name} {value:.4}"))
        .collect();
    let more = if loads.len() > 2 { ", …" } else { "" };
    format!("{}{more}", shown.join(", "))
}

/// `12`, or `12.25` within an increment that was cut.
pub fn increments(done: f64) -> String {
    if done.fract() == 0.0 {
        format!("{done:.0}")
    } else {
        format!("{done:.2}")
    }
}

/// The first line of a note, cut to fit a table.
fn short(note: &str) -> String {
    const LONGEST: usize = 60;
    let line = note.lines().next().unwrap_or_default();
    if line.chars().count() <= LONGEST {
        return line.to_owned();
    }
    let mut cut: String = line.chars().take(LONGEST - 1).collect();
    cut.push('…');
    cut
}

/// The names of some runs in a sentence: "`a`, `b`".
pub fn names(runs: &[RunName]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = runs
        .iter()
        .take(MOST)
        .map(|run| format!("`{run}`"))
        .collect();
    let more = if runs.len() > MOST { ", …" } else { "" };
    format!("{}{more}", shown.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, parent: Option<&str>) -> Line {
        Line {
            name: name.to_owned(),
            parent: parent.map(str::to_owned),
            state: "completed",
            killed: false,
            steps: 1,
            done: 1.0,
            of: 1,
            stage: String::new(),
            loads: BTreeMap::new(),
            kind: None,
            bytes: 0,
            cpu_s: 0.0,
            created: 0,
            note: String::new(),
            noted: false,
            depth: 0,
            phrase: "completed",
        }
    }

    #[test]
    fn no_run_is_lost_in_the_tree_even_where_parents_are_missing_or_circular() {
        let lines = vec![
            line("a", None),
            line("a-2", Some("a@3")),
            line("a-2-2", Some("a-2@5")),
            line("a-3", Some("a@1")),
            line("b", Some("gone@1")),
            line("c", Some("d@1")),
            line("d", Some("c@1")),
        ];
        let lines = as_tree(lines);
        let tree: Vec<_> = lines
            .iter()
            .map(|line| (line.name.clone(), line.depth))
            .collect();
        let expected = [
            ("a", 0),
            ("a-2", 1),
            ("a-2-2", 2),
            ("a-3", 1),
            ("b", 0),
            ("c", 0),
            ("d", 0),
        ];
        let drawn: Vec<_> = (0..lines.len()).map(|from| twigs(&lines[from..])).collect();
        assert_eq!(drawn, ["", "├ ", "│ └ ", "└ ", "", "", ""]);
        assert_eq!(tree, expected.map(|(name, depth)| (name.to_owned(), depth)));
    }
}
