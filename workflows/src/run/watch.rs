//! Following a run live, from its event log and journal alone: whoever computes it is not disturbed.

use std::{
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::json;
use store::{FrameCount, RunName as Id, RunState, StepIndex, WaveIndex};

use super::{
    Context,
    events::{Event, Follower},
    frames::ANSWER,
    keeping::in_words,
    open::find,
    place::points_per_element,
    queue, text,
    view::{Standing, View},
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    progress::CommittedStep,
    report::Report,
};

/// How often the log is looked at.
const LOOK: Duration = Duration::from_millis(200);
/// How often it is made sure that the run is still computed.
const SURE: Duration = Duration::from_secs(1);
/// How long a supervisor may take to start a run again, beside the pause that it announced.
const REVIVAL: Duration = Duration::from_secs(30);

/// Follows `run`, or the one that is being computed, until its session ends; `tell` gets each event. Ends as the session
/// does.
pub fn watch(
    context: &Context<'_>,
    run: Option<&RunName>,
    tell: &mut dyn FnMut(&Event),
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let id = match run {
        Some(name) => waited_for(context, &view, name)?,
        None => computed(&view)?,
    };
    let mut log = Follower::from_start(&view.store.events_path(&id));
    let mut mirror = Mirror::new(context, &view, &id);
    let past = log.next();
    let begun = past.iter().rposition(|event| event.event == "session");
    let past = &past[begun.unwrap_or(0)..];
    past.iter().for_each(&mut *tell);
    mirror.catch_up(past);
    let mut ended = past
        .iter()
        .rev()
        .find(|event| event.event == "ended")
        .cloned();
    let mut sure = Instant::now();
    // When a run that died is given up.
    let mut patience: Option<Instant> = None;
    let end = loop {
        if let Some(ended) = ended.take() {
            break ended;
        }
        for event in log.next() {
            tell(&event);
            mirror.show(&event);
            match event.event.as_str() {
                "ended" => ended = Some(event),
                "restart" => {
                    let pause = event.data["pause_s"].as_f64().unwrap_or(0.0);
                    patience = Some(Instant::now() + REVIVAL + Duration::from_secs_f64(pause));
                }
                "session" => patience = None,
                _ => {}
            }
        }
        if ended.is_some() {
            continue;
        }
        if sure.elapsed() >= SURE {
            sure = Instant::now();
            mirror.count_tasks();
            match standing(context, &id)? {
                Standing::Running | Standing::Paused => patience = None,
                // Between two lives, or its end is about to be written.
                _ => {
                    let until = *patience.get_or_insert(Instant::now() + 3 * SURE);
                    if Instant::now() >= until {
                        context.progress.finished();
                        return gone(context, &id);
                    }
                }
            }
        }
        sleep(LOOK);
    };
    context.progress.finished();
    finished(context, &id, &end)
}

/// The run with this name; one that is queued is waited for.
fn waited_for(context: &Context<'_>, view: &View, name: &RunName) -> Result<Id, Failure> {
    let mut told = false;
    loop {
        let missing = match find(&view.names()?, name) {
            Ok(id) => return Ok(id),
            Err(missing) => missing,
        };
        if !queue::is_waiting(&context.store, name.as_str()) {
            // It may have been taken this very moment.
            return find(&view.names()?, name).map_err(|_| missing);
        }
        if !std::mem::replace(&mut told, true) {
            context
                .progress
                .note(&format!("run {name} is queued; waiting until it begins"));
        }
        sleep(SURE);
    }
}

/// The run that a process computes.
fn computed(view: &View) -> Result<Id, Failure> {
    for id in view.ids()? {
        if view.read(&id).is_ok_and(|run| run.standing.is_alive()) {
            return Ok(id);
        }
    }
    let what = "failed to find a run to watch: none is being computed";
    Err(Failure::new(FailureKind::Usage, what)
        .hint("`femdem-flow runs` lists the runs, `femdem-flow queue` what waits"))
}

fn standing(context: &Context<'_>, id: &Id) -> Result<Standing, Failure> {
    View::open(context)?
        .standing_of(id)
        .map_err(|error| super::explain(&format!("read run `{id}`"), error))
}

/// The report on a session that ended with a word.
fn finished(context: &Context<'_>, id: &Id, ended: &Event) -> Result<Report, Failure> {
    let called = called(context, id);
    let note = ended.data["note"].as_str().unwrap_or_default();
    let state = ended.data["state"]
        .as_str()
        .unwrap_or_default()
        .to_lowercase();
    let text = format!("Run `{called}` is {state}: {note}");
    let data = json!({ "name": called, "state": state, "note": note });
    let code = ended.data["code"].as_u64().unwrap_or(match state.as_str() {
        "completed" => 0,
        "failed" => 1,
        _ => 143,
    });
    match FailureKind::of_exit_code(code) {
        None => Ok(Report::new(text, &data)),
        Some(kind) => Err(Failure::new(kind, format!("run `{called}` is {state}"))
            .because(note)
            .hint(format!("`femdem-flow resume {called}` goes on"))
            .with(Report::new("", &data))),
    }
}

/// The report on a run that nobody computes and that has no last word.
fn gone(context: &Context<'_>, id: &Id) -> Result<Report, Failure> {
    let called = called(context, id);
    let what = match View::open(context)?
        .store
        .run(id)
        .map(|record| record.state)
    {
        Ok(RunState::Prepared) => format!("run `{called}` is not begun, and nobody computes it"),
        _ => format!("run `{called}` is gone without a word: the process that computed it died"),
    };
    Err(Failure::new(FailureKind::Run, what).hint(format!("`femdem-flow resume {called}` goes on")))
}

fn called(context: &Context<'_>, id: &Id) -> String {
    let names = View::open(context).and_then(|view| view.names());
    names.map_or_else(|_| id.to_string(), |names| names.shown(id).to_string())
}

/// Shows events as the process that logs them shows what it does.
struct Mirror<'a> {
    context: &'a Context<'a>,
    view: &'a View,
    id: &'a Id,
    /// Increments of the programme.
    of: u64,
    /// Step and wave that are out, and the tasks of it that are shown as done.
    wave: Option<(StepIndex, WaveIndex)>,
    count: FrameCount,
    shown: u64,
    /// Answers that a task gives.
    answers: u64,
}

