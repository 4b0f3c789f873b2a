//! The asking side: `cancel`, `pause` and `continue`, from any process that sees the store's folder.

use std::{
    path::PathBuf,
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use super::{
    Asker, Extent, Order, Urgency, attend,
    mailbox::{self, Request},
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    machine,
    report::Report,
    run::{
        Context,
        error::RunError,
        events::{Event, Follower},
        open::{explain, find},
        text,
        view::{RunView, Standing, View},
    },
};

/// How often an answer is looked for.
const LOOK: Duration = Duration::from_millis(100);

/// Asks the process that computes `run` to stop it, and waits for `patience` until it has.
pub fn cancel(
    context: &Context<'_>,
    run: &RunName,
    urgency: Urgency,
    extent: Extent,
    patience: Duration,
) -> Result<Report, Failure> {
    let mut talk = Talk::open(context, run, "cancel")?;
    talk.send(Order::Cancel(urgency, extent))?;
    let ended = talk.wait(patience, |event| {
        (event.event == "ended").then(|| event.data.clone())
    })?;
    let Some(data) = ended else {
        return Err(talk.unanswered(patience).hint(format!(
            "it stops as soon as its running tasks have ended; `femdem-flow cancel {run} --now` gives them up, `femdem-flow status {run}` tells where it is"
        )));
    };
    let word = |key: &str| data[key].as_str().unwrap_or_default().to_owned();
    let state = word("state").to_lowercase();
    let text = match state.as_str() {
        "interrupted" => {
            format!("Run `{run}` is stopped; `femdem-flow resume {run}` goes on where it was.")
        }
        // It was faster than the request.
        _ => format!("Run `{run}` had ended: {state}, {}", word("note")),
    };
    let data = json!({ "name": run.as_str(), "state": state, "note": word("note") });
    Ok(Report::new(text, &data))
}

/// Asks the process that computes `run` to start nothing new, and waits for `patience` until nothing runs.
pub fn pause(context: &Context<'_>, run: &RunName, patience: Duration) -> Result<Report, Failure> {
    let mut talk = Talk::open(context, run, "pause")?;
    let paused = |since: f64| {
        let text = format!(
            "Run `{run}` is paused; its process keeps the store. `femdem-flow continue {run}` lets it go on."
        );
        let data = json!({ "name": run.as_str(), "state": "paused", "since": since });
        Ok(Report::new(text, &data))
    };
    if let Some(since) = talk.run.place.pausing.filter(|_| talk.run.place.still) {
        return paused(since);
    }
    talk.send(Order::Pause)?;
    let answer = talk.wait(patience, |event| match event.event.as_str() {
        "paused" => Some(Ok(event.at)),
        "ended" => Some(Err(event.data.clone())),
        _ => None,
    })?;
    match answer {
        Some(Ok(at)) => paused(at),
        Some(Err(data)) => Err(talk.ended_instead(&data)),
        None => Err(talk.unanswered(patience).hint(format!(
            "it pauses as soon as its running tasks have ended; `femdem-flow status {run}` tells where it is"
        ))),
    }
}

/// Asks the process that computes `run` to go on after a pause, and waits for `patience` until it does.
pub fn go_on(context: &Context<'_>, run: &RunName, patience: Duration) -> Result<Report, Failure> {
    let mut talk = Talk::open(context, run, "continue")?;
    if talk.run.place.pausing.is_none() {
        let what = format!("failed to continue `{run}`: it is not paused");
        return Err(Failure::new(FailureKind::Usage, what)
            .hint(format!("`femdem-flow status {run}` tells where it is")));
    }
    talk.send(Order::Continue)?;
    let answer = talk.wait(patience, |event| match event.event.as_str() {
        "continued" => Some(Ok(event.data["paused_s"].as_f64().unwrap_or(0.0))),
        "ended" => Some(Err(event.data.clone())),
        _ => None,
    })?;
    match answer {
        Some(Ok(seconds)) => {
            let text = format!(
                "Run `{run}` goes on after a pause of {}.",
                text::duration(seconds)
            );
            let data = json!({ "name": run.as_str(), "state": "running", "paused_s": seconds });
            Ok(Report::new(text, &data))
        }
        Some(Err(data)) => Err(talk.ended_instead(&data)),
        None => Err(talk.unanswered(patience).hint(format!(
            "the process that computes it does not answer; `femdem-flow status {run}` tells whether it lives"
        ))),
    }
}

/// A request to a session and its answer, which is what the session logs.
struct Talk<'a> {
    context: &'a Context<'a>,
    name: RunName,
    verb: &'static str,
    run: RunView,
    session: String,
    log: Follower,
    folder: PathBuf,
    /// The request while nobody has taken it.
    file: PathBuf,
}

