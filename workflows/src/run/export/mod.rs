//! The results of a run as files of other programs, derived from its committed steps alone.
//!
//! | file | content |
//! |---|---|
//! | `curves.csv` | one row a committed step, see [`curves`] and [`test_curve`] |
//! | `fields-<step>.vtu`, `fields.pvd` | the mesh, see [`fields`] |
//! | `points-<step>.vtu`, `points.pvd` | the Gauss points as vertices, see [`fields`] |

mod body;
mod curves;
mod fields;
mod left_out;
mod second_gradient;
mod test_curve;

use std::path::{Path, PathBuf};

use serde_json::json;
use solver_fem::boundary::Target;

pub use self::body::BodyResults;
pub use self::{left_out::LeftOut, test_curve::test_curve};
use super::{
    Context,
    error::RunError,
    model::Model,
    open::explain,
    text,
    view::{RunView, StepView, View},
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    input::{
        Programme,
        problem::{Body, Model as InputModel},
    },
    output::{
        WriteError,
        csv::{Column, Table},
        pvd,
    },
    report::Report,
};

/// Why an export failed.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The run cannot be read.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A file cannot be written.
    #[error("write the output: {0}")]
    Write(#[from] WriteError),
}

impl From<store::ReadError> for ExportError {
    fn from(error: store::ReadError) -> Self {
        Self::Run(error.into())
    }
}

impl ExportError {
    /// What went wrong with `what`, where nothing was written.
    pub fn explain(self, what: &str) -> Failure {
        match self {
            Self::Run(error) => explain(what, error),
            Self::Write(_) => {
                Failure::new(FailureKind::Run, format!("failed to {what}")).because(self)
            }
        }
    }

    /// The same as the command line says it.
    pub fn into_failure(self, run: &store::RunName) -> Failure {
        match self {
            Self::Run(error) => explain(&format!("export run `{run}`"), error),
            Self::Write(_) => {
                Failure::new(FailureKind::Run, format!("failed to export run `{run}`"))
                    .because(self)
                    .hint("`--into DIR` names another folder")
            }
        }
    }
}

/// Writes the results of `name` into the folder `into`, by default one named after the run.
pub fn export(
    context: &Context<'_>,
    name: &RunName,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(name)?;
    if run.steps.is_empty() {
        let what = format!("failed to export run `{name}`: no load step is committed yet");
        return Err(Failure::new(FailureKind::Run, what)
            .hint(format!("`femdem-flow status {name}` tells where it is")));
    }
    let folder = into.map_or_else(|| PathBuf::from(run.name().as_str()), Path::to_owned);
    let mut left_out = LeftOut::default();
    let files = write(&view, &run, &folder, &mut left_out)
        .map_err(|error| error.into_failure(run.name()))?;
    let exported = exported(&run, &left_out);
    let text = summary(&run, &folder, &files, exported);
    let damaged: Vec<_> = left_out
        .damaged()
        .iter()
        .map(|(step, what)| json!({ "step": step, "what": what }))
        .collect();
    let data = json!({
        "name": run.name().as_str(),
        "steps": exported,
        "pruned": left_out.pruned(),
        "damaged": damaged,
        "into": folder.display().to_string(),
        "files": files,
    });
    left_out.conclude(run.name(), context.progress, Report::new(text, &data))
}

/// Load steps that were exported; the initial state is none.
fn exported(run: &RunView, left_out: &LeftOut) -> usize {
    let damaged = |step: &&StepView| {
        let mut numbers = left_out.damaged().iter().map(|(step, _)| *step);
        numbers.any(|number| number == step.record.index.0)
    };
    let sound = run.steps.iter().filter(|step| step.record.is_sound());
    let sound = sound.filter(|step| step.record.index.0 > 0);
    sound.filter(|step| !damaged(step)).count()
}

fn summary(run: &RunView, folder: &Path, files: &[String], exported: usize) -> String {
    let place = folder.display();
    let mut text = format!(
        "Run `{}`: {} exported into {place} ({})\n  {place}/curves.csv    curves of the whole run; its head says what the columns mean\n",
        run.name(),
        text::count(exported, "load step"),
        text::count(files.len(), "file")
    );
    if files.iter().any(|file| file == FIELDS) {
        text.push_str(&format!(
            "  {place}/{FIELDS}    fields over the mesh, for ParaView (Warp By Vector shows the displacement)\n  {place}/{POINTS}    the same at the Gauss points (representation: Point Gaussian)\n"
        ));
    }
    text
}

/// The collection of the fields over the mesh.
const FIELDS: &str = "fields.pvd";
/// The collection of the Gauss points.
const POINTS: &str = "points.pvd";