impl<'a> Mirror<'a> {
    fn new(context: &'a Context<'a>, view: &'a View, id: &'a Id) -> Self {
        Self {
            context,
            view,
            id,
            of: 0,
            wave: None,
            count: FrameCount::default(),
            shown: 0,
            answers: view
                .read(id)
                .map_or(1, |run| points_per_element(&run) as u64)
                .max(1),
        }
    }

    /// Shows where the session has got to by now, without going through all that led there; of one that is over, how far
    /// it came.
    fn catch_up(&mut self, past: &[Event]) {
        let last = |wanted: &str| past.iter().rposition(|event| event.event == wanted);
        let Some(session) = past.first().filter(|event| event.event == "session") else {
            return;
        };
        let committed = last("step_committed");
        let mut session = session.clone();
        if let Some(at) = committed {
            session.data["done"] = past[at].data["summary"]["increment"].clone();
        }
        if past.iter().any(|event| event.event == "ended") {
            let whole = |key: &str| session.data[key].as_u64().unwrap_or(0);
            let of = text::count(whole("of") as usize, "increment");
            let called = called(self.context, self.id);
            let note = format!("run {called}: {} of {of} done", whole("done"));
            return self.context.progress.note(&note);
        }
        self.show(&session);
        let (step, wave) = (last("step_started"), last("wave_started"));
        let current = [step, wave, last("iteration")].into_iter().flatten();
        let mut current: Vec<usize> = current.filter(|at| Some(*at) > committed).collect();
        current.extend(last("preparing").filter(|_| committed.is_none() && step.is_none()));
        current.sort_unstable();
        for at in current {
            self.show(&past[at]);
        }
    }

    fn show(&mut self, event: &Event) {
        let progress = self.context.progress;
        let data = &event.data;
        let whole = |key: &str| data[key].as_u64().unwrap_or(0);
        match event.event.as_str() {
            "session" => {
                self.of = whole("of");
                let called = called(self.context, self.id);
                progress.run_started(&called, whole("done"), self.of);
            }
            "preparing" => {
                let (needed, cached) = (whole("packings"), whole("cached"));
                if cached < needed {
                    let all = text::count(needed as usize, "packing");
                    progress.note(&format!("preparing {} of {all}", needed - cached));
                }
            }
            "step_started" => {
                let stage = data["stage"].as_str().unwrap_or_default();
                progress.step_started(whole("increment"), whole("of"), stage);
            }
            "wave_started" => {
                let (step, wave) = (whole("step") as u32, whole("wave") as u32);
                progress.wave_started(wave + 1, whole("tasks"), whole("done"));
                self.wave = Some((StepIndex(step), WaveIndex(wave)));
                self.count = FrameCount::default();
                self.shown = whole("done");
            }
            "iteration" => {
                let sweep = &data["sweep"];
                let wave = sweep["wave"].as_u64().unwrap_or(0) as u32;
                progress.iteration(wave + 1, sweep["residual"].as_f64().unwrap_or(f64::NAN));
            }
            "step_cut" => {
                let reason = data["reason"].as_str().unwrap_or_default();
                progress.step_cut(data["factor"].as_f64().unwrap_or(f64::NAN), reason);
            }
            "step_committed" => self.committed(event),
            "packing_ready" | "ended" => {}
            _ => progress.note(&in_words(&event.event, data)),
        }
    }

    fn committed(&mut self, event: &Event) {
        self.wave = None;
        let summary = &event.data["summary"];
        let sweeps = summary["sweeps"].as_array().map_or(0, Vec::len);
        self.context.progress.step_committed(&CommittedStep {
            step: summary["increment"].as_u64().unwrap_or(0),
            of: self.of,
            // An element test has no sweeps to list.
            iterations: sweeps.max(1) as u32,
            residual: summary["residual"].as_f64().unwrap_or(f64::NAN),
            position: summary["position"].as_f64().unwrap_or(1.0),
            loosely_accepted: summary["loosely_accepted"] == true,
        });
    }

    /// Shows the tasks of the wave that have been journalled since the last look.
    fn count_tasks(&mut self) {
        let Some((step, wave)) = self.wave else {
            return;
        };
        let frames = self
            .view
            .store
            .count_frames(self.id, step, wave, ANSWER, &mut self.count);
        let done = frames / self.answers;
        while self.shown < done {
            self.context.progress.task_done();
            self.shown += 1;
        }
    }
}
