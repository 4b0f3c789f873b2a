//! A REV task that failed, from the file that it left.

use std::path::Path;

use serde_json::{Value, json};

use super::{files, solver_line, tensor_lines, unwritten};
use crate::{
    failure::{Failure, FailureKind},
    report::Report,
    run::{
        point::{PointState, PointTask},
        work::Job,
    },
};

/// Carries out the task in `file` again and says what each of its REVs answers. With `into`, writes the grains of those that
/// have no answer, or of all where all have one, into a folder for each.
///
/// # Errors
/// A file that holds no task.
pub fn replay_kept(file: &Path, into: Option<&Path>) -> Result<Report, Failure> {
    let name = file.display().to_string();
    let unreadable = |error: String| {
        Failure::new(FailureKind::Usage, format!("failed to read the task {name}"))
            .because(error)
            .hint("tasks that failed lie in the store's folder `failed`, as this version of the program writes them")
    };
    let bytes = std::fs::read(file).map_err(|error| unreadable(error.to_string()))?;
    let job: Job = rmp_serde::from_slice(&bytes).map_err(|error| unreadable(error.to_string()))?;
    match job {
        Job::Element(job) => {
            let answers: Vec<Answer> = job
                .points
                .iter()
                .enumerate()
                .map(|(local, task)| Answer::of(job.element, local, task, &job.settings))
                .collect();
            let any_failed = answers.iter().any(|answer| answer.outcome.is_err());
            let mut written = Vec::new();
            for answer in answers.iter().filter(|a| a.outcome.is_err() == any_failed) {
                if let (Some(folder), PointState::Rev(base)) = (into, &*answer.task.base) {
                    let after = match &answer.outcome {
                        Ok((PointState::Rev(after), ..)) => Some(after),
                        _ => None,
                    };
                    let folder = folder.join(&answer.name);
                    let files = files::write(&folder, base, after)
                        .map_err(|error| unwritten(&answer.name, error))?;
                    written.extend(files);
                }
            }
            Ok(describe(&name, &answers, &written))
        }
        Job::Drive(job) => {
            let outcome = job.carry_out().map_err(|error| error.to_string());
            let text = match &outcome {
                Ok(driven) => format!(
                    "{name}: the element test has an answer\n{}",
                    solver_line(&driven.report)
                ),
                Err(error) => format!("{name}: the element test has no answer\n  {error}\n"),
            };
            let written = match (into, &*job.base) {
                (Some(folder), PointState::Rev(base)) => {
                    let after = match outcome.as_ref().map(|driven| &driven.state) {
                        Ok(PointState::Rev(after)) => Some(after),
                        _ => None,
                    };
                    files::write(folder, base, after).map_err(|error| unwritten(&name, error))?
                }
                _ => Vec::new(),
            };
            let data = json!({
                "task": name,
                "control": job.control,
                "error": outcome.as_ref().err(),
                "report": outcome.as_ref().ok().map(|driven| driven.report),
                "files": written,
            });
            Ok(Report::new(text, &data))
        }
        Job::Prepare(_) | Job::Adopt { .. } => {
            let what = "it prepares a packing, which `femdem-flow rev prepare` does again";
            Err(unreadable(what.to_owned()))
        }
    }
}

/// What one REV of the task answers.
struct Answer<'a> {
    /// `e46.2`.
    name: String,
    task: &'a PointTask,
    outcome: Result<(PointState, Option<solver_dem::Report>), String>,
}

impl<'a> Answer<'a> {
    fn of(
        element: u32,
        local: usize,
        task: &'a PointTask,
        settings: &solver_dem::Settings,
    ) -> Self {
        let answer = task.evaluate(settings);
        Self {
            name: format!("e{element}.{local}"),
            task,
            outcome: answer.map(|answer| ((*answer.end.state).clone(), answer.report)),
        }
    }

    fn data(&self) -> Value {
        let report = self.outcome.as_ref().ok().and_then(|(_, report)| *report);
        json!({
            "rev": self.name,
            "gradient": self.task.gradient,
            "warm_start": self.task.start.is_some(),
            "report": report,
            "error": self.outcome.as_ref().err(),
        })
    }
}

fn describe(name: &str, answers: &[Answer<'_>], written: &[String]) -> Report {
    let mut text = format!("{name}\n");
    for answer in answers {
        match &answer.outcome {
            Ok((_, Some(report))) => {
                text.push_str(&format!(
                    "{} has an answer\n{}",
                    answer.name,
                    solver_line(report)
                ));
            }
            Ok((_, None)) => text.push_str(&format!("{} is elastic\n", answer.name)),
            Err(error) => {
                text.push_str(&format!("{} has no answer: {error}\n", answer.name));
                text.push_str(&tensor_lines("F", &answer.task.gradient));
            }
        }
    }
    for file in written {
        text.push_str(&format!("  written    {file}\n"));
    }
    let data = json!({
        "task": name,
        "revs": answers.iter().map(Answer::data).collect::<Vec<_>>(),
        "files": written,
    });
    Report::new(text, &data)
}