impl<'a> Talk<'a> {
    /// Finds the session that computes the run.
    fn open(context: &'a Context<'a>, name: &RunName, verb: &'static str) -> Result<Self, Failure> {
        let view = View::open(context)?;
        let id = find(&view.names()?, name)?;
        let events = view.store.events_path(&id);
        // From before the run is looked at, so that nothing can happen in between unseen.
        let log = Follower::from_end(&events);
        let run = view.run(name)?;
        if !may_be_computed(&run) {
            let what = format!(
                "failed to {verb} `{name}`: no process computes it, it is {}",
                run.standing.phrase()
            );
            let hint = match run.standing {
                Standing::Completed => format!("`femdem-flow show {name}` shows it"),
                _ => format!("`femdem-flow resume {name}` computes it"),
            };
            return Err(Failure::new(FailureKind::Usage, what).hint(hint));
        }
        let Some(session) = run.place.session.clone() else {
            let what = format!(
                "failed to {verb} `{name}`: a version of femdem-flow computes it that takes no requests"
            );
            let pid = run.place.pid.unwrap_or(0);
            return Err(Failure::new(FailureKind::Usage, what)
                .hint(format!("`kill {pid}` on its host stops it in order")));
        };
        Ok(Self {
            context,
            name: name.clone(),
            verb,
            run,
            session,
            log,
            folder: attend::folder(&events),
            file: PathBuf::new(),
        })
    }

    fn send(&mut self, order: Order) -> Result<(), Failure> {
        let request = Request {
            session: self.session.clone(),
            order,
            by: Asker::this(),
        };
        self.file = mailbox::send(&self.folder, &request).map_err(|error| {
            let path = self.folder.clone();
            explain("leave the request", RunError::File { path, error })
        })?;
        Ok(())
    }

    /// The first answer among the events of the session; `None` where none comes in time.
    ///
    /// # Errors
    /// The process died.
    fn wait<T>(
        &mut self,
        patience: Duration,
        answer: impl Fn(&Event) -> Option<T>,
    ) -> Result<Option<T>, Failure> {
        let begun = Instant::now();
        loop {
            if let Some(found) = self.log.next().iter().find_map(&answer) {
                return Ok(Some(found));
            }
            if begun.elapsed() >= patience {
                return Ok(None);
            }
            // Where it is gone, it may have answered in its last moment.
            let gone = View::open(self.context)
                .and_then(|view| view.run(&self.name))
                .is_ok_and(|run| {
                    let killed = run.standing == Standing::Killed && !may_be_computed(&run);
                    killed || run.place.session.as_ref() != Some(&self.session)
                });
            if gone {
                if let Some(found) = self.log.next().iter().find_map(&answer) {
                    return Ok(Some(found));
                }
                let _ = std::fs::remove_file(&self.file);
                let what = format!(
                    "failed to {} `{}`: the process that computed it is gone without a word",
                    self.verb, self.name
                );
                return Err(Failure::new(FailureKind::Run, what)
                    .hint(format!("`femdem-flow resume {}` goes on", self.name)));
            }
            sleep(LOOK);
        }
    }

    fn unanswered(&self, patience: Duration) -> Failure {
        let seen = match self.file.exists() {
            true => "nobody has taken the request, which stays for this session alone",
            false => "the request was taken",
        };
        Failure::new(
            FailureKind::Run,
            format!(
                "`{}` has not come to it within {}: {seen}",
                self.name,
                text::duration(patience.as_secs_f64())
            ),
        )
    }

    fn ended_instead(&self, data: &Value) -> Failure {
        let what = format!(
            "failed to {} `{}`: its session ended: {}",
            self.verb,
            self.name,
            data["note"].as_str().unwrap_or_default()
        );
        Failure::new(FailureKind::Usage, what)
    }
}

/// Whether a process computes the run, as far as can be seen from here: not every shared file system shows the locks of
/// other hosts, so that one of another host that never said it ended may still be at work.
fn may_be_computed(run: &RunView) -> bool {
    match run.standing {
        Standing::Running | Standing::Paused => true,
        Standing::Killed => {
            run.place.ended.is_none()
                && run
                    .place
                    .host
                    .as_ref()
                    .is_some_and(|host| *host != machine::host())
        }
        Standing::Prepared
        | Standing::Interrupted
        | Standing::Completed
        | Standing::Failed
        | Standing::Damaged => false,
    }
}
