//! One REV alone, from what the store holds: `femdem-flow replay`.

mod files;
mod history;
mod kept;

use std::path::Path;

use serde_json::{Value, json};
use solver_dem::Report as SolverReport;
use store::{StepHealth, StepIndex};

use self::history::Milestone;
pub use self::kept::replay_kept;
use super::{
    Context, load,
    open::explain,
    place,
    recorded::{Agreement, RecordedStep, RepeatError, Repeated},
    text::{self, Align, Table},
    view::{RunView, View},
};
use crate::{
    address::RevAddress,
    failure::{Failure, FailureKind},
    output::WriteError,
    report::Report,
};

/// Asks one REV of a committed step again what it was asked last, and compares the answer with the stored one; with
/// `into`, writes the grains before and after into that folder.
///
/// # Errors
/// A REV that is not there or not recorded; and an answer of other bits, with the report.
pub fn replay(
    context: &Context<'_>,
    address: &RevAddress,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    let step = run.step(address.step)?;
    let name = format!("{}@{}:{}", run.name(), step.record.index, address.place);
    let dealt = load::dealt(&view.store, run.id())
        .map_err(|error| explain(&format!("repeat the REV {name}"), error))?;
    let point = place::gauss_point(&run, address.place, dealt.len()).map_err(|where_they_are| {
        Failure::new(
            FailureKind::Usage,
            format!("failed to repeat the REV {name}: it is not in the mesh"),
        )
        .hint(where_they_are)
    })?;
    let failed = |error| {
        let pruned = matches!(error, RepeatError::BasePruned);
        let failure = refused(&name, error);
        match pruned {
            true => failure.hint(kept_before(&run, step.record.index)),
            false => failure,
        }
    };
    let recorded = RecordedStep::open(&view, &run, step, &dealt).map_err(failed)?;
    let repeated = recorded.repeat(point).map_err(failed)?;
    let history = history::of(&repeated.question);
    let written = match into {
        Some(folder) => files::write(folder, &repeated.base, Some(&repeated.state))
            .map_err(|error| unwritten(&name, error))?,
        None => Vec::new(),
    };
    let report = describe(&name, &repeated, &history, &written);
    if let Some(folder) = into {
        files::write_report(folder, &report).map_err(|error| unwritten(&name, error))?;
    }
    match repeated.agreement {
        Agreement::SameBits => Ok(report),
        Agreement::Differs => Err(Failure::new(
            FailureKind::Run,
            format!("failed to repeat the REV {name} to the bit"),
        )
        .hint("`femdem-flow show RUN` names the machines and versions that computed the run")
        .with(report)),
    }
}

/// How a step is come by whose base was pruned.
fn kept_before(run: &RunView, step: StepIndex) -> String {
    let name = run.name();
    let kept = run
        .steps
        .iter()
        .rfind(|earlier| earlier.record.index < step && earlier.record.health == StepHealth::Sound);
    match kept.map(|kept| kept.record.index) {
        Some(kept) => format!(
            "the last load step before it that is kept is {kept}: `femdem-flow rerun {name}@{kept}` computes those from there on again, with the same bits, as a run whose REVs can be asked"
        ),
        None => format!("`femdem-flow show {name}` tells which load steps are kept"),
    }
}

/// A recorded task that cannot be carried out again, with the exit code of its kind.
pub fn refused(name: &str, error: RepeatError) -> Failure {
    let what = format!("failed to repeat the REV {name}");
    match error {
        RepeatError::Stored(error) => explain(&format!("repeat the REV {name}"), error),
        RepeatError::NoAnswer(_) => Failure::new(FailureKind::Run, what).because(error),
        RepeatError::Initial
        | RepeatError::NotRecorded
        | RepeatError::BasePruned
        | RepeatError::NoSuchPoint(_)
        | RepeatError::Elastic => Failure::new(FailureKind::Usage, what).because(error),
    }
}

fn unwritten(name: &str, error: WriteError) -> Failure {
    Failure::new(FailureKind::Run, format!("failed to write the REV {name}"))
        .because(error)
        .hint("`--output DIR` names the folder")
}

fn describe(name: &str, it: &Repeated, history: &[Milestone], written: &[String]) -> Report {
    let same = it.agreement == Agreement::SameBits;
    let waves = text::count(it.waves, "wave");
    let mut out = format!(
        "REV {name}: {} grains, asked again by {waves}\n",
        it.state.grains.radii.len()
    );
    out.push_str(&tensor_lines("F", &it.gradient));
    out.push_str(&tensor_lines("stress", &it.stress));
    out.push_str(&solver_line(&it.report));
    out.push_str(&format!(
        "  void ratio {:.6} → {:.6}, coordination {:.3} → {:.3}\n",
        it.base.void_ratio(),
        it.state.void_ratio(),
        it.base.coordination(),
        it.state.coordination()
    ));
    let verdict = if same {
        "  bits       state and stress are the stored ones to the last bit\n".to_owned()
    } else {
        format!(
            "  bits       NOT the stored ones: positions differ by up to {:.2e} mean diameters, the stress by {:.2e}\n",
            position_difference(it),
            stress_difference(it)
        )
    };
    out.push_str(&verdict);
    out.push_str(&history_table(history).render("  "));
    for file in written {
        out.push_str(&format!("  written    {file}\n"));
    }
    let data = json!({
        "rev": name,
        "grains": it.state.grains.radii.len(),
        "waves": it.waves,
        "gradient": it.gradient,
        "settings": it.question.settings(),
        "stress": it.stress,
        "stored_stress": it.recorded_stress,
        "report": it.report,
        "void_ratio": it.state.void_ratio(),
        "coordination": it.state.coordination(),
        "same_bits": same,
        "position_difference": position_difference(it),
        "stress_difference": stress_difference(it),
        "history": history,
        "files": written,
    });
    Report::new(out, &data)
}

fn tensor_lines(what: &str, t: &[[f64; 2]; 2]) -> String {
    format!(
        "  {what:<10} {:+.9e} {:+.9e}\n             {:+.9e} {:+.9e}\n",
        t[0][0], t[0][1], t[1][0], t[1][1]
    )
}

fn solver_line(report: &SolverReport) -> String {
    let method = match serde_json::to_value(report.method) {
        Ok(Value::String(word)) => word.replace('_', " "),
        _ => String::new(),
    };
    format!(
        "  solver     {method}, {} cycles, residual {:.2e}, drift {:.1e}; {} contacts, {} sliding\n",
        report.cycles, report.residual, report.drift, report.contacts, report.sliding
    )
}

fn history_table(history: &[Milestone]) -> Table {
    let mut table = Table::new([
        ("cycles", Align::Right),
        ("residual", Align::Right),
        ("drift", Align::Right),
    ]);
    for milestone in history {
        table.row([
            milestone.cycles.to_string(),
            format!("{:.2e}", milestone.residual),
            format!("{:.1e}", milestone.drift),
        ]);
    }
    table
}

/// Largest distance of a grain from where it is stored, over the mean diameter.
fn position_difference(it: &Repeated) -> f64 {
    let pairs = it.state.state.positions.iter().zip(&it.recorded.positions);
    let distances = pairs.map(|(a, b)| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt());
    distances.fold(0.0, f64::max) / it.state.grains.mean_diameter()
}

/// Largest difference of a component.
fn stress_difference(it: &Repeated) -> f64 {
    let pairs = it
        .stress
        .iter()
        .flatten()
        .zip(it.recorded_stress.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
