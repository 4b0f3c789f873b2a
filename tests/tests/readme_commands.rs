//! A README whose commands do not work is the first thing a new user meets. Every `femdem-flow` command in it is one
//! that the program takes, names files that exist, and those that only read the command line or an input are run.
//!
//! Commands are looked for in the README's ```` ```sh ```` blocks, with `femdem-flow` or `cargo run --release --`.

use std::fs;

use tests::workplace::Workplace;

const CARGO: &str = "cargo run --release -- ";

/// The commands after `femdem-flow`, comments and redirections cut off.
fn commands() -> Vec<Vec<String>> {
    let path = tests::root().join("README.md");
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut commands = Vec::new();
    let mut shell = false;
    for line in text.lines() {
        let line = line.trim();
        if let Some(language) = line.strip_prefix("```") {
            shell = !shell && matches!(language.split([' ', ',']).next(), Some("sh" | "console"));
            continue;
        }
        let line = line.strip_prefix("$ ").unwrap_or(line);
        let line = line.split(" #").next().unwrap_or_default();
        let arguments = line
            .strip_prefix("femdem-flow ")
            .or_else(|| line.strip_prefix(CARGO));
        if let (true, Some(arguments)) = (shell, arguments) {
            let words = arguments
                .split_whitespace()
                .take_while(|word| !matches!(*word, "&" | "|" | ">" | ";" | "&&"));
            commands.push(words.map(str::to_owned).collect());
        }
    }
    commands
}

#[test]
fn the_first_two_commands_are_the_promised_ones() {
    let text = fs::read_to_string(tests::root().join("README.md")).unwrap();
    for command in [
        "cargo run --release -- submit workflows/examples/hollow.yaml",
        "cargo test --release",
    ] {
        assert!(
            text.contains(command),
            "the README does not say `{command}`"
        );
    }
}

#[test]
fn every_command_is_one_that_the_program_takes() {
    let place = Workplace::new();
    let commands = commands();
    assert!(commands.len() >= 4, "{commands:?}");
    for command in commands {
        // An input that does not exist ends a verb before it does anything, and so does a run that does not:
        // what is left is that the command line is understood, and whatever needs neither is really done.
        let shown = command.join(" ");
        let elsewhere: Vec<_> = command
            .iter()
            .map(|word| {
                if word.ends_with(".yaml") {
                    format!("{word}.not-there")
                } else {
                    word.clone()
                }
            })
            .collect();
        let outcome = place.run(&elsewhere);
        // The last line of every refusal of a command line.
        let usage = outcome.err.contains("For more information, try '--help'");
        assert!(!usage, "`{shown}`: {}", outcome.err);
    }
}

#[test]
fn every_file_that_a_command_names_exists() {
    for command in commands() {
        for word in command.iter().filter(|word| word.ends_with(".yaml")) {
            let own = !word.contains('/');
            assert!(
                own || tests::root().join(word).is_file(),
                "there is no {word}"
            );
        }
    }
}
