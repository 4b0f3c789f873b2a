//! `rev show`: one REV as a picture and in figures.

mod figures;
mod legend;
mod packing;
mod picture;
mod rose;

use std::path::PathBuf;
use std::str::FromStr;

use serde_json::json;
use solver_dem::{Anatomy, anatomy, anatomy::Statistics};

use super::{Context, open::explain, packings::read_packing, point::PlaneRev, rev_of_step};
use crate::{
    address::{AddressError, RevAddress},
    failure::{Failure, FailureKind},
    plot::PictureFile,
    report::Report,
};

/// Where a REV is: in a committed step, or in a packing file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RevSource {
    /// `hollow@12:e46.2`
    Run(RevAddress),
    /// A packing, as `rev export` writes it.
    File(PathBuf),
}

impl FromStr for RevSource {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        // A run name holds neither; what looks like a file is meant as one, whether it is there or not.
        if text.ends_with(".json") || text.contains('/') {
            return Ok(Self::File(text.into()));
        }
        text.parse().map(Self::Run)
    }
}

/// What is shown.
struct Subject {
    /// What the picture is called.
    title: String,
    /// Its default file, without extension.
    stem: String,
    rev: PlaneRev,
    anatomy: Anatomy,
    statistics: Statistics,
}

/// Draws the REV at `source` into `output`, by default a PNG in the working directory, and reports its figures.
pub fn show(
    context: &Context<'_>,
    source: &RevSource,
    output: Option<&PictureFile>,
) -> Result<Report, Failure> {
    let subject = subject(context, source)?;
    let default;
    let output = match output {
        Some(output) => output,
        None => {
            let name = format!("{}.png", subject.stem);
            default = name.parse().map_err(|error| {
                Failure::new(FailureKind::Usage, "failed to name the picture")
                    .because(error)
                    .hint("name it by `--output FILE.png`")
            })?;
            &default
        }
    };
    output.write(&picture::draw(&subject)).map_err(|error| {
        Failure::new(
            FailureKind::Run,
            format!("failed to draw the picture of {}", subject.title),
        )
        .because(error)
        .hint("`--output FILE` draws it elsewhere")
    })?;
    let text = format!(
        "{}\nDrawn to {output}.\n",
        figures::text(&subject).trim_end()
    );
    let data = json!({
        "rev": subject.title,
        "file": output.path(),
        "void_ratio": subject.rev.void_ratio(),
        "residual": subject.anatomy.residual,
        "stress": subject.anatomy.stress,
        "statistics": subject.statistics,
    });
    Ok(Report::new(text, &data))
}

fn subject(context: &Context<'_>, source: &RevSource) -> Result<Subject, Failure> {
    let (title, stem, rev) = match source {
        RevSource::Run(address) => {
            let found = rev_of_step::find(context, address)?;
            let (run, step, place) = (&address.run, found.step, address.place);
            (
                format!("{run}@{step}:{place}"),
                format!("{run}-{step}-{place}"),
                found.rev,
            )
        }
        RevSource::File(path) => {
            let name = path.display().to_string();
            let rev = read_packing(&name).map_err(|error| explain("read the packing", error))?;
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            (name, stem.into_owned(), rev)
        }
    };
    let anatomy = anatomy(&rev).map_err(|error| {
        Failure::new(
            FailureKind::Run,
            format!("failed to read the forces in {title}"),
        )
        .because(error)
    })?;
    let statistics = anatomy.statistics();
    Ok(Subject {
        title,
        stem,
        rev,
        anatomy,
        statistics,
    })
}
