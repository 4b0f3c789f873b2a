//! An element test whose run is not kept.

use serde_json::{Map, Value, json};
use store::Store;

use super::{
    Context,
    error::RunError,
    export::{LeftOut, test_curve},
    internal_length::{self, Softening},
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

/// What is wanted beside the curve.
#[derive(Debug, Clone, Default)]
pub struct Extras {
    /// A picture of it.
    pub plot: Option<PictureFile>,
    /// The width of a band with this second-gradient modulus.
    pub internal_length: Option<f64>,
}

/// Computes the element test of `problem` as `submit` would, in a store that is thrown away, and reports the curve that
/// `export` would write, with `extras`.
pub fn test(context: &Context<'_>, problem: &Problem, extras: &Extras) -> Result<Report, Failure> {
    let Model::ElementTest(element_test) = &problem.model else {
        let what = "failed to run the element test: the input describes a body";
        return Err(Failure::new(FailureKind::Usage, what).hint(
            "`femdem-flow submit` computes bodies; an `element_test` takes the place of `mesh`",
        ));
    };
    if let Some(modulus) = extras.internal_length {
        let refused = |why: String| Failure::new(FailureKind::Usage, why);
        if !(modulus > 0.0 && modulus.is_finite()) {
            return Err(refused(format!(
                "failed to measure the internal length: D must be positive, it is {modulus}"
            )));
        }
        internal_length::check(element_test)
            .map_err(|why| refused(format!("failed to measure the internal length: {why}")))?;
    }
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
        let run = {
            let manifest = session::described(problem.clone(), context.threads(), None);
            session::create(&store, name, None, &manifest).map_err(failed)?
        };
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
    let mut data = json!({
        "name": problem.name.as_str(),
        "state": run.standing.word(),
        "steps": run.last_index(),
        "digest": run.digest(),
        "rows": rows(&curve),
    });
    if let Some(modulus) = extras.internal_length {
        data["internal_length"] = band(context, &curve, modulus);
    }
    let report = Report::new(curve.to_text(), &data);
    if let Some(file) = &extras.plot {
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

/// Says how wide a band of the modulus is, in notes: the curve alone is the output.
fn band(context: &Context<'_>, curve: &Table, modulus: f64) -> Value {
    let column = |name: &str| {
        curve
            .columns()
            .iter()
            .position(|column| column.name == name)
    };
    let (Some(strain), Some(stress)) = (column("eyy"), column("syy")) else {
        return Value::Null;
    };
    let points: Vec<[f64; 2]> = curve
        .rows()
        .iter()
        .map(|row| [-row[strain], -row[stress]])
        .collect();
    let softening = match Softening::measure(&points) {
        Ok(softening) => softening,
        Err(why) => {
            context.progress.note(&format!("no internal length: {why}"));
            return Value::Null;
        }
    };
    let Softening {
        stiffness,
        slope,
        strains: [from, to],
    } = softening;
    let width = softening.width(modulus);
    context.progress.note(&format!(
        "softening slope H = {slope:.3} between axial strains {from:.4} and {to:.4}; E = {stiffness:.1} at the start"
    ));
    context.progress.note(&format!(
        "with D = {modulus} a band is about {width:.3} wide: 5 elements across it where they are {:.3} long, 3 where {:.3}",
        width / 5.0,
        width / 3.0
    ));
    let unit = softening.modulus(1.0);
    context
        .progress
        .note(&format!("for a band of width w choose D = {unit:.3} w²"));
    json!({
        "modulus": modulus,
        "width": width,
        "modulus_of_unit_width": unit,
        "softening": softening,
    })
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
