//! The REVs of a step that are worth a look: most strained, least converged, slowest.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use solver_dem::anatomy;
use solver_fem::post;

use super::{
    Context,
    export::{BodyResults, ExportError},
    point::PointState,
    text::{Align, Table},
    view::{RunView, StepView, View},
};
use crate::{
    address::RunAddress,
    address::StepSelector,
    failure::{Failure, FailureKind},
    input::problem::Model as InputModel,
    report::Report,
};

/// One REV, or one elastic point.
#[derive(Clone, Serialize)]
struct Line {
    /// `e46.2`.
    rev: String,
    element: usize,
    /// √(⅔ e:e) of the logarithmic strain.
    shear_strain: f64,
    /// ln(v/v0), dilation positive.
    volume_strain: f64,
    /// q/p, as in the curves of element tests.
    stress_ratio: f64,
    void_ratio: Option<f64>,
    coordination: Option<f64>,
    /// Largest unbalanced force over the mean contact force.
    residual: Option<f64>,
    /// CPU seconds of the element in the step.
    cpu_s: f64,
}

/// Lists `count` REVs of each kind at the step of `address`, by default the last one.
///
/// # Errors
/// A step that is not there or cannot be read; an element test, which has one REV.
pub fn show_revs(
    context: &Context<'_>,
    address: &RunAddress,
    count: usize,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    let step = run.step(address.step.unwrap_or(StepSelector::Last))?;
    let lines = lines(&view, &run, step)?;
    let strained = ranked(&lines, count, |line| line.shear_strain);
    let unbalanced = ranked(&lines, count, |line| line.residual.unwrap_or(f64::NAN));
    // Cost is known for elements; of each, the REV that is furthest from rest stands for it.
    let worst = worst_of_elements(&lines);
    let slowest = ranked(&worst, count, |line| line.cpu_s);
    let (name, index) = (run.name(), step.record.index);
    let mut text = format!("Run `{name}`, load step {index}: REVs to look into\n");
    for (title, lines) in [
        ("most strained", &strained),
        ("least converged", &unbalanced),
        ("slowest (CPU time of the element)", &slowest),
    ] {
        let _ = write!(text, "\n{title}\n{}", table(lines).render("  "));
    }
    if let Some(first) = strained.first() {
        let _ = writeln!(
            text,
            "\n  `femdem-flow rev show {name}@{index}:{}` draws one",
            first.rev
        );
    }
    let data = json!({
        "run": name.as_str(),
        "step": index.0,
        "most_strained": strained,
        "least_converged": unbalanced,
        "slowest": slowest,
    });
    Ok(Report::new(text, &data))
}

fn lines(view: &View, run: &RunView, step: &StepView) -> Result<Vec<Line>, Failure> {
    let InputModel::Body(body) = &run.manifest.problem.model else {
        let what = format!(
            "failed to compare the REVs of run `{}`: an element test has one",
            run.name()
        );
        return Err(Failure::new(FailureKind::Usage, what));
    };
    let unreadable =
        |error: ExportError| error.explain(&format!("read {}@{}", run.name(), step.record.index));
    let results = BodyResults::open(view, run, body).map_err(unreadable)?;
    let state = results.state(step).map_err(unreadable)?;
    let points = results.points(step).map_err(unreadable)?;
    let cost = results.cost(step).map_err(unreadable)?;
    let problem = &results.model.problem;
    let gradients = post::deformation_gradients(problem, &state.coordinates);
    Ok(problem
        .gauss_points()
        .zip(&gradients)
        .zip(&points)
        .map(|((id, f), point)| {
            let (element, local) = problem.locate(id);
            let strain = post::logarithmic(f);
            let rev = match &**point {
                PointState::Rev(rev) => Some(rev),
                PointState::Elastic { .. } => None,
            };
            let s = state.stress_at(id);
            let half = 0.5 * (s[0][0] - s[1][1]);
            let shear = 0.5 * (s[0][1] + s[1][0]);
            Line {
                rev: format!("e{element}.{local}"),
                element,
                shear_strain: post::second_invariant(&strain),
                volume_strain: post::volumetric(&strain),
                stress_ratio: (half * half + shear * shear).sqrt() / (-0.5 * (s[0][0] + s[1][1])),
                void_ratio: rev.map(|rev| rev.void_ratio()),
                coordination: rev.map(|rev| rev.coordination()),
                residual: rev
                    .and_then(|rev| anatomy(rev).ok())
                    .map(|found| found.residual),
                cpu_s: cost[element],
            }
        })
        .collect())
}

/// The `count` lines with the greatest values, the first of equals first; those without a value are left out.
fn ranked(lines: &[Line], count: usize, value: impl Fn(&Line) -> f64) -> Vec<Line> {
    let mut order: Vec<&Line> = lines
        .iter()
        .filter(|line| value(line).is_finite())
        .collect();
    order.sort_by(|a, b| value(b).total_cmp(&value(a)));
    order.into_iter().take(count).cloned().collect()
}

fn worst_of_elements(lines: &[Line]) -> Vec<Line> {
    let residual = |line: &Line| line.residual.unwrap_or(-1.0);
    lines
        .chunk_by(|a, b| a.element == b.element)
        .filter_map(|points| {
            points.iter().reduce(|worst, line| {
                if residual(line) > residual(worst) {
                    line
                } else {
                    worst
                }
            })
        })
        .cloned()
        .collect()
}

fn table(lines: &[Line]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("REV", Left),
        ("shear strain", Right),
        ("volume strain", Right),
        ("q/p", Right),
        ("void ratio", Right),
        ("coordination", Right),
        ("residual", Right),
        ("CPU s", Right),
    ]);
    let optional = |value: Option<f64>, decimals: usize| {
        value.map_or_else(String::new, |value| format!("{value:.decimals$}"))
    };
    for line in lines {
        table.row([
            line.rev.clone(),
            format!("{:.4}", line.shear_strain),
            format!("{:+.4}", line.volume_strain),
            format!("{:.3}", line.stress_ratio),
            optional(line.void_ratio, 4),
            optional(line.coordination, 2),
            line.residual
                .map_or_else(String::new, |residual| format!("{residual:.1e}")),
            format!("{:.2}", line.cpu_s),
        ]);
    }
    table
}
