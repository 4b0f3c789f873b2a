//! The input language: YAML → [`Problem`], or everything that is wrong with it at once.
//!
//! 1. `tree`: YAML to values that know their line and column;
//! 2. `check`: the tree against the schema derived from the types of `document`;
//! 3. `resolve`: what a schema cannot say (references, contradictions), and the resolved form.
//!
//! Each stage goes on after a mistake as far as it can, so that one run of the program shows them all.

pub mod body;
pub mod boundaries;
mod check;
pub mod derive;
mod document;
mod error;
pub mod gmsh;
pub mod mesh;
mod path;
pub mod plain;
pub mod problem;
pub mod programme;
mod report;
mod resolve;
mod scalar;
mod schema;
mod tree;

use std::path::Path as FilePath;

pub use document::{
    Annulus, Box2, Element, Field, LinearSolver, LossOfConfinement, OutputSettings, Packings,
    Rectangle, Sector, SolverSettings,
};
pub use error::{InputError, InputErrors, Span};
pub use mesh::Mesh;
pub use problem::Problem;
pub use programme::{Programme, Step};
pub use schema::published as schema;

/// The largest input that is read, in bytes: far above any hand-written one, far below what would fill the memory.
const LARGEST: u64 = 4 << 20;

/// Reads and checks the input file `path`. Files it names are looked for in its own folder.
///
/// # Errors
/// All that is wrong with it, or the reason why it cannot be read.
pub fn load(path: impl AsRef<FilePath>) -> Result<Problem, InputErrors> {
    let path = path.as_ref();
    let (name, text) = read_text(path)?;
    parse(&text, &name, path.parent().unwrap_or(FilePath::new("")))
}

/// The name of the file `path` in messages, and its text.
fn read_text(path: &FilePath) -> Result<(String, String), InputErrors> {
    let name = path.display().to_string();
    let refuse = |message: String, help: Option<&str>| {
        InputErrors::whole(&name, message, help.map(str::to_owned))
    };
    let metadata = std::fs::metadata(path)
        .map_err(|error| refuse(format!("cannot read {name}: {error}"), None))?;
    if metadata.is_dir() {
        return Err(refuse(
            format!("{name} is a folder"),
            Some("name the YAML file in it"),
        ));
    }
    if !metadata.is_file() {
        return Err(refuse(format!("{name} is no regular file"), None));
    }
    if metadata.len() > LARGEST {
        let message = format!(
            "{name} has {} bytes, an input at most {LARGEST}",
            metadata.len()
        );
        return Err(refuse(message, Some("is this the file you meant?")));
    }
    let bytes = std::fs::read(path)
        .map_err(|error| refuse(format!("cannot read {name}: {error}"), None))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|&&byte| byte == b'\n').count() + 1;
        refuse(
            format!("{name} is no UTF-8 text: the first bad byte is on line {line}"),
            Some("save it as UTF-8"),
        )
    })?;
    Ok((name, text))
}

/// Checks an input given as text; `name` stands for the file in messages, files it names are looked for in `base`.
///
/// # Errors
/// All that is wrong with it.
pub fn parse(text: &str, name: &str, base: &FilePath) -> Result<Problem, InputErrors> {
    let source = text;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut errors = Vec::new();
    let Some(tree) = tree::read(text, &mut errors) else {
        if errors.is_empty() {
            let help = "start from one of the examples, or see `femdem-flow schema`";
            return Err(InputErrors::whole(
                name,
                "the input is empty".to_owned(),
                Some(help.to_owned()),
            ));
        }
        return Err(InputErrors::new(name, text, errors));
    };
    let mut report = report::Report::new(&tree, errors);
    let unknown = check::check(&schema::schema(), &mut report);
    let problem = resolve::resolve(&mut report, &unknown, source, base);
    match problem {
        Some(problem) if report.is_clean() => Ok(problem),
        _ => Err(InputErrors::new(name, text, report.into_errors())),
    }
}
