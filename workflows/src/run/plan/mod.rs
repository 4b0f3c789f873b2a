//! What a verb would do: steps reused, steps to compute and why, time, disk. Nothing is written.

mod nearest;

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use store::Names;

use super::{
    Context, Wish,
    branch::{self, Planned},
    forecast::{self, Pace},
    list,
    manifest::Kind,
    notes,
    open::{explain, store_name},
    origin::{self, Origin},
    packings, text,
    triggers::{self, Trigger},
    view::{RunView, Standing, View},
};
use crate::{
    address::RunName,
    failure::Failure,
    input::{
        Problem,
        derive::{Change, Scope},
    },
    report::Report,
};

/// What is planned.
pub enum Intent {
    /// `submit`, perhaps under another name.
    Submit(Box<Problem>, Option<RunName>),
    /// `resume`.
    Resume(RunName),
    /// `branch` or `rerun`.
    Derive(Box<Wish>, Scope),
}

/// What would become of one run.
#[derive(Serialize)]
struct Forecast {
    /// Its name, as things stand.
    name: String,
    /// What would be done.
    verb: String,
    /// What is there already.
    reused: Reused,
    /// What makes it inhomogeneous; `None` where the question does not arise.
    triggers: Option<Vec<Trigger>>,
    /// Increments to compute, by stage.
    compute: Vec<Stage>,
    /// Increments to compute, a part of one included.
    increments: f64,
    /// Keys that changed.
    changes: Vec<Change>,
    /// Why there is something to compute, where it is not for the changes alone.
    because: Vec<String>,
    /// What would cost less.
    advice: Vec<String>,
    /// What is right by the letter and probably not meant, where the run is new.
    notes: Vec<String>,
    /// CPU seconds.
    cpu_s: Option<f64>,
    /// Wall seconds on the threads of this call.
    time_s: Option<f64>,
    /// Bytes.
    bytes: f64,
    /// What the three are judged by.
    judged_by: String,
}

#[derive(Default, Serialize)]
struct Reused {
    /// Load steps, step 0 included.
    steps: u64,
    /// Whose they are; the run itself where it is resumed.
    of: Option<String>,
    bytes: u64,
    cpu_s: f64,
    /// Packings needed and those in the cache, for a run from the beginning.
    packings: Option<(usize, usize)>,
}

#[derive(Serialize)]
struct Stage {
    stage: String,
    increments: f64,
}

/// Reports what `intent` would do.
pub fn plan(context: &Context<'_>, intent: &Intent) -> Result<Report, Failure> {
    let forecasts = match intent {
        Intent::Submit(problem, name) => vec![submit(context, problem, name.as_ref())?],
        Intent::Resume(run) => {
            let view = View::open(context)?;
            let run = view.run(run)?;
            vec![resume(context, &run)]
        }
        Intent::Derive(wish, scope) => derived(context, wish, *scope)?,
    };
    let free = store::free_space_at(&context.store).ok();
    let needed: f64 = forecasts.iter().map(|forecast| forecast.bytes).sum();
    let mut out = String::from("Plan, nothing is written:\n");
    for forecast in &forecasts {
        forecast.describe(context, &mut out);
    }
    let _ = writeln!(
        out,
        "Disk: about {} needed{}",
        text::bytes(needed as u64),
        free.map_or(String::new(), |free| format!(
            ", {} free",
            text::bytes(free)
        ))
    );
    if free.is_some_and(|free| needed > free as f64) {
        out.push_str(
            "      that is not enough: the run would stop in order when the disk is full\n",
        );
    }
    let data = json!({ "runs": forecasts, "bytes": needed, "free_bytes": free });
    Ok(Report::new(out, &data))
}

impl Forecast {
    /// A forecast of the rest of `problem` from where `done` increments are done.
    fn new(
        context: &Context<'_>,
        name: String,
        verb: String,
        problem: &Problem,
        done: f64,
        pace: &Pace,
    ) -> Self {
        let compute = remaining(problem, done);
        let increments = compute.iter().map(|stage| stage.increments).sum();
        let mut forecast = Self {
            name,
            verb,
            reused: Reused::default(),
            // A mesh that cannot be built is told where the packings are counted, or was told when the run began.
            triggers: triggers::triggers(problem).ok().flatten(),
            compute,
            increments,
            changes: Vec::new(),
            because: Vec::new(),
            advice: Vec::new(),
            notes: Vec::new(),
            cpu_s: None,
            time_s: None,
            bytes: 0.0,
            judged_by: pace.judged_by.clone(),
        };
        let cpu = pace.cpu_s.map(|cpu| cpu * increments);
        forecast.cost(context, cpu, increments * pace.bytes, pace.idling);
        forecast
    }

