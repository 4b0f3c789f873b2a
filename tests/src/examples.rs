//! The examples of the repository, made small enough to be computed many times: the same stages, laws and conditions
//! with 30 grains, few elements and shorter ways.
//!
//! The texts are reduced line by line, and a line that is not understood is a panic: an example of another shape
//! needs a rule here, or it would be tested at full size or not at all.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// An example, reduced.
#[derive(Clone, Debug)]
pub struct Example {
    /// Name of its file and of its run.
    pub name: String,
    /// The input, reduced.
    pub text: String,
    /// The share of the way that is left: of the distance of every load from its initial value.
    share: f64,
    /// The initial values of its loads, as far as they are not 0.
    initial: BTreeMap<String, f64>,
}

/// The branches of an example, reduced like it.
#[derive(Clone, Debug)]
pub struct Branches {
    /// The name of its file, which is that of the example it branches off.
    pub name: String,
    /// The load step they begin with.
    pub step: u32,
    /// The branches file, reduced.
    pub text: String,
}

/// Load steps of a reduced example, about.
const STEPS: f64 = 6.0;
/// The least share of the way that is left, so that long element tests do more than one increment at the beginning.
const LEAST_SHARE: f64 = 0.05;

/// The folder of the examples.
pub fn folder() -> PathBuf {
    crate::root().join("workflows/examples")
}

/// The input files among the examples, in the order of their names.
pub fn inputs() -> Vec<PathBuf> {
    files_in(&folder(), "yaml")
}

/// The mesh files that examples name, in the order of their names.
pub fn meshes() -> Vec<PathBuf> {
    files_in(&folder(), "msh")
}

/// Copies what inputs refer to, meshes above all, into `folder`.
///
/// # Panics
/// Where that cannot be done.
pub fn bring_what_they_read(into: &Path) {
    let entries = fs::read_dir(folder()).expect("the folder of the examples is there");
    let files = entries.flatten().map(|entry| entry.path());
    for file in files.filter(|path| path.is_file() && path.extension().is_none_or(|e| e != "yaml"))
    {
        let name = file.file_name().expect("a file has a name");
        fs::copy(&file, into.join(name)).expect("a file can be copied");
    }
}

/// All examples, reduced.
///
/// # Panics
/// Where one of them has a line that is not understood here.
pub fn all() -> Vec<Example> {
    let files = inputs();
    assert!(files.len() >= 8, "{files:?}");
    files.iter().map(|file| Example::of(file)).collect()
}

/// All branches of examples, reduced.
///
/// # Panics
/// Where one of them has a line that is not understood here.
pub fn branches(examples: &[Example]) -> Vec<Branches> {
    let files = files_in(&folder().join("branches"), "yaml");
    assert!(!files.is_empty());
    files
        .iter()
        .map(|file| Branches::of(file, examples))
        .collect()
}

impl Example {
    /// Whether it is a single REV and no body.
    pub fn is_element_test(&self) -> bool {
        self.text.contains("element_test:")
    }

    fn of(file: &Path) -> Self {
        let (name, text) = read(file);
        let initial = initial(&text);
        let share = (STEPS / steps(&text)).clamp(LEAST_SHARE, 1.0);
        let mut section = "";
        let mut reduced = String::new();
        for line in text.lines() {
            if let Some((key, _)) = line.split_once(':')
                && !line.starts_with([' ', '#', '-'])
            {
                section = key;
            }
            let line = match section {
                "mesh" => with_numbers(line, "elements", |n| n.min(3.0)),
                "regions" => with_numbers(line, "elements", |_| 1.0),
                "materials" => {
                    let line = with_numbers(line, "grains", |n| n.min(30.0));
                    with_numbers(&line, "gallery", |n| n.min(2.0))
                }
                "programme" => shortened(line, share, &initial),
                _ => line.to_owned(),
            };
            reduced.push_str(&line);
            reduced.push('\n');
        }
        Self {
            name,
            text: reduced,
            share,
            initial,
        }
    }
}

impl Branches {
    fn of(file: &Path, examples: &[Example]) -> Self {
        let (name, text) = read(file);
        let example = examples.iter().find(|example| example.name == name);
        let example = example.unwrap_or_else(|| panic!("branches/{name}.yaml is of no example"));
        let address = text.split(&format!("{name}@")).nth(1);
        let step = address.and_then(|after| after.split(' ').next()?.parse::<f64>().ok());
        let step = step.expect("its first lines name the load step that they branch off");
        let lines = text
            .lines()
            .map(|line| shortened(line, example.share, &example.initial));
        let text = lines.map(|line| line + "\n").collect();
        Self {
            name,
            step: (step * example.share).round().max(1.0) as u32,
            text,
        }
    }
}

fn files_in(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder of the examples is there");
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == extension));
    files.sort();
    files
}

fn read(file: &Path) -> (String, String) {
    let name = file.file_stem().and_then(|name| name.to_str());
    let text = fs::read_to_string(file).expect("an example can be read");
    (name.expect("it has a plain name").to_owned(), text)
}

