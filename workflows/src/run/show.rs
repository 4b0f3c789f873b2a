//! A run and its steps, in words and for machines.

use serde::Serialize;
use serde_json::{Value, json};
use solver_dem::{Means, Sizes};
use store::RunState;

use super::{
    Context,
    error::RunError,
    keeping, lineage, list, load,
    open::explain,
    show_step,
    summary::{Energy, RevFigures, StageEnd},
    text::{self, Align, Table},
    triggers::{self, Trigger},
    view::{RunView, Standing, StepView, View},
    work::Packing,
};
use crate::{
    address::RunAddress,
    failure::Failure,
    input::{
        self, Problem,
        problem::{Law, Material, Model, Origin, Preparation, Rev},
    },
    report::Report,
};

/// Shows what `address` means: a run, or one of its steps.
pub fn show(context: &Context<'_>, address: &RunAddress) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    match address.step {
        None => Ok(whole(context, &view, &run)),
        Some(selector) => {
            let step = run.step(selector)?;
            show_step::report(&view, &run, step).map_err(|error| {
                explain(&format!("read {}@{}", run.name(), step.record.index), error)
            })
        }
    }
}

/// One step as `--json` lists it.
#[derive(Serialize)]
pub struct StepLine {
    step: u32,
    increment: u64,
    stage: String,
    position: f64,
    loads: Vec<f64>,
    iterations: usize,
    residual: f64,
    residuals: Vec<f64>,
    loosely_accepted: bool,
    cuts: u32,
    revs: RevFigures,
    cpu_s: f64,
    director_s: f64,
    wall_s: f64,
    digest: Option<String>,
    bytes: u64,
    damage: Option<String>,
    pruned: bool,
    /// Why its stage ended with it before the last increment.
    ended: Option<String>,
    /// Work of the stresses on the strains of the step, over the body.
    work: f64,
    /// Work of the unbalanced forces between its iterates.
    released: f64,
    /// The part of that which the overdamped motion did.
    damped: f64,
    /// Gauss points whose grains do not touch.
    voids: u32,
}

impl StepLine {
    /// The figures of a step.
    pub fn new(step: &StepView) -> Self {
        let (record, summary) = (&step.record, &step.summary);
        Self {
            step: record.index.0,
            increment: summary.increment,
            stage: summary.stage.clone(),
            position: summary.position,
            loads: summary.loads.clone(),
            iterations: summary.sweeps.len(),
            residual: summary.residual,
            residuals: summary.sweeps.iter().map(|sweep| sweep.residual).collect(),
            loosely_accepted: summary.loosely_accepted,
            cuts: summary.cuts,
            revs: summary.revs,
            cpu_s: step.cpu_s(),
            director_s: summary.director_s,
            wall_s: summary.wall_s,
            digest: record.digest.map(|digest| digest.to_string()),
            bytes: record.bytes,
            damage: damage(step),
            pruned: record.health == store::StepHealth::Pruned,
            ended: Some(summary.ended.clone()).filter(|ended| !ended.is_empty()),
            work: summary.work,
            released: summary.released,
            damped: summary.damped,
            voids: summary.voids,
        }
    }
}

/// What is wrong with a step.
pub fn damage(step: &StepView) -> Option<String> {
    match &step.record.health {
        store::StepHealth::Sound => None,
        store::StepHealth::Damaged(what) => Some(what.clone()),
        store::StepHealth::Missing => Some("its pack is gone".to_owned()),
        store::StepHealth::Pruned => None,
    }
}

fn whole(context: &Context<'_>, view: &View, run: &RunView) -> Report {
    let packings = load::packings(&view.store, run.id()).map(|(packings, _)| packings);
    let triggers = triggers::triggers(&run.manifest.problem);
    let mut data = data(view, run, packings.as_ref().ok());
    data["triggers"] = json!(triggers.as_ref().ok());
    (data["descent"], data["children"]) = lineage::data(view, run);
    let mut out = heading(context, run);
    out.push_str(&lineage::in_words(view, run));
    out.push_str(&facts(run, &packings, &triggers));
    out.push('\n');
    out.push_str(&steps(run));
    out.push_str(&costs(run));
    Report::new(out, &data)
}

