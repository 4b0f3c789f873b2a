//! Packings made ahead of a run, into the cache that runs look into first.

use engine::{Director, GraphHandle, NodeId, PauseToken, TaskOutcome};
use serde_json::json;
use store::Store;

use super::{
    Context,
    error::RunError,
    open::{explain, open},
    packings::Plan,
    preparing::{Prepared, Preparing},
    session::{Conducted, conduct},
    shift::{Shift, Terms},
    text::{self, Align, Table},
    work::Job,
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
    let terms = Terms::default();
    let shift = Shift::begin(context, &terms)?;
    let ended = conduct(
        &mut preparer,
        &shift.equipment(&store),
        PauseToken::new(),
        None,
    );
    context.progress.finished();
    let explained = |error| explain("prepare the packings", error);
    if let Conducted::Stopped(stop) = ended.map_err(explained)? {
        let what = "the preparation was stopped; the packings that are ready are kept";
        return Err(Failure::new(stop.kind(), what).hint("the same command prepares the others"));
    }
    let Phase::Done { prepared, cached } = preparer.phase else {
        return Err(explained(RunError::Engine(
            "the graph ended before the packings".into(),
        )));
    };
    Ok(report(context, &names, &prepared, cached))
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
    prepared: &Prepared,
    cached: usize,
) -> Report {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("material", Left),
        ("no.", Right),
        ("grains", Right),
        ("void ratio", Right),
        ("z", Right),
        ("z*", Right),
        ("rattlers", Right),
        ("a_c", Right),
        ("direction", Right),
        ("μ prep.", Right),
        ("residual", Right),
        ("stress error", Right),
        ("densified", Right),
        ("cycles", Right),
        ("CPU s", Right),
    ]);
    let mut data = Vec::new();
    for (((material, number), packing), cpu) in
        names.iter().zip(&prepared.packings).zip(&prepared.cpu)
    {
        let rev = &packing.rev;
        let figures = solver_dem::anatomy(rev)
            .ok()
            .map(|anatomy| anatomy.statistics());
        let backbone = figures.and_then(|figures| figures.backbone_coordination);
        let fabric = figures.map(|figures| figures.contact_anisotropy);
        let mut cells = vec![
            material.clone(),
            number.to_string(),
            rev.grains.radii.len().to_string(),
            format!("{:.4}", rev.void_ratio()),
            format!("{:.3}", rev.coordination()),
            backbone.map_or_else(String::new, |z| format!("{z:.3}")),
            rev.rattlers().to_string(),
            fabric.map_or_else(String::new, |fabric| format!("{:.3}", fabric.amplitude)),
            fabric.map_or_else(String::new, |fabric| {
                format!("{:.0}°", fabric.direction.to_degrees())
            }),
        ];
        if let Some(quality) = &packing.quality {
            let friction = quality.preparation_friction;
            cells.extend([
                friction.map_or_else(String::new, |friction| format!("{friction:.3}")),
                format!("{:.1e}", quality.residual),
                format!("{:.1e}", quality.stress_error),
                quality.densifying_cycles.to_string(),
                quality.cycles.to_string(),
            ]);
        } else {
            cells.resize(cells.len() + 5, String::new());
        }
        cells.push(cpu.map_or_else(String::new, |cpu| format!("{:.2}", cpu.as_secs_f64())));
        table.row(cells);
        data.push(json!({
            "material": material,
            "number": number,
            "grains": rev.grains.radii.len(),
            "void_ratio": rev.void_ratio(),
            "coordination": rev.coordination(),
            "backbone_coordination": backbone,
            "rattlers": rev.rattlers(),
            "contact_anisotropy": fabric,
            "stress": packing.stress,
            "quality": packing.quality,
        }));
    }
    // Beside the packings, which are the same whenever they are made.
    let cpu: Vec<Option<f64>> = prepared
        .cpu
        .iter()
        .map(|cpu| cpu.map(|cpu| cpu.as_secs_f64()))
        .collect();
    let text = format!(
        "{} ready in {}, {cached} of them from before.\n{}\n\
         z* is the coordination without rattlers; a_c and direction are those of the contacts; \
         densified counts cycles of shear or compression.\n",
        text::count(prepared.packings.len(), "packing"),
        context.store.display(),
        table.render("  ")
    );
    Report::new(
        text,
        &json!({ "packings": data, "cached": cached, "cpu_s": cpu }),
    )
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
        prepared: Prepared,
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
                    let all = text::count(needed, "packing");
                    let note = format!("preparing {} of {all}", needed - cached);
                    self.progress.note(&note);
                }
                graph.add_join("packings", preparing.tasks())?;
                Phase::Preparing(preparing)
            }
            Phase::Preparing(preparing) => {
                let cached = preparing.cached();
                match preparing.finish()? {
                    Some(prepared) => Phase::Done { prepared, cached },
                    None => Phase::Over,
                }
            }
            over => over,
        };
        Ok(())
    }
}
