//! One committed step in detail.

use std::fmt::Write as _;

use serde_json::{Value, json};
use solver_fem::{boundary::Target, newton::MacroState, post};
use store::{FrameId, StepReader};

use super::{
    element_test::TestState,
    error::RunError,
    frames::{COST, MACRO, decode},
    list,
    model::Model,
    show::StepLine,
    summary::RevFigures,
    text::{self, Align, Table},
    view::{RunView, StepView, View},
};
use crate::{
    input::{
        plain::Plain,
        problem::{Body, Model as InputModel},
    },
    report::Report,
};

/// How many of the dearest elements are listed.
const DEAREST: usize = 10;

/// All that is known of a step.
pub fn report(view: &View, run: &RunView, step: &StepView) -> Result<Report, RunError> {
    let reader = view.store.step(run.id(), step.record.index)?;
    let sweeps: Vec<Value> = step
        .summary
        .sweeps
        .iter()
        .map(|sweep| json!(sweep))
        .collect();
    let mut data = json!(StepLine::new(step));
    data["run"] = json!(run.name().as_str());
    data["load_names"] = json!(run.manifest.problem.loads);
    data["sweeps"] = json!(sweeps);
    let mut out = heading(run, step);
    out.push_str(&sweep_table(step));
    match &run.manifest.problem.model {
        InputModel::Body(body) => {
            let dearest = dearest(&reader)?;
            let (model, state) = at(&reader, body, run.manifest.problem.loads.len())?;
            let forces = forces(&model, body, &state);
            if state.second_gradient.is_some() {
                let (text, figures) = tied(&model, &state);
                out.push_str(&text);
                data["second_gradient"] = figures;
            }
            out.push('\n');
            out.push_str(&force_table(&forces).render("  "));
            if !dearest.is_empty() {
                let list: Vec<String> = dearest
                    .iter()
                    .map(|(e, cpu)| format!("e{e} {cpu:.3} s"))
                    .collect();
                let _ = writeln!(out, "\n  dearest elements  {}", list.join(", "));
            }
            data["dearest_elements"] = dearest
                .iter()
                .map(|(element, cpu)| json!({ "element": element, "cpu_s": cpu }))
                .collect();
            data["forces"] = forces.iter().map(BoundaryForce::to_json).collect();
        }
        InputModel::ElementTest(_) => {
            let id = FrameId::new(MACRO, 0);
            let state: TestState = decode(id, &reader.frame(id)?)?;
            let ([a, b], [s, t]) = (state.gradient, state.stress);
            let _ = writeln!(
                out,
                "  F       {:+.6e} {:+.6e}\n          {:+.6e} {:+.6e}",
                a[0], a[1], b[0], b[1]
            );
            let _ = writeln!(
                out,
                "  stress  {:+.6e} {:+.6e}\n          {:+.6e} {:+.6e}",
                s[0], s[1], t[0], t[1]
            );
            data["gradient"] = json!(state.gradient);
            data["stress"] = json!(state.stress);
        }
    }
    Ok(Report::new(out, &data))
}

fn heading(run: &RunView, step: &StepView) -> String {
    let summary = &step.summary;
    let mut out = format!("Run `{}`, load step {}", run.name(), step.record.index);
    if summary.increment > 0 {
        let _ = write!(
            out,
            ": increment {} of {}",
            list::increments(step.reached()),
            run.increments().1
        );
    }
    if !summary.stage.is_empty() {
        let _ = write!(out, ", stage `{}`", summary.stage);
    }
    out.push('\n');
    if let Some(what) = super::show::damage(step) {
        let _ = writeln!(out, "  damaged: {what}");
    }
    for (name, value) in run.manifest.problem.loads.iter().zip(&summary.loads) {
        let _ = writeln!(out, "  load       {name} = {}", Plain(*value));
    }
    if let Some(digest) = step.record.digest {
        let _ = writeln!(
            out,
            "  digest     {digest}, {}",
            text::bytes(step.record.bytes)
        );
    }
    if summary.increment == 0 {
        return out;
    }
    let accepted = if summary.loosely_accepted {
        "loosely accepted"
    } else {
        "accepted"
    };
    let _ = write!(
        out,
        "  solution   {accepted} at residual {:.2e}",
        summary.residual
    );
    if !summary.sweeps.is_empty() {
        let _ = write!(
            out,
            " after {}",
            text::count(summary.sweeps.len(), "iteration")
        );
    }
    if summary.cuts > 0 {
        let _ = write!(out, " and {}", text::count(summary.cuts as usize, "cut"));
    }
    out.push('\n');
    let revs = &summary.revs;
    let _ = writeln!(
        out,
        "  REVs       {}, {}, worst residual {:.1e}; {} re-based, {} by path, {}",
        text::count(revs.solves as usize, "solve"),
        text::count(revs.cycles as usize, "cycle"),
        revs.worst_residual,
        revs.rebased,
        revs.path,
        text::count(revs.affine_tangents as usize, "affine tangent")
    );
    out.push_str(&without_equilibrium(revs));
    if !summary.ended.is_empty() {
        let _ = writeln!(out, "  stage      ended with this step: {}", summary.ended);
    }
    if summary.voids > 0 {
        let voids = text::count(summary.voids as usize, "Gauss point");
        let _ = writeln!(out, "  voids      {voids} whose grains do not touch");
    }
    out.push_str(&super::show::energy(&super::summary::Energy::of(summary)));
    let _ = writeln!(
        out,
        "  time       {:.2} CPU s in tasks, {:.2} s beside them, {:.2} s by the clock",
        summary.cpu_s, summary.director_s, summary.wall_s
    );
    out
}