fn data(view: &View, run: &RunView, packings: Option<&Vec<Packing>>) -> Value {
    let problem = &run.manifest.problem;
    let (done, of) = run.increments();
    let lines: Vec<StepLine> = run.steps.iter().map(StepLine::new).collect();
    let prepared: Vec<_> = packings
        .into_iter()
        .flatten()
        .map(describe_packing)
        .collect();
    json!({
        "name": run.name().as_str(),
        "state": run.standing.word(),
        "killed": run.standing == Standing::Killed,
        "note": run.record.note,
        "born_as": run.id().as_str(),
        "parent": run.record.parent.as_ref().map(|parent| view.shown(parent).to_string()),
        "created": run.record.created,
        "steps": run.last_index(),
        "done": done,
        "of": of,
        "digest": run.digest(),
        "damaged": run.damaged(),
        "cpu_s": run.cpu_s(),
        "wall_s": run.steps.iter().map(|step| step.summary.wall_s).sum::<f64>(),
        "bytes": run.bytes(),
        "version": run.manifest.version,
        "threads": run.manifest.threads,
        "cpu": run.manifest.cpu,
        "processor": run.manifest.processor,
        "linear_algebra": run.manifest.linear_algebra,
        "machines": run.place.machines,
        "elements": mesh(problem).map(input::Mesh::element_count),
        "element": mesh(problem).map(input::Mesh::element),
        "gauss_points": mesh(problem).map(input::Mesh::point_count),
        "loads": problem.loads,
        "stages_ended": stage_ends(run).collect::<Vec<_>>(),
        "packings": prepared,
        "per_step": lines,
    })
}

fn describe_packing(packing: &Packing) -> Value {
    json!({
        "grains": packing.rev.grains.radii.len(),
        "void_ratio": packing.rev.void_ratio(),
        "coordination": packing.rev.coordination(),
        "rattlers": packing.rev.rattlers(),
        "stress": packing.stress,
        "quality": packing.quality,
    })
}

fn mesh(problem: &Problem) -> Option<&input::Mesh> {
    match &problem.model {
        Model::Body(body) => Some(&body.mesh),
        Model::ElementTest(_) => None,
    }
}

fn heading(context: &Context<'_>, run: &RunView) -> String {
    let (done, of) = run.increments();
    let mut text = format!(
        "Run `{}`: {}, {}, {} of {}, {} of CPU time, {} in {}\n",
        run.name(),
        run.standing.phrase(),
        text::count(run.last_index() as usize, "load step"),
        list::increments(done),
        text::count(of as usize, "increment"),
        text::duration(run.cpu_s()),
        text::bytes(run.bytes()),
        context.store.display(),
    );
    // A complete run's note says what its state does.
    if !run.record.note.is_empty() && run.record.state != RunState::Completed {
        text.push_str(&format!("  {}\n", run.record.note));
    }
    if let Some(digest) = run.digest() {
        text.push_str(&format!("  digest     {digest}\n"));
    }
    let damaged = run.damaged();
    if !damaged.is_empty() {
        let steps = keeping::ranges(&damaged);
        text.push_str(&format!(
            "  damaged    load steps {steps}: `femdem-flow store check` has more on this\n"
        ));
    }
    if run.standing == Standing::Damaged {
        text.push_str(&format!("             {}\n", run.way_out()));
    }
    text
}

/// What the input says, and what it became.
fn facts(
    run: &RunView,
    packings: &Result<Vec<Packing>, RunError>,
    triggers: &Result<Option<Vec<Trigger>>, RunError>,
) -> String {
    let (manifest, problem) = (&run.manifest, &run.manifest.problem);
    let mut text = format!(
        "  created    {} UTC, version {}, {}, {}\n",
        text::utc(run.record.created),
        manifest.version,
        text::count(manifest.threads, "thread"),
        manifest.cpu.join(" "),
    );
    text.push_str(&machines(run));
    match &problem.model {
        Model::Body(body) => {
            let mesh = &body.mesh;
            text.push_str(&format!(
                "  body       {}: {}, {}\n",
                shape(mesh),
                text::count(
                    mesh.element_count() as usize,
                    &format!("{} element", mesh.element().in_words())
                ),
                text::count(mesh.point_count() as usize, "Gauss point"),
            ));
        }
        Model::ElementTest(test) => {
            let material = problem
                .materials
                .get(test.material)
                .map_or("?", |m| m.name.as_str());
            text.push_str(&format!("  test       one REV of `{material}`\n"));
        }
    }
    for material in &problem.materials {
        text.push_str(&format!("  material   {}\n", describe_material(material)));
    }
    let lines = match triggers {
        Ok(triggers) => triggers::in_lines(triggers.as_deref()),
        Err(error) => vec![format!("cannot be told: failed to {error}")],
    };
    for line in lines {
        text.push_str(&format!("  trigger    {line}\n"));
    }
    match packings {
        Ok(packings) => {
            for (number, packing) in packings.iter().take(MOST_PACKINGS).enumerate() {
                let residual = packing.quality.map_or(String::new(), |quality| {
                    format!(", residual {:.1e}", quality.residual)
                });
                text.push_str(&format!(
                    "  packing {number:<2} {} grains, void ratio {:.4}, coordination {:.2}, {}{residual}\n",
                    packing.rev.grains.radii.len(),
                    packing.rev.void_ratio(),
                    packing.rev.coordination(),
                    text::count(packing.rev.rattlers(), "rattler"),
                ));
            }
            if packings.len() > MOST_PACKINGS {
                text.push_str(&format!(
                    "             … {} packings in all\n",
                    packings.len()
                ));
            }
        }
        // A run that was stopped while it prepared has none yet.
        Err(_) if run.steps.is_empty() => {}
        Err(error) => text.push_str(&format!("  packings   cannot be read: failed to {error}\n")),
    }
    let programme = &problem.programme;
    let past = programme.past.iter();
    let past = past.map(|stage| format!("{} ({} done before)", stage.name, stage.increments));
    let own = programme.stages.iter();
    let own = own.map(|stage| input::derive::stage_in_words(stage, &problem.loads));
    let stages: Vec<String> = past.chain(own).collect();
    text.push_str(&format!("  programme  {}\n", stages.join(", ")));
    text
}

