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

#[test]
fn every_path_that_it_names_exists() {
    let (text, crates) = (architecture(), crates());
    let mut known = 0;
    for quoted in text.split('`').skip(1).step_by(2) {
        let first = quoted.split('/').next().unwrap_or_default();
        let is_path = quoted.contains('/')
            && !quoted.contains([' ', '<', '*', '{', '('])
            && (crates.iter().any(|name| name == first) || [".ci", "docs"].contains(&first));
        if is_path {
            assert!(
                tests::root().join(quoted).exists(),
                "ARCHITECTURE.md names `{quoted}`, which is not there"
            );
            known += 1;
        }
    }
    assert!(known >= crates.len(), "only {known} paths were found in it");
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