/// What REVs did in iterations that no step may end with.
pub fn without_equilibrium(revs: &RevFigures) -> String {
    if revs.unsettled + revs.gave_way == 0 {
        return String::new();
    }
    format!(
        "             on the way {} did not come to rest, {} lost all contacts\n",
        revs.unsettled, revs.gave_way
    )
}

fn sweep_table(step: &StepView) -> String {
    use Align::{Left, Right};
    if step.summary.sweeps.is_empty() {
        return String::new();
    }
    let mut table = Table::new([
        ("iter.", Right),
        ("phase", Left),
        ("residual", Right),
        ("correction", Right),
        ("re-based", Right),
        ("provisional", Right),
        ("safeguarded", Right),
        ("linear residual", Right),
        ("mismatch of v", Right),
    ]);
    for sweep in &step.summary.sweeps {
        table.row([
            (sweep.wave + 1).to_string(),
            format!("{:?}", sweep.phase).to_lowercase(),
            format!("{:.2e}", sweep.residual),
            format!("{:.2e}", sweep.correction),
            sweep.rebased.to_string(),
            sweep.provisional.to_string(),
            sweep.safeguarded.to_string(),
            format!("{:.1e}", sweep.linear_residual),
            // Without a second gradient there is none, and an empty column is left out.
            sweep
                .mismatch
                .map_or_else(String::new, |m| format!("{m:.1e}")),
        ]);
    }
    format!("\n{}", table.render("  "))
}

/// The elements that cost most in this step, with their CPU seconds.
fn dearest(reader: &StepReader) -> Result<Vec<(usize, f64)>, RunError> {
    let id = FrameId::new(COST, 0);
    // The initial state cost nothing.
    if !reader.ids().contains(&id) {
        return Ok(Vec::new());
    }
    let cost: Vec<f64> = decode(id, &reader.frame(id)?)?;
    let mut order: Vec<(usize, f64)> = cost.into_iter().enumerate().collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    order.truncate(DEAREST);
    Ok(order)
}

/// What happens at one boundary or node set.
struct BoundaryForce {
    name: String,
    displacement: [f64; 2],
    force: [f64; 2],
}

impl BoundaryForce {
    fn to_json(&self) -> Value {
        json!({ "on": self.name, "mean_displacement": self.displacement, "support_force": self.force })
    }
}

/// The body and its macro state at a step.
fn at(reader: &StepReader, body: &Body, loads: usize) -> Result<(Model, MacroState<2>), RunError> {
    let id = FrameId::new(MACRO, 0);
    let state: MacroState<2> = decode(id, &reader.frame(id)?)?;
    let model = Model::new(body, loads)?;
    state
        .check(&model.problem)
        .map_err(|error| RunError::State(error.to_string()))?;
    Ok((model, state))
}

fn forces(model: &Model, body: &Body, state: &MacroState<2>) -> Vec<BoundaryForce> {
    super::export::places(model, body)
        .into_iter()
        .map(|(name, target)| at_boundary(model, name, &target, state))
        .collect()
}

/// How well a second gradient holds the elements together: a multiplier that is constant in an element leaves its
/// Gauss points free to part.
fn tied(model: &Model, state: &MacroState<2>) -> (String, Value) {
    let problem = &model.problem;
    let gradients = post::deformation_gradients(problem, &state.coordinates);
    let strain: Vec<f64> = gradients
        .iter()
        .map(|f| post::second_invariant(&post::logarithmic(f)))
        .collect();
    let mismatch = state
        .second_gradient
        .iter()
        .flat_map(|fields| &fields.mismatch);
    let mismatch = mismatch.copied().fold(0.0, f64::max);
    let mut text = format!(
        "\n  second gradient  grad u and v part by {mismatch:.1e} at most inside an element\n"
    );
    let Some(spread) = post::spread(problem, &strain) else {
        return (text, json!({ "mismatch": mismatch }));
    };
    let _ = writeln!(
        text,
        "                   shear strain: {:.1e} between Gauss points of an element, {:.1e} between neighbours; most in e{} ({:.1e})",
        spread.inside, spread.between, spread.worst, spread.worst_inside
    );
    let figures = json!({
        "mismatch": mismatch,
        "spread_inside": spread.inside,
        "spread_between": spread.between,
        "worst_element": spread.worst,
        "worst_inside": spread.worst_inside,
    });
    (text, figures)
}

fn at_boundary(
    model: &Model,
    name: String,
    target: &Target,
    state: &MacroState<2>,
) -> BoundaryForce {
    BoundaryForce {
        displacement: post::boundary_mean_displacement(&model.problem, target, &state.displacement),
        force: post::boundary_force(&model.problem, target, &state.reactions),
        name,
    }
}

fn force_table(forces: &[BoundaryForce]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("on", Left),
        ("mean displacement x", Right),
        ("y", Right),
        ("support force x", Right),
        ("y", Right),
    ]);
    for one in forces {
        let numbers = [one.displacement, one.force].into_iter().flatten();
        table.row(std::iter::once(one.name.clone()).chain(numbers.map(|x| format!("{x:.6e}"))));
    }
    table
}
