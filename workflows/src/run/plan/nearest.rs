//! Why the steps of another run do not serve a new input, and how they could.

use std::collections::BTreeMap;

use super::Forecast;
use crate::{
    input::{
        Problem,
        derive::{self, Change},
    },
    run::view::{RunView, Standing, StepView},
};

/// Names the run from the beginning that differs least, and how: why its steps do not serve, and how they could.
pub fn explain(plan: &mut Forecast, problem: &Problem, runs: &[RunView]) {
    let nothing = BTreeMap::new();
    let wanted = derive::catalogue(problem, &nothing);
    let compared = runs
        .iter()
        .filter(|run| run.record.parent.is_none() && !run.steps.is_empty())
        .map(|run| {
            let theirs = derive::catalogue(&run.manifest.problem, &nothing);
            (run, derive::differences(&theirs, &wanted, |_| None))
        });
    let Some((run, changes)) = compared.min_by_key(|(_, changes)| changes.len()) else {
        plan.because
            .push("the store has no run yet that it could share steps with".into());
        return;
    };
    if changes.len() > MOST_CHANGES {
        plan.because.push(format!(
            "no run is like it; `{}`, the nearest, differs in {} keys",
            run.name(),
            changes.len()
        ));
        return;
    }
    let name = run.name();
    if changes.is_empty() {
        plan.because.push(format!(
            "the input is that of `{name}`, but a new run is asked for"
        ));
        plan.advice.push(match run.standing {
            Standing::Completed => format!("`femdem-flow show {name}` has its results"),
            _ => format!("`femdem-flow resume {name}` goes on with it"),
        });
        return;
    }
    plan.because.push(format!(
        "it differs from `{name}`, the run most like it, in:"
    ));
    let future = |change: &Change| {
        let keys = ["programme", "solver.", "output."];
        keys.iter().any(|key| change.key.starts_with(key))
    };
    let shared = shared_steps(problem, run);
    if changes.iter().all(future) && shared > 0 {
        plan.advice.push(format!(
            "`femdem-flow branch {name}@{shared} …` takes up `{name}`, whose first {} the same loads",
            match shared {
                1 => "load step has".to_owned(),
                _ => format!("{shared} load steps have"),
            }
        ));
    }
    plan.changes = changes;
}

/// The most differences that are listed; two inputs with more have little in common.
const MOST_CHANGES: usize = 12;

/// The last load step of `run` up to which the programme of `problem` takes the same load values, to rounding.
fn shared_steps(problem: &Problem, run: &RunView) -> u32 {
    let (ours, theirs) = (
        problem.programme.steps(),
        run.manifest.problem.programme.steps(),
    );
    let equal = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
        (None, None) => true,
        _ => false,
    };
    let pairs = ours.iter().zip(&theirs);
    let same = pairs
        .take_while(|(a, b)| {
            // Where a value is found on the way, it is the same where the way is.
            let found = a.to.contains(&None);
            a.to.iter().zip(&b.to).all(equal)
                && (!found || (&a.way, a.left, a.of) == (&b.way, b.left, b.of))
        })
        .count();
    let within = |step: &&StepView| step.reached() <= same as f64;
    run.steps
        .iter()
        .rfind(within)
        .map_or(0, |step| step.record.index.0)
}
