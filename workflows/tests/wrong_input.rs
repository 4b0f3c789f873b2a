//! Wrong input must end in a message that says where, what, and what would be right: for every problem at once, and
//! never in a panic. Each file in `wrong/` is one kind of mistake; its message is in `snapshots/`.

use std::fs;
use std::path::{Path, PathBuf};

use workflows::input;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn files(name: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder(name))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "yaml"))
        .collect();
    files.sort();
    files
}

#[test]
fn every_kind_of_mistake_is_explained() {
    let base = folder("tests/wrong");
    let files = files("tests/wrong");
    assert!(files.len() > 50);
    for path in files {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let Err(errors) = input::load(&path) else {
            panic!("{name} was taken")
        };
        // The message must not depend on where the repository lies.
        let message = errors
            .to_string()
            .replace(&format!("{}/", base.display()), "");
        insta::assert_snapshot!(name, message);
    }
}

#[test]
fn a_file_that_cannot_be_read_is_an_error_of_its_own() {
    let folder_error = input::load(folder("tests")).unwrap_err().to_string();
    assert!(folder_error.contains("is a folder"), "{folder_error}");
    let missing = input::load(folder("tests/wrong/no_such_file.yaml")).unwrap_err();
    assert_eq!(missing.errors.len(), 1);
    assert!(missing.errors[0].span.is_none());
}

#[test]
fn machines_get_the_same_places_as_people() {
    let errors = input::load(folder("tests/wrong/unknown_key.yaml")).unwrap_err();
    let json = serde_json::to_value(&errors).unwrap();
    assert_eq!(json["errors"][0]["path"], "mesh.annulus.grwth");
    assert_eq!(json["errors"][0]["span"]["line"], 4);
    assert_eq!(json["errors"].as_array().unwrap().len(), 2);
}
