//! The help texts of the verbs for long runs, as they are read at a terminal: an option that is not explained where it is
//! looked for is not used.

mod common;

use common::femdem;

/// The help of a verb without the options of every verb.
fn help(verb: &[&str]) -> String {
    let asked: Vec<&str> = verb.iter().copied().chain(["--help"]).collect();
    let outcome = femdem(&asked).good();
    let own = outcome.out.lines().scan(false, |skipping, line| {
        let begins = line.trim_start().starts_with('-');
        let global = ["--store ", "--threads ", "--json", "--quiet", "--help"];
        if begins {
            *skipping = global.iter().any(|option| line.contains(option));
        }
        Some((!*skipping).then_some(line))
    });
    let lines: Vec<&str> = own.flatten().collect();
    lines.join("\n")
}

#[test]
fn the_verbs_of_long_runs_explain_themselves() {
    insta::assert_snapshot!("submit", help(&["submit"]));
    insta::assert_snapshot!("cancel", help(&["cancel"]));
    insta::assert_snapshot!("pause", help(&["pause"]));
    insta::assert_snapshot!("queue", help(&["queue"]));
    insta::assert_snapshot!("queue_run", help(&["queue", "run"]));
    insta::assert_snapshot!("watch", help(&["watch"]));
}
