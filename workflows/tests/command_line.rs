//! The command line as a user meets it: wrong usage and wrong input end with exit code 2 and touch nothing, data goes to
//! stdout, and machines get JSON.

mod common;

use std::fs;
use std::path::Path;

use common::femdem;

#[test]
fn wrong_usage_is_explained_on_stderr_with_its_own_exit_code() {
    for args in [
        &["sumbit", "a.yaml"][..],
        &["submit"],
        &["submit", "a.yaml", "--name", "my run"],
        &["resume", "a/b"],
        &["show", "hollow@-1"],
        &["rev", "export", "hollow:e1.0", "p.json"],
        &["runs", "--threads", "0"],
        &["submit", "a.yaml", "--until", "yesterday"],
        &["submit", "a.yaml", "--queue", "--alone"],
        &["queue", "remove"],
        &["cancel", "hollow", "--timeout", "-1"],
        &["store"],
        &[],
    ] {
        let outcome = femdem(args);
        assert_eq!(outcome.code, 2, "{args:?}");
        assert!(
            outcome.out.is_empty() && !outcome.err.is_empty(),
            "{args:?}"
        );
    }
    assert!(femdem(&["sumbit", "a.yaml"]).err.contains("'submit'"));
    assert!(
        femdem(&["show", "hollow@12:e46.2"])
            .err
            .contains("`rev export` takes REVs")
    );
    assert!(
        femdem(&["show", "hollow@-1"])
            .err
            .contains("write a number or `last`")
    );
}

#[test]
fn every_verb_explains_itself() {
    let top = femdem(&["--help"]);
    assert_eq!(top.code, 0);
    assert!(top.out.contains("Exit codes:") && top.out.contains("hollow@12:e46.2"));
    for verb in [
        "submit",
        "resume",
        "cancel",
        "pause",
        "continue",
        "queue",
        "watch",
        "runs",
        "show",
        "status",
        "export",
        "rev",
        "bench",
        "replay",
        "verify",
        "diff",
        "store",
        "schema",
        "completions",
    ] {
        let help = femdem(&[verb, "--help"]);
        assert_eq!(help.code, 0, "{verb}");
        assert!(
            help.out.contains("--store") && help.err.is_empty(),
            "{verb}"
        );
    }
}

#[test]
fn a_wrong_input_leaves_no_store_behind() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    let file = folder.path().join("bad.yaml");
    fs::write(&file, "name: bad\nmesh: {}\n").unwrap();
    let (store_arg, file_arg) = (store.to_str().unwrap(), file.to_str().unwrap());
    let outcome = femdem(&["submit", file_arg, "--store", store_arg]);
    assert_eq!(outcome.code, 2);
    assert!(outcome.out.is_empty());
    assert!(outcome.err.contains("bad.yaml:2:1"), "{}", outcome.err);
    assert!(
        outcome
            .err
            .contains("Error: failed to read the input: 3 problems in"),
        "{}",
        outcome.err
    );
    assert!(!store.exists());

    let outcome = femdem(&["submit", file_arg, "--store", store_arg, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&outcome.out).unwrap();
    assert_eq!(json["error"]["kind"], "usage");
    assert_eq!(
        json["error"]["input"]["errors"].as_array().unwrap().len(),
        3
    );
}

#[test]
fn a_missing_file_is_a_usage_error() {
    let outcome = femdem(&["submit", "no/such/file.yaml"]);
    assert_eq!(outcome.code, 2);
    assert!(outcome.err.contains("no/such/file.yaml"));
}

#[test]
fn the_schema_is_data() {
    let outcome = femdem(&["schema"]);
    assert_eq!((outcome.code, outcome.err.as_str()), (0, ""));
    let schema: serde_json::Value = serde_json::from_str(&outcome.out).unwrap();
    assert_eq!(
        schema["properties"]["name"]["pattern"],
        "^[A-Za-z0-9_-]{1,64}$"
    );
    assert_eq!(femdem(&["schema", "--json"]).out, outcome.out);
}

#[test]
fn completions_know_the_verbs() {
    for shell in ["bash", "zsh", "fish"] {
        let outcome = femdem(&["completions", shell]);
        assert_eq!((outcome.code, outcome.err.as_str()), (0, ""));
        assert!(
            [
                "resume",
                "export",
                "cancel",
                "queue",
                "watch",
                "max-restarts"
            ]
            .iter()
            .all(|word| outcome.out.contains(word)),
            "{shell}"
        );
    }
    assert_eq!(femdem(&["completions", "dos"]).code, 2);
}

#[test]
fn the_examples_are_where_the_readme_says() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for name in ["hollow", "biaxial", "biaxial-cohesive", "rev-biaxial"] {
        assert!(
            examples.join(name).with_extension("yaml").is_file(),
            "{name}"
        );
    }
}