/// What has computed the run: the machine it was created on, and those that other sessions ran on.
fn machines(run: &RunView) -> String {
    let manifest = &run.manifest;
    let mut text = String::new();
    if !manifest.processor.is_empty() {
        text.push_str(&format!(
            "  machine    {}, {}\n",
            manifest.processor, manifest.linear_algebra
        ));
    }
    let first = manifest.machine();
    let others = run.place.machines.iter();
    for other in others.filter(|machine| **machine != first) {
        text.push_str(&format!(
            "  also on    {}, version {}, {}, {}\n",
            other.processor,
            other.version,
            other.features.join(" "),
            other.linear_algebra
        ));
    }
    text
}

/// The most packings that are listed for people.
const MOST_PACKINGS: usize = 4;

fn shape(mesh: &input::Mesh) -> String {
    match mesh {
        input::Mesh::Rectangle(r) => format!("rectangle {} × {}", r.size[0], r.size[1]),
        input::Mesh::Annulus(a) => {
            let part = format!("{:?}", a.sector).to_lowercase();
            format!(
                "{part} annulus, radii {} and {}",
                a.inner_radius, a.outer_radius
            )
        }
        input::Mesh::Imported(mesh) => format!("mesh of {}", mesh.file),
    }
}

fn describe_material(material: &Material) -> String {
    let law = match &material.law {
        Law::Rev(rev) => describe_rev(rev),
        Law::Elastic(e) => format!(
            "elastic, E = {}, ν = {}, initial stress {}",
            e.young, e.poisson, e.initial_stress
        ),
    };
    format!("{}: {law}", material.name)
}

fn describe_preparation(preparation: &Preparation) -> String {
    let grading = match &preparation.sizes {
        Sizes::Uniform { .. } => "",
        Sizes::LogNormal { .. } => " (log-normal)",
        Sizes::Table { .. } => " (grading curve)",
    };
    let mut text = format!(
        "{} grains, Rmax/Rmin = {}{grading}, ",
        preparation.grains,
        preparation.sizes.ratio()
    );
    text += &match &preparation.target {
        None => format!("prepared with μ = {}", preparation.friction),
        Some(target) => {
            let means = match target.by {
                Means::Friction => "the friction of the preparation".to_owned(),
                Means::ShearCycles { .. } => {
                    format!("cycles of shear from μ = {}", preparation.friction)
                }
                Means::CompressionCycles { .. } => {
                    format!("cycles of compression from μ = {}", preparation.friction)
                }
            };
            format!("{} {} by {means}", target.quantity, target.value)
        }
    };
    if preparation.aspect_ratio != 1.0 {
        text += &format!(", cell {} : 1", preparation.aspect_ratio);
    }
    if let Some(anisotropy) = preparation.anisotropy {
        text += &format!(
            ", pressed {} : 1 along {:.0}°",
            anisotropy.stress_ratio,
            anisotropy.direction.to_degrees()
        );
    }
    if preparation.orientation != 0.0 {
        text += &format!(", turned by {:.0}°", preparation.orientation.to_degrees());
    }
    text
}

fn describe_rev(rev: &Rev) -> String {
    let origin = match &rev.origin {
        Origin::Prepared(preparation) => {
            format!("{}, seed {}", describe_preparation(preparation), rev.seed)
        }
        Origin::Imported(path) => format!("packing {path}"),
    };
    let scatter = match rev.friction_scatter {
        0.0 => String::new(),
        scatter => format!(" ± {}", triggers::percent(scatter)),
    };
    format!(
        "{origin}, σ0 = {}, kn/σ0 = {}, kt/kn = {}, μ = {}{scatter}, f_c/(a σ0) = {}",
        rev.confining_stress,
        rev.stiffness,
        rev.tangential_stiffness,
        rev.friction,
        rev.cohesion_ratio
    )
}

