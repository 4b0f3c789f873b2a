//! An element test whose run is not kept.

use serde_json::{Map, Value, json};
use store::Store;

use super::{
    Context,
    error::RunError,
    export::{LeftOut, test_curve},
    open::{explain, store_name},
    session::{self, SessionEnd},
    shift::{Shift, Terms},
    test_picture,
    view::View,
};
use crate::{
    failure::{Failure, FailureKind},
    input::{Problem, problem::Model},
    output::csv::Table,
    plot::PictureFile,
    report::Report,
};

/// Computes the element test of `problem` as `submit` would, in a store that is thrown away, and reports the curve that
/// `export` would write; draws it into `plot` too.
pub fn test(
    context: &Context<'_>,
    problem: &Problem,
    plot: Option<&PictureFile>,
) -> Result<Report, Failure> {
    let Model::ElementTest(element_test) = &problem.model else {
        let what = "failed to run the element test: the input describes a body";
        return Err(Failure::new(FailureKind::Usage, what).hint(
            "`femdem-flow submit` computes bodies; an `element_test` takes the place of `mesh`",
        ));
    };
    let failed = |error| explain("run the element test", error);
    let folder = tempfile::tempdir().map_err(|error| {
        let path = std::env::temp_dir();
        failed(RunError::File { path, error })
    })?;
    let kept_nowhere = Context {
        store: folder.path().to_owned(),
        ..*context
    };
    let end = {
        let store = Store::open(folder.path())
            .map_err(|error| super::open::refused(&kept_nowhere, error))?;
        let name = store_name(&problem.name)?;
        let run =
            session::create(&store, name, problem.clone(), context.threads()).map_err(failed)?;
        let terms = Terms::default();
        let shift = Shift::begin(context, &terms)?;
        session::advance(&shift.equipment(&store), &run, problem).map_err(failed)?
    };
    let view = View::open(&kept_nowhere)?;
    let run = view.run(&problem.name)?;
    let mut left_out = LeftOut::default();
    let curve =
        test_curve(&view, &run, &mut left_out).map_err(|error| error.into_failure(run.name()))?;
    if let Some((step, what)) = left_out.damaged().first() {
        let what = format!("load step {step} was damaged at once: failed to {what}");
        return Err(failed(RunError::State(what)));
    }
    let report = Report::new(
        curve.to_text(),
        &json!({
            "name": problem.name.as_str(),
            "state": run.standing.word(),
            "steps": run.last_index(),
            "digest": run.digest(),
            "rows": rows(&curve),
        }),
    );
    if let Some(file) = plot {
        let scene = test_picture::draw(problem.name.as_str(), element_test, &curve);
        if let Err(error) = file.write(&scene) {
            // The curve is what took the time: it is reported all the same.
            return Err(
                Failure::new(FailureKind::Run, "failed to draw the element test")
                    .because(error)
                    .with(report),
            );
        }
    }
    match end {
        SessionEnd::Completed => Ok(report),
        SessionEnd::Failed(why) => Err(Failure::new(
            FailureKind::Run,
            "failed to finish the element test",
        )
        .because(RunError::Model(why))
        .with(report)),
        SessionEnd::Interrupted(stop) => {
            Err(Failure::new(stop.kind(), "the element test was stopped").with(report))
        }
    }
}

/// The rows of a table, each under the names of its columns.
fn rows(table: &Table) -> Vec<Value> {
    let object = |row: &[f64]| {
        let named = table.columns().iter().zip(row);
        let fields: Map<String, Value> = named
            .map(|(column, value)| (column.name.clone(), json!(value)))
            .collect();
        Value::Object(fields)
    };
    table.rows().iter().map(|row| object(row)).collect()
}