fn write(
    view: &View,
    run: &RunView,
    folder: &Path,
    left_out: &mut LeftOut,
) -> Result<Vec<String>, ExportError> {
    let mut files = vec!["curves.csv".to_owned()];
    let curves = folder.join("curves.csv");
    let problem = &run.manifest.problem;
    let InputModel::Body(body) = &problem.model else {
        test_curve(view, run, left_out)?.write(&curves)?;
        return Ok(files);
    };
    let results = BodyResults::open(view, run, body)?;
    let mut table = curves::Curves::new(run, &results, body);
    let (mut fields, mut points) = (Vec::new(), Vec::new());
    for step in &run.steps {
        if !left_out.admit(step) {
            continue;
        }
        let Some(state) = left_out.unless_damaged(step, results.state(step))? else {
            continue;
        };
        if !is_written(step, run, problem.output.every) {
            table.push(step, &state)?;
            continue;
        }
        let written = fields::write(&results, step, &state, &problem.output.fields, folder);
        let Some([mesh_file, point_file]) = left_out.unless_damaged(step, written)? else {
            continue;
        };
        table.push(step, &state)?;
        let time = step.reached();
        fields.push(pvd::Entry {
            time,
            file: mesh_file.clone(),
        });
        points.push(pvd::Entry {
            time,
            file: point_file.clone(),
        });
        files.extend([mesh_file, point_file]);
    }
    table.finish().write(&curves)?;
    pvd::write(&folder.join(FIELDS), &fields)?;
    pvd::write(&folder.join(POINTS), &points)?;
    files.extend([FIELDS.to_owned(), POINTS.to_owned()]);
    Ok(files)
}

/// The curves of a run: one row for each committed step that can be read; the others are noted.
///
/// # Errors
/// A run that cannot be read.
pub fn table(view: &View, run: &RunView, left_out: &mut LeftOut) -> Result<Table, ExportError> {
    let InputModel::Body(body) = &run.manifest.problem.model else {
        return test_curve(view, run, left_out);
    };
    let results = BodyResults::open(view, run, body)?;
    let mut table = curves::Curves::new(run, &results, body);
    for step in &run.steps {
        if left_out.admit(step)
            && let Some(state) = left_out.unless_damaged(step, results.state(step))?
        {
            table.push(step, &state)?;
        }
    }
    Ok(table.finish())
}

/// Fields are written for every so many steps, and for the first and the last.
fn is_written(step: &StepView, run: &RunView, every: u32) -> bool {
    let index = step.record.index.0;
    index.is_multiple_of(every.max(1))
        || Some(index) == run.steps.first().map(|first| first.record.index.0)
        || index == run.last_index()
}

/// The places whose displacements and forces are reported: the boundaries of the mesh, and the node sets that carry a
/// condition.
pub fn places(model: &Model, body: &Body) -> Vec<(String, Target)> {
    let mesh = model.problem.mesh();
    let boundaries = mesh
        .boundaries
        .keys()
        .map(|name| (name.clone(), Target::boundary(name)));
    let held = |name: &&String| {
        body.conditions
            .iter()
            .any(|condition| condition.on == **name)
    };
    let sets = mesh
        .node_sets
        .keys()
        .filter(|name| !mesh.boundaries.contains_key(*name))
        .filter(held);
    boundaries
        .chain(sets.map(|name| (name.clone(), Target::node_set(name))))
        .collect()
}

/// The first columns of every curve: where in the programme the row is.
fn place_columns(programme: &Programme, loads: &[String]) -> Vec<Column> {
    let stages = programme.stage_names().enumerate();
    let legend: Vec<String> = stages
        .map(|(k, stage)| format!("{} = {stage}", k + 1))
        .collect();
    let mut columns = vec![
        Column::new(
            "step",
            "",
            "number of the load step; 0 is the initial state",
        ),
        Column::new(
            "increment",
            "",
            "increments of the programme done, the part of a cut one included",
        ),
        Column::new(
            "stage",
            "",
            format!(
                "stage of the programme: 0 = before the first, {}",
                legend.join(", ")
            ),
        ),
    ];
    columns.extend(loads.iter().map(|name| {
        Column::new(
            format!("load_{name}"),
            "",
            format!("value of the load `{name}`"),
        )
    }));
    columns
}

/// Their values for one step.
fn place_values(programme: &Programme, loads: usize, step: &StepView) -> Vec<f64> {
    let summary = &step.summary;
    let stage = programme
        .stage_names()
        .position(|stage| stage == summary.stage);
    let stage = stage.map_or(0, |k| k + 1);
    let mut values = vec![f64::from(step.record.index.0), step.reached(), stage as f64];
    values.extend((0..loads).map(|k| summary.loads.get(k).copied().unwrap_or(f64::NAN)));
    values
}