fn steps(run: &RunView) -> String {
    use Align::{Left, Right};
    let mut table = Table::new([
        ("step", Right),
        ("increment", Right),
        ("stage", Left),
        ("loads", Left),
        ("iter.", Right),
        ("residual", Right),
        ("", Left),
        ("cuts", Right),
        ("REV solves", Right),
        ("cycles/solve", Right),
        ("fallbacks", Right),
        ("CPU s", Right),
        ("wall s", Right),
    ]);
    let names = &run.manifest.problem.loads;
    for step in run.steps.iter() {
        let summary = &step.summary;
        let loads: Vec<String> = names
            .iter()
            .zip(&summary.loads)
            .map(|(name, value)| format!("{name} {value:.5}"))
            .collect();
        let revs = &summary.revs;
        let fallbacks = revs.rebased + revs.path;
        let per_solve = revs.cycles as f64 / revs.solves.max(1) as f64;
        let mark = match damage(step) {
            Some(what) => format!("damaged: {what}"),
            None if step.record.health == store::StepHealth::Pruned => "pruned".to_owned(),
            None if summary.loosely_accepted => "loose".to_owned(),
            None if summary.voids > 0 => text::count(summary.voids as usize, "void"),
            None => String::new(),
        };
        let nonzero = |count: u64, text: String| if count == 0 { String::new() } else { text };
        table.row([
            step.record.index.to_string(),
            list::increments(step.reached()),
            summary.stage.clone(),
            loads.join(", "),
            nonzero(
                summary.sweeps.len() as u64,
                summary.sweeps.len().to_string(),
            ),
            nonzero(summary.increment, format!("{:.1e}", summary.residual)),
            mark,
            nonzero(u64::from(summary.cuts), summary.cuts.to_string()),
            nonzero(revs.solves, revs.solves.to_string()),
            nonzero(revs.solves, format!("{per_solve:.0}")),
            nonzero(fallbacks, fallbacks.to_string()),
            nonzero(summary.increment, format!("{:.2}", step.cpu_s())),
            nonzero(summary.increment, format!("{:.2}", summary.wall_s)),
        ]);
    }
    if run.steps.is_empty() {
        return "  no load step is committed yet\n".to_owned();
    }
    let mut text = table.render("  ");
    for end in stage_ends(run) {
        text.push_str(&format!("  {end}\n"));
    }
    if run.steps.iter().any(|step| step.summary.loosely_accepted) {
        let solver = &run.manifest.problem.solver;
        text.push_str(&format!(
            "  loose: no iterate met the force tolerance {:e}; the best one, below {:e}, was taken\n",
            solver.force_tolerance, solver.loosest_force_tolerance
        ));
    }
    text
}

/// The stages that ended before their last increment.
fn stage_ends(run: &RunView) -> impl Iterator<Item = StageEnd> {
    let steps = run.steps.iter();
    steps.filter_map(|step| StageEnd::of(step.record.index.0, &step.summary))
}

/// The line about the work done on a body.
pub fn energy(energy: &Energy) -> String {
    let Energy {
        work,
        exchanged,
        released,
        damped,
    } = *energy;
    if exchanged == 0.0 {
        return String::new();
    }
    let share = |part: f64| 100.0 * part / exchanged;
    format!(
        "  energy     {work:.4e} put into the body; unbalanced forces did {:.2} % of the work exchanged, {:.2} % in overdamped motion\n",
        share(released),
        share(damped),
    )
}

/// Where the time went.
fn costs(run: &RunView) -> String {
    let mut revs = RevFigures::default();
    let (mut tasks, mut director) = (0.0, 0.0);
    for step in &run.steps {
        revs = revs.plus(&step.summary.revs);
        tasks += step.summary.cpu_s;
        director += step.summary.director_s;
    }
    if tasks + director <= 0.0 {
        return String::new();
    }
    let mut text = String::new();
    if revs.solves > 0 {
        let per_solve = |total: f64| total / revs.solves as f64;
        text.push_str(&format!(
            "\n  REVs       {}, {:.2} ms and {:.0} cycles each, worst residual {:.1e}; {} re-based, {} by path, {}\n",
            text::count(revs.solves as usize, "solve"),
            1e3 * per_solve(tasks),
            per_solve(revs.cycles as f64),
            revs.worst_residual,
            revs.rebased,
            revs.path,
            text::count(revs.affine_tangents as usize, "affine tangent"),
        ));
        text.push_str(&show_step::without_equilibrium(&revs));
    }
    text.push_str(&format!(
        "  time       {} in tasks, {} ({:.1} %) in assembly, linear solves and store\n",
        text::duration(tasks),
        text::duration(director),
        100.0 * director / (tasks + director)
    ));
    let steps = run.steps.iter().map(|step| Energy::of(&step.summary));
    text.push_str(&energy(&steps.fold(Energy::default(), Energy::plus)));
    text
}
