//! A map that names streets which are gone is worse than none: every path in ARCHITECTURE.md exists, and every crate
//! of the workspace is in it.

use std::fs;

fn architecture() -> String {
    let path = tests::root().join("ARCHITECTURE.md");
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The crates, which are the folders at the top.
fn crates() -> Vec<String> {
    let entries = fs::read_dir(tests::root())
        .unwrap()
        .map(|entry| entry.unwrap());
    let mut names: Vec<_> = entries
        .filter(|entry| entry.path().join("Cargo.toml").is_file())
        .map(|entry| entry.file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// The words of the text that are paths: their first part is a folder at the top, or they end with a slash.
fn paths(text: &str) -> Vec<String> {
    let mut tops = crates();
    tops.extend([".ci", "docs"].map(str::to_owned));
    let words = text.split(|c: char| c.is_whitespace() || "`()[]|,\"".contains(c));
    let words = words.map(|word| word.split('#').next().unwrap_or_default());
    let words = words.map(|word| word.trim_end_matches(['.', ':', ';']));
    let pattern = |word: &str| word.contains(['<', '*', '{', '…']) || word.contains("://");
    let is_path = |word: &&str| {
        let top = word.split('/').next().unwrap_or_default();
        let below_top = word.contains('/') && tops.iter().any(|name| name == top);
        (below_top || (word.len() > 1 && word.ends_with('/'))) && !pattern(word)
    };
    words.filter(is_path).map(str::to_owned).collect()
}

#[test]
fn every_path_that_it_names_exists() {
    let text = architecture();
    for path in paths(&text) {
        let there = tests::root().join(&path).exists();
        assert!(there, "ARCHITECTURE.md names `{path}`, which is not there");
    }
}

#[test]
fn paths_are_found_in_prose_tables_and_links() {
    let text = "see `engine/src/graph.rs`, [why](docs/design/store.md#format) | store/ | packs/<run>/x, and/or.";
    assert_eq!(
        paths(text),
        ["engine/src/graph.rs", "docs/design/store.md", "store/"]
    );
}

#[test]
fn every_crate_is_on_the_map() {
    let text = architecture();
    for name in crates() {
        assert!(
            text.contains(&format!("`{name}")),
            "ARCHITECTURE.md does not name `{name}`"
        );
    }
}