/// The initial values of the loads that `loads` names; those of an element test are 0, but for a mean stress.
fn initial(text: &str) -> BTreeMap<String, f64> {
    let mut initial = BTreeMap::from([("mean_stress".to_owned(), -1.0)]);
    let named = text
        .lines()
        .find_map(|line| line.strip_prefix("loads:"))
        .unwrap_or_default();
    for entry in named
        .split('}')
        .next()
        .unwrap_or_default()
        .replace('{', "")
        .split(',')
    {
        if let Some((load, value)) = entry.split_once(':') {
            let value = value.trim().parse().expect("a load begins with a number");
            initial.insert(load.trim().to_owned(), value);
        }
    }
    initial
}

/// Load steps of a programme.
fn steps(text: &str) -> f64 {
    let stages = text.lines().filter(|line| is_stage(line));
    let steps = stages.map(|line| {
        let times =
            if line.contains("cycle:") { 2.0 } else { 1.0 } * number(line, "times").unwrap_or(1.0);
        number(line, "steps").expect("a stage of an example has steps") * times
    });
    steps.sum()
}

fn is_stage(line: &str) -> bool {
    ["ramp:", "cycle:", "hold:", "control: { load:"]
        .iter()
        .any(|kind| line.contains(kind))
        && !line.trim_start().starts_with('#')
}

/// A line of a programme, the way it goes and its steps reduced to `share`.
fn shortened(line: &str, share: f64, initial: &BTreeMap<String, f64>) -> String {
    let plain = line.trim_start();
    if !is_stage(line) {
        // A stage over several lines would be left at its full length.
        let known = [
            "#",
            "programme:",
            "branches:",
            "- name:",
            "solver:",
            "output:",
        ];
        assert!(
            plain.is_empty() || known.iter().any(|begin| plain.starts_with(begin)),
            "tests/src/examples.rs cannot reduce the line `{line}`"
        );
        return line.to_owned();
    }
    let mut line = with_numbers(line, "steps", |n| (n * share).round().max(1.0));
    line = with_numbers(&line, "times", |n| n.min(2.0));
    line = with_numbers(&line, "arc_length", |n| n * share);
    let goes = ["ramp: {", "cycle: {", "volume: {"]
        .iter()
        .find_map(|kind| {
            let start = line.find(kind)? + kind.len();
            Some((start, start + line[start..].find('}')?))
        });
    let Some((start, end)) = goes else {
        return line;
    };
    let mut ways = line[start..end].to_owned();
    let loads: Vec<String> = ways
        .split(':')
        .filter_map(|part| part.rsplit([' ', ',', '{']).next())
        .filter(|name| name.starts_with(|c: char| c.is_ascii_alphabetic()))
        .map(str::to_owned)
        .collect();
    assert!(
        !loads.is_empty(),
        "tests/src/examples.rs finds no load in `{line}`"
    );
    for load in loads {
        let from = initial.get(&load).copied().unwrap_or(0.0);
        ways = with_numbers(&ways, &load, |to| from + (to - from) * share);
    }
    format!("{}{ways}{}", &line[..start], &line[end..])
}

/// The number after `key: `.
fn number(line: &str, key: &str) -> Option<f64> {
    let after = line.split(&format!("{key}: ")).nth(1)?;
    let end = after.find([' ', ',', '}']).unwrap_or(after.len());
    after[..end].parse().ok()
}

/// The number after `key: `, or those of the list after it, changed by `change`.
fn with_numbers(line: &str, key: &str, change: impl Fn(f64) -> f64) -> String {
    let Some(at) = line.find(&format!("{key}: ")) else {
        return line.to_owned();
    };
    let start = at + key.len() + 2;
    let after = &line[start..];
    let (open, close, inner) = match after.strip_prefix('[') {
        Some(list) => ("[", "]", &list[..list.find(']').expect("a list ends")]),
        None => (
            "",
            "",
            &after[..after.find([' ', ',', '}']).unwrap_or(after.len())],
        ),
    };
    let numbers: Vec<String> = inner
        .split(',')
        .map(|number| {
            let number = number.trim().parse();
            change(number.unwrap_or_else(|_| panic!("`{key}` of `{line}` is no number")))
                .to_string()
        })
        .collect();
    let rest = &after[open.len() + inner.len() + close.len()..];
    format!(
        "{}{open}{}{close}{rest}",
        &line[..start],
        numbers.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_goes_a_part_of_its_way_from_the_initial_value() {
        let initial = BTreeMap::from([("cavity".to_owned(), 1.0)]);
        let line = "  - { name: unloading, ramp: { cavity: 0.5 }, steps: 40 }";
        let expected = "  - { name: unloading, ramp: { cavity: 0.75 }, steps: 20 }";
        assert_eq!(shortened(line, 0.5, &initial), expected);
        let line = "  - { name: i, control: { load: cavity, volume: { inner: 0.4 } }, steps: 6 }";
        let expected =
            "  - { name: i, control: { load: cavity, volume: { inner: 0.2 } }, steps: 3 }";
        assert_eq!(shortened(line, 0.5, &initial), expected);
        let line = "  - { name: c, cycle: { axial: [0.5, -1] }, times: 3, steps: 1 }";
        let expected = "  - { name: c, cycle: { axial: [0.25, -0.5] }, times: 2, steps: 1 }";
        assert_eq!(shortened(line, 0.5, &initial), expected);
    }

    #[test]
    fn steps_are_counted_as_the_programme_takes_them() {
        let text =
            "- { ramp: { a: 1 }, steps: 3 }\n- { cycle: { a: [1, 0] }, times: 2, steps: 5 }\n";
        assert_eq!(steps(text), 23.0);
    }
}