    fn cost(&mut self, context: &Context<'_>, cpu: Option<f64>, bytes: f64, idling: f64) {
        self.cpu_s = cpu;
        self.time_s = cpu.map(|cpu| cpu * idling / context.threads().get() as f64);
        self.bytes = bytes;
    }

    fn describe(&self, context: &Context<'_>, out: &mut String) {
        let _ = writeln!(out, "{} `{}`", self.verb, self.name);
        let reused = &self.reused;
        if let (Some(of), Some(last)) = (&reused.of, reused.steps.checked_sub(1)) {
            let _ = writeln!(
                out,
                "  reused    load steps 0 to {last} of `{of}`: {}, {} of CPU time",
                text::bytes(reused.bytes),
                text::duration(reused.cpu_s)
            );
        }
        if let Some((needed, cached)) = reused.packings {
            let _ = writeln!(out, "  packings  {cached} of {needed} are in the cache");
        }
        let mut label = "  trigger ";
        for line in triggers::in_lines(self.triggers.as_deref()) {
            let _ = writeln!(out, "{label}  {line}");
            label = "          ";
        }
        let mut label = "  note    ";
        for note in &self.notes {
            let _ = writeln!(out, "{label}  {note}");
            label = "          ";
        }
        let stages: Vec<String> = self
            .compute
            .iter()
            .map(|stage| format!("{} ({})", stage.stage, list::increments(stage.increments)))
            .collect();
        match stages.is_empty() {
            true => out.push_str("  computed  nothing: the programme is at its end\n"),
            false => {
                let _ = writeln!(
                    out,
                    "  computed  {} {}: {}",
                    list::increments(self.increments),
                    if self.increments == 1.0 {
                        "increment"
                    } else {
                        "increments"
                    },
                    stages.join(", ")
                );
            }
        }
        let mut label = "  because ";
        for reason in &self.because {
            let _ = writeln!(out, "{label}  {reason}");
            label = "          ";
        }
        for change in &self.changes {
            let _ = writeln!(out, "{label}  {}", in_words(change));
            label = "          ";
        }
        for advice in &self.advice {
            let _ = writeln!(out, "  instead   {advice}");
        }
        if self.increments > 0.0 {
            let time = match (self.time_s, self.cpu_s) {
                (Some(time), Some(cpu)) => format!(
                    "about {} on {} ({} of CPU time)",
                    text::duration(time),
                    text::count(context.threads().get(), "thread"),
                    text::duration(cpu)
                ),
                _ => "unknown".to_owned(),
            };
            let _ = writeln!(out, "  time      {time}");
            let _ = writeln!(
                out,
                "  disk      about {}, judged by {}",
                text::bytes(self.bytes as u64),
                self.judged_by
            );
        }
    }
}

fn in_words(change: &Change) -> String {
    format!(
        "{}: {} ({}) → {} ({})",
        change.key, change.from, change.from_place, change.to, change.to_place
    )
}

/// The increments of `problem` after the first `done`, by stage.
fn remaining(problem: &Problem, done: f64) -> Vec<Stage> {
    let programme = &problem.programme;
    let mut left = (done - programme.offset() as f64).max(0.0);
    let mut stages = Vec::new();
    for stage in &programme.stages {
        let length = stage.len() as f64;
        let behind = left.min(length);
        left -= behind;
        if behind < length {
            stages.push(Stage {
                stage: stage.name.clone(),
                increments: length - behind,
            });
        }
    }
    stages
}

fn resume(context: &Context<'_>, run: &RunView) -> Forecast {
    let problem = &run.manifest.problem;
    let (done, of) = run.increments();
    let pace = forecast::pace(run, u32::MAX).unwrap_or_else(|| forecast::pace_like(problem, &[]));
    let name = run.name().to_string();
    let mut plan = Forecast::new(context, name.clone(), "resume".into(), problem, done, &pace);
    plan.reused = reused(run, run.last_index(), name);
    if plan.increments > 0.0 {
        let reason = match run.standing {
            Standing::Running => "a process computes it at this moment".to_owned(),
            Standing::Prepared => "nothing of it is computed yet".to_owned(),
            standing => format!(
                "{} after {} of {}{}",
                standing.phrase(),
                list::increments(done),
                text::count(of as usize, "increment"),
                match run.record.note.as_str() {
                    "" => String::new(),
                    note => format!(": {note}"),
                }
            ),
        };
        plan.because.push(reason);
        if let Some(step) = run
            .place
            .step
            .as_ref()
            .filter(|s| s.step > run.last_index())
        {
            plan.because.push(format!(
                "load step {} is begun: the REV tasks in its journal are not computed again",
                step.step
            ));
        }
    }
    plan
}

