//! Packings made ahead of a run, into the cache that runs look into first.

use engine::{Director, GraphHandle, NodeId, TaskOutcome};
use serde_json::json;
use store::Store;

use super::{
    Context,
    error::RunError,
    open::{explain, open},
    packings::Plan,
    preparing::Preparing,
    session::{Conducted, conduct},
    text::{self, Align, Table},
    work::{Job, Packing},
};
use crate::{
    failure::{Failure, FailureKind},
    input::{
        Problem,
        problem::{Law, Material},
    },
    progress::Progress,
    report::Report,
};

/// Prepares the packings that `problem` needs, or those of its material `material` only.
pub fn prepare(
    context: &Context<'_>,
    problem: &Problem,
    material: Option<&str>,
) -> Result<Report, Failure> {
    let mut plan = Plan::of_problem(problem)
        .map_err(|error| explain("plan the packings", error))?
        .0;
    if let Some(name) = material {
        check_material(&plan, problem, name)?;
        plan.keep_only(name);
    }
    if plan.jobs.is_empty() {
        let text = "No packings are needed: no element has a material with grains.";
        return Ok(Report::new(text, &json!({ "packings": [] })));
    }
    let names = plan.names.clone();
    let store = open(context)?;
    let mut preparer = Preparer {
        store: &store,
        progress: context.progress,
        phase: Phase::Start(plan),
    };
    let ended = conduct(&mut preparer, context.threads(), context.progress);
    context.progress.finished();
    let explained = |error| explain("prepare the packings", error);
    if let Conducted::Stopped(signal) = ended.map_err(explained)? {
        let what = "the preparation was stopped; the packings that are ready are kept";
        return Err(Failure::new(FailureKind::of_signal(signal), what)
            .hint("the same command prepares the others"));
    }
    let Phase::Done { packings, cached } = preparer.phase else {
        return Err(explained(RunError::Engine(
            "the graph ended before the packings".into(),
        )));
    };
    Ok(report(context, &names, &packings, cached))
}

fn check_material(plan: &Plan, problem: &Problem, name: &str) -> Result<(), Failure> {
    if plan.names.iter().any(|(material, _)| material == name) {
        return Ok(());
    }
    let with_grains = |material: &&Material| matches!(material.law, Law::Rev(_));
    let names: Vec<String> = problem
        .materials
        .iter()
        .filter(with_grains)
        .map(|material| format!("`{}`", material.name))
        .collect();
    let known = problem
        .materials
        .iter()
        .find(|material| material.name == name);
    let why = match known.map(|material| &material.law) {
        None => "there is no such material",
        Some(Law::Elastic(_)) => "it has no grains",
        Some(Law::Rev(_)) => "no element has it",
    };
    let what = format!("failed to prepare packings of `{name}`: {why}");
    Err(Failure::new(FailureKind::Usage, what)
        .hint(format!("materials with grains: {}", names.join(", "))))
}

fn report(
    context: &Context<'_>,
    names: &[(String, u64)],
    packings: &[Packing],
    cached: usize,
) -> Report {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("material", Left),
        ("no.", Right),
        ("grains", Right),
        ("void ratio", Right),
        ("coordination", Right),
        ("rattlers", Right),
        ("residual", Right),
        ("stress error", Right),
        ("cycles", Right),
    ]);
    let mut data = Vec::new();
    for ((material, number), packing) in names.iter().zip(packings) {
        let rev = &packing.rev;
        let mut cells = vec![
            material.clone(),
            number.to_string(),
            rev.grains.radii.len().to_string(),
            format!("{:.4}", rev.void_ratio()),
            format!("{:.3}", rev.coordination()),
            rev.rattlers().to_string(),
        ];
        if let Some(quality) = &packing.quality {
            cells.extend([
                format!("{:.1e}", quality.residual),
                format!("{:.1e}", quality.stress_error),
                quality.cycles.to_string(),
            ]);
        }
        table.row(cells);
        data.push(json!({
            "material": material,
            "number": number,
            "grains": rev.grains.radii.len(),
            "void_ratio": rev.void_ratio(),
            "coordination": rev.coordination(),
            "rattlers": rev.rattlers(),
            "stress": packing.stress,
            "quality": packing.quality,
        }));
    }
    let text = format!(
        "{} ready in {}, {cached} of them from before.\n{}",
        text::count(packings.len(), "packing"),
        context.store.display(),
        table.render("  ")
    );
    Report::new(text, &json!({ "packings": data, "cached": cached }))
}

/// Directs a graph that does nothing but prepare.
struct Preparer<'a> {
    store: &'a Store,
    progress: &'a dyn Progress,
    phase: Phase,
}

enum Phase {
    Start(Plan),
    Preparing(Preparing),
    Done {
        packings: Vec<Packing>,
        cached: usize,
    },
    /// Cancelled.
    Over,
}

impl Director<Job> for Preparer<'_> {
    type Error = RunError;

    fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        _graph: &mut GraphHandle<Job>,
    ) -> Result<(), RunError> {
        if let Phase::Preparing(preparing) = &mut self.phase {
            preparing.take(id, outcome, self.store)?;
            self.progress.task_done();
        }
        Ok(())
    }

    fn join(&mut self, _id: NodeId, graph: &mut GraphHandle<Job>) -> Result<(), RunError> {
        self.phase = match std::mem::replace(&mut self.phase, Phase::Over) {
            Phase::Start(plan) => {
                let preparing = Preparing::begin(plan, self.store, graph)?;
                let (needed, cached) = (preparing.needed(), preparing.cached());
                if cached < needed {
                    let note = format!("preparing {} of {needed} packings", needed - cached);
                    self.progress.note(&note);
                }
                graph.add_join("packings", preparing.tasks())?;
                Phase::Preparing(preparing)
            }
            Phase::Preparing(preparing) => {
                let cached = preparing.cached();
                match preparing.finish()? {
                    Some((_, packings)) => Phase::Done { packings, cached },
                    None => Phase::Over,
                }
            }
            over => over,
        };
        Ok(())
    }
}
