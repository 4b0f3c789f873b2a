//! Where runs are, from their event logs and files alone: it works while another process owns the store.

use std::{
    fmt::Write as _,
    time::{SystemTime, UNIX_EPOCH},
};

use serde_json::{Value, json};
use store::{FrameCount, StepIndex, WaveIndex};

use super::{
    Context,
    events::RunningStep,
    frames::ANSWER,
    list,
    open::explain,
    queue, text,
    view::{RunView, Standing, View},
};
use crate::{address::RunName, failure::Failure, report::Report};

/// Where `name` is, or every run of the store.
pub fn status(context: &Context<'_>, name: Option<&RunName>) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |d| d.as_secs_f64());
    if let Some(name) = name {
        let run = view.run(name)?;
        let (text, data) = describe(&view, &run, now);
        return Ok(Report::new(text, &data));
    }
    let mut all = Vec::new();
    for name in view.ids()? {
        all.push(
            view.read(&name)
                .map_err(|error| explain(&format!("read run `{name}`"), error))?,
        );
    }
    // Those that go on come last, where the eye is.
    all.sort_by_key(|run| run.standing.is_alive());
    let (texts, data): (Vec<String>, Vec<Value>) =
        all.iter().map(|run| describe(&view, run, now)).unzip();
    let (waiting, failed) = queue::counts(&context.store);
    let text = match texts.is_empty() {
        true => format!("No runs in {}.", context.store.display()),
        false => texts.concat(),
    };
    let mut text = text;
    if waiting + failed > 0 {
        let _ = write!(
            text,
            "\nQueue: {waiting} to be computed, {failed} failed; `femdem-flow queue` lists them"
        );
    }
    let queue = json!({ "open": waiting, "failed": failed });
    Ok(Report::new(text, &json!({ "runs": data, "queue": queue })))
}

fn describe(view: &View, run: &RunView, now: f64) -> (String, Value) {
    let place = &run.place;
    let (done, of) = run.increments();
    let running = run.standing.is_alive();
    let paused = place.pausing.filter(|_| running);
    let tasks_done = place.step.as_ref().map(|step| journalled(view, run, step));
    let left = place.remaining(now).filter(|_| running && paused.is_none());
    let data = json!({
        "name": run.name().as_str(),
        "state": run.standing.word(),
        "killed": run.standing == Standing::Killed,
        "note": run.record.note,
        "steps": run.last_index(),
        "done": done,
        "of": of,
        "pid": place.pid,
        "alive": running,
        "threads": place.threads,
        "paused_since": paused,
        "since": place.begun,
        "last_event": place.last,
        "remaining_s": left,
        "running_step": place.step.as_ref().map(|step| json!({
            "step": step.step,
            "increment": step.increment,
            "stage": step.stage,
            "iteration": step.wave.map(|wave| wave + 1),
            "residual": step.residual,
            "tasks": step.tasks,
            "tasks_done": tasks_done,
            "cuts": step.cuts,
            "since": step.since,
        })),
    });
    let mut text = format!(
        "Run `{}`: {}, {} of {} in {}\n",
        run.name(),
        run.standing.phrase(),
        list::increments(done),
        text::count(of as usize, "increment"),
        text::count(run.last_index() as usize, "load step")
    );
    if running {
        let pid = place
            .pid
            .map_or(String::new(), |pid| format!(" by process {pid}"));
        let _ = writeln!(
            text,
            "  computed{pid} since {} UTC, {} ago",
            text::utc(place.begun as u64),
            text::duration(now - place.begun)
        );
    }
    if let Some(since) = paused {
        let what = match place.still {
            true => "paused",
            false => "asked to pause; running tasks end first;",
        };
        let _ = writeln!(
            text,
            "  {what} since {} UTC, {} ago: `femdem-flow continue {}` lets it go on",
            text::utc(since as u64),
            text::duration(now - since),
            run.name()
        );
    }
    match (&place.packings, &place.step) {
        (_, Some(step)) if running || run.standing == Standing::Killed => {
            text.push_str(&describe_step(step, tasks_done.unwrap_or(0), now, running));
        }
        (Some((needed, there)), None) if running && there < needed => {
            let _ = writeln!(text, "  preparing packings: {there} of {needed}");
        }
        _ => {}
    }
    match left {
        Some(left) => {
            let _ = writeln!(
                text,
                "  about {} left at the pace of the last steps",
                text::duration(left)
            );
        }
        None if run.standing == Standing::Damaged => {
            let _ = writeln!(text, "  {}", run.way_out());
        }
        None if !running && run.standing != Standing::Completed => {
            if !run.record.note.is_empty() {
                let _ = writeln!(text, "  {}", run.record.note);
            }
            let _ = writeln!(text, "  `femdem-flow resume {}` goes on", run.name());
        }
        None => {}
    }
    (text, data)
}

fn describe_step(step: &RunningStep, tasks_done: u64, now: f64, running: bool) -> String {
    let verb = if running { "in" } else { "was in" };
    let mut text = format!(
        "  {verb} load step {} (increment {}, stage `{}`",
        step.step, step.increment, step.stage
    );
    if step.part != (0.0, 1.0) {
        let _ = write!(
            text,
            ", its part from {:.3} to {:.3}",
            step.part.0, step.part.1
        );
    }
    text.push(')');
    if running {
        let _ = write!(text, " for {}", text::duration(now - step.since));
    }
    if let Some(wave) = step.wave {
        let _ = write!(
            text,
            ": iteration {}, {tasks_done} of {} tasks done",
            wave + 1,
            step.tasks
        );
    }
    if let Some(residual) = step.residual {
        let _ = write!(text, ", residual {residual:.1e}");
    }
    if step.cuts > 0 {
        let _ = write!(text, ", {} cuts", step.cuts);
    }
    text.push('\n');
    text
}

/// Element tasks of the wave in progress whose answers are journalled.
fn journalled(view: &View, run: &RunView, step: &RunningStep) -> u64 {
    let Some(wave) = step.wave else { return 0 };
    let (step, wave) = (StepIndex(step.step), WaveIndex(wave));
    // A journal that cannot be read now was just committed or cut: the next look will tell.
    let mut count = FrameCount::default();
    let store = &view.store;
    let answers = store.count_frames(run.id(), step, wave, ANSWER, &mut count);
    answers / super::place::points_per_element(run) as u64
}
