//! What a session has come to: what was computed, where it is, what to type next.

use serde_json::json;
use store::{RunName, Store};

use super::{
    Context,
    control::Stop,
    error::RunError,
    open::explain,
    session::SessionEnd,
    summary::{StageEnd, StepSummary},
    text,
};
use crate::{
    failure::{Failure, FailureKind},
    report::Report,
};

/// The end of a session: what was computed, where it is, what to type next.
pub fn ended(
    context: &Context<'_>,
    store: &Store,
    run: &RunName,
    end: &SessionEnd,
) -> Result<Report, Failure> {
    let steps = store
        .steps(run)
        .map_err(|error| explain("read the run", error.into()))?;
    let record = store
        .run(run)
        .map_err(|error| explain("read the run", error.into()))?;
    // It may have been renamed while it was computed.
    let run = record.shown();
    let last = steps.last();
    let step = last.map_or(0, |step| step.index.0);
    let digest = last
        .and_then(|step| step.digest)
        .map(|digest| digest.to_string());
    let summaries: Vec<(u32, StepSummary)> = steps
        .iter()
        .filter_map(|step| Some((step.index.0, rmp_serde::from_slice(&step.summary).ok()?)))
        .collect();
    let cpu: f64 = summaries.iter().map(|(_, s)| s.cpu_s + s.director_s).sum();
    let stages: Vec<StageEnd> = summaries
        .iter()
        .filter_map(|(step, summary)| StageEnd::of(*step, summary))
        .collect();
    let place = context.store.display();
    let data = |state: &str| json!({ "name": run.as_str(), "state": state, "steps": step, "digest": digest, "cpu_s": cpu, "stages_ended": stages });
    let next = format!(
        "Next:  femdem-flow show {run}      what was computed, step by step\n       femdem-flow export {run}    curves (CSV) and fields (VTU, PVD) for ParaView"
    );
    match end {
        SessionEnd::Completed => {
            let steps = text::count(step as usize, "load step");
            let early: String = stages.iter().map(|end| format!("  {end}\n")).collect();
            let text = format!(
                "Run `{run}` is complete: {steps}, {cpu:.0} CPU s, in {place}.\n{early}{}{next}",
                digest.as_ref().map_or(String::new(), |digest| format!("Digest of the last one: {digest}\n"))
            );
            Ok(Report::new(text, &data("completed")))
        }
        SessionEnd::Failed(why) => Err(Failure::new(
            FailureKind::Run,
            format!("run `{run}` ended at load step {step}, which is committed"),
        )
        .because(RunError::Model(why.clone()))
        .hint(format!(
            "`femdem-flow show {run}` and `femdem-flow export {run}` show what was reached; `femdem-flow resume {run}` tries the step again"
        ))
        .with(Report::new("", &data("failed")))),
        SessionEnd::Interrupted(stop) => Err(Failure::new(
            stop.kind(),
            match stop {
                Stop::Signal(_) => format!("run `{run}` was stopped after load step {step}"),
                other => format!("run `{run}` was {} after load step {step}", other.in_words()),
            },
        )
        .hint(format!(
            "`femdem-flow resume {run}` goes on from there, inside the step that was running"
        ))
        .with(Report::new("", &data("interrupted")))),
    }
}