/// The steps of `run` up to `last`.
fn reused(run: &RunView, last: u32, of: String) -> Reused {
    let steps = run.steps.iter().filter(|step| step.record.index.0 <= last);
    steps.fold(
        Reused {
            of: Some(of),
            ..Reused::default()
        },
        |sum, step| Reused {
            steps: sum.steps + 1,
            bytes: sum.bytes + step.record.bytes,
            cpu_s: sum.cpu_s + step.cpu_s(),
            ..sum
        },
    )
}

fn derived(context: &Context<'_>, wish: &Wish, scope: Scope) -> Result<Vec<Forecast>, Failure> {
    let view = View::open(context)?;
    let mut names = view.names()?;
    let origin = origin::origin(&view.store, &names, &wish.at)?;
    let planned = branch::planned(&origin, wish, scope, context.threads())?;
    let parent = view
        .read(&origin.parent.run)
        .map_err(|error| explain(&format!("read run `{}`", origin.called.run), error))?;
    Ok(planned
        .into_iter()
        .map(|planned| {
            let name = names.reserve(&planned.name).to_string();
            derived_one(context, &origin, &parent, planned, name)
        })
        .collect())
}

fn derived_one(
    context: &Context<'_>,
    origin: &Origin,
    parent: &RunView,
    planned: Planned,
    name: String,
) -> Forecast {
    let step = origin.parent.step.0;
    let problem = &planned.manifest.problem;
    let same_programme = *problem.programme.stages == parent.manifest.problem.programme.stages
        && problem.programme.past == parent.manifest.problem.programme.past;
    let at = parent.steps.iter().rfind(|s| s.record.index.0 <= step);
    let done = match same_programme {
        true => at.map_or(0.0, |step| step.reached()),
        false => problem.programme.offset() as f64,
    };
    let until = if same_programme { u32::MAX } else { step };
    let pace = forecast::pace(parent, until)
        .or_else(|| forecast::pace(parent, u32::MAX))
        .unwrap_or_else(|| forecast::pace_like(problem, &[]));
    let kind = planned
        .manifest
        .descent
        .as_ref()
        .map(|descent| descent.kind);
    let verb = match kind {
        Some(Kind::Branch) | None => format!("branch of {}:", origin.called),
        Some(Kind::Rerun) => format!("rerun of {}:", origin.called),
        Some(Kind::Seeded) => format!("new start from the states of {}:", origin.called),
    };
    let mut plan = Forecast::new(context, name, verb, problem, done, &pace);
    if same_programme {
        // The very increments are recorded, as far as the parent went.
        let (cpu, bytes, covered) = forecast::recorded(parent, step);
        let beyond = (plan.increments - covered).max(0.0);
        let cpu = pace.cpu_s.map(|each| cpu + each * beyond);
        plan.cost(context, cpu, bytes + pace.bytes * beyond, pace.idling);
        if covered > 0.0 {
            plan.judged_by = format!("the same increments of `{}`", parent.name());
        }
    }
    plan.reused = reused(parent, step, parent.name().to_string());
    plan.changes = planned
        .manifest
        .descent
        .map_or_else(Vec::new, |descent| descent.changes);
    if plan.changes.is_empty() {
        plan.because
            .push("nothing is changed: it will become what its parent became, bit for bit".into());
    }
    plan
}

fn submit(
    context: &Context<'_>,
    problem: &Problem,
    name: Option<&RunName>,
) -> Result<Forecast, Failure> {
    let wanted = store_name(name.unwrap_or(&problem.name))?;
    // A store that is not there yet has nothing to reuse.
    let view = match context.store.exists() {
        true => Some(View::open(context)?),
        false => None,
    };
    let mut runs = Vec::new();
    let mut names = Names::default();
    if let Some(view) = &view {
        names = view.names()?;
        for name in view.ids()? {
            // What cannot be read is no help here; `runs` names it.
            runs.extend(view.read(&name));
        }
    }
    let pace = forecast::pace_like(problem, &runs);
    let name = names.free(&wanted).to_string();
    let mut plan = Forecast::new(context, name, "submit".into(), problem, 0.0, &pace);
    let (needed, _) = packings::Plan::of_problem(problem)
        .map_err(|error| explain("set up the problem", error))?;
    let cached = |job| {
        view.as_ref()
            .is_some_and(|view| view.store.cache_get(&packings::cache_key(job)).is_some())
    };
    let there = needed.jobs.iter().filter(|job| cached(job)).count();
    plan.reused.packings = Some((needed.jobs.len(), there));
    plan.notes = notes::notes(problem).map_err(|error| explain("set up the problem", error))?;
    nearest::explain(&mut plan, problem, &runs);
    Ok(plan)
}
