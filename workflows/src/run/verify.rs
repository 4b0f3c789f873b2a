//! Proof of a run after the fact: every hash, and a sample of its REV tasks carried out again.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use serde_json::json;
use solver_fem::GaussPointId;
use store::StepHealth;

use super::{
    Context, load,
    place::place_of,
    point::PointState,
    recorded::{Agreement, RecordedStep, RepeatError},
    text,
    view::{RunView, StepView, View},
};
use crate::{
    address::RunAddress,
    failure::{Failure, FailureKind},
    report::Report,
};

/// Which tasks are carried out again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Share of all tasks, above 0 and at most 1. One task is carried out at least.
    pub share: f64,
    /// Decides which: the same seed, the same tasks.
    pub seed: u64,
}

/// What is wrong with a step, or with a task of it.
struct Finding {
    /// `hollow@12` or `hollow@12:e46.2`.
    at: String,
    what: String,
}

/// What was found out.
#[derive(Default)]
struct Found {
    /// Steps whose bytes were checked.
    steps: usize,
    bytes: u64,
    /// REV tasks of the steps looked at, as far as they are recorded.
    tasks: usize,
    /// Of them carried out again.
    repeated: usize,
    damage: Vec<Finding>,
    mismatches: Vec<Finding>,
    /// Steps whose version did not record its tasks.
    unrecorded: Vec<u32>,
    /// Steps that were pruned: only their figures are left.
    pruned: usize,
    /// Steps that started from a pruned one, so that nothing in them can be asked again.
    baseless: Vec<u32>,
}

/// Checks every byte of the steps of a run (or of one step) against its hash, every step against the one that it continues
/// from, and carries out a sample of the REV tasks again.
///
/// # Errors
/// Damage; or, without damage, answers of other bits. Both with the report.
pub fn verify(
    context: &Context<'_>,
    address: &RunAddress,
    sample: Sample,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    let steps: Vec<&StepView> = match address.step {
        Some(selector) => vec![run.step(selector)?],
        None => run.steps.iter().collect(),
    };
    let mut found = Found::default();
    let sound: Vec<&StepView> = steps
        .into_iter()
        .filter(|step| check_bytes(&view, &run, step, &mut found))
        .collect();
    let sound: Vec<&StepView> = sound
        .into_iter()
        .filter(|step| has_base(&run, step, &mut found))
        .collect();
    let note = format!("{} checked byte by byte", text::count(found.steps, "step"));
    context.progress.note(&note);
    match load::dealt(&view.store, run.id()) {
        Ok(dealt) => {
            let chosen = choose(&sound, &dealt, sample, &mut found);
            repeat_all(context, &view, &run, &dealt, &chosen, &mut found);
        }
        // Step 0 is damaged, which was said, or lies before the only step asked for.
        Err(error) => {
            if found.damage.is_empty() {
                let at = format!("{}@0", run.name());
                let what = error.to_string();
                found.damage.push(Finding { at, what });
            }
        }
    }
    conclude(&run, sample, &found)
}

/// Whether the step before, from which this one started, is still there.
fn has_base(run: &RunView, step: &StepView, found: &mut Found) -> bool {
    let index = step.record.index.0;
    let before = before(run, step);
    let pruned = before.is_some_and(|before| before.record.health == StepHealth::Pruned);
    if pruned {
        found.baseless.push(index);
    }
    !pruned
}

/// The step before.
fn before<'a>(run: &'a RunView, step: &StepView) -> Option<&'a StepView> {
    let previous = step.record.index.0.checked_sub(1)?;
    let mut steps = run.steps.iter();
    steps.find(|before| before.record.index.0 == previous)
}

/// Checks a step's pack and its place in the lineage; whether nothing speaks against it.
fn check_bytes(view: &View, run: &RunView, step: &StepView, found: &mut Found) -> bool {
    let index = step.record.index;
    if step.record.health == StepHealth::Pruned {
        found.pruned += 1;
        return false;
    }
    let at = format!("{}@{index}", run.name());
    let checked = view.store.step(run.id(), index).and_then(|reader| {
        reader.verify()?;
        Ok(reader)
    });
    let what = match checked {
        Ok(reader) => {
            found.steps += 1;
            found.bytes += reader.bytes();
            let known = before(run, step).and_then(|before| before.record.digest);
            match (reader.predecessor(), known) {
                (Some((_, digest)), Some(known)) if digest != known => {
                    "it continues from a step that has another content now".to_owned()
                }
                _ => return true,
            }
        }
        Err(error) => error.to_string(),
    };
    found.damage.push(Finding { at, what });
    false
}

/// Gauss points to ask again, by step.
type Chosen<'a> = Vec<(&'a StepView, Vec<GaussPointId>)>;

/// The sample: of all tasks those with the smallest draws.
fn choose<'a>(
    steps: &[&'a StepView],
    dealt: &[Arc<PointState>],
    sample: Sample,
    found: &mut Found,
) -> Chosen<'a> {
    let revs = || {
        let points = dealt.iter().enumerate();
        points.filter_map(|(point, state)| match **state {
            PointState::Rev(_) => u32::try_from(point).ok(),
            PointState::Elastic { .. } => None,
        })
    };
    let computed = steps.iter().enumerate();
    let computed = computed.filter(|(_, step)| step.record.index.0 > 0);
    let mut tasks: Vec<(u64, usize, u32)> = computed
        .flat_map(|(k, step)| {
            let index = u64::from(step.record.index.0);
            revs().map(move |point| (draw(sample.seed, index << 32 | u64::from(point)), k, point))
        })
        .collect();
    found.tasks = tasks.len();
    let count = (sample.share * tasks.len() as f64).ceil() as usize;
    tasks.sort_unstable();
    tasks.truncate(count.max(1));
    let mut chosen: Chosen<'a> = Vec::new();
    let mut places: Vec<(usize, u32)> = tasks.into_iter().map(|(_, k, p)| (k, p)).collect();
    places.sort_unstable();
    for (k, point) in places {
        let point = GaussPointId(point);
        match chosen.last_mut() {
            Some((step, points)) if step.record.index == steps[k].record.index => {
                points.push(point);
            }
            _ => chosen.push((steps[k], vec![point])),
        }
    }
    chosen
}

/// A number that depends on seed and task alone (SplitMix64, Steele, Lea, Flood 2014).
fn draw(seed: u64, task: u64) -> u64 {
    let mut z = seed
        .wrapping_mul(0xd1b5_4a32_d192_ed03)
        .wrapping_add(task.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn repeat_all(
    context: &Context<'_>,
    view: &View,
    run: &RunView,
    dealt: &[Arc<PointState>],
    chosen: &Chosen<'_>,
    found: &mut Found,
) {
    for (step, points) in chosen {
        let at = |point: GaussPointId| {
            format!(
                "{}@{}:{}",
                run.name(),
                step.record.index,
                place_of(run, point)
            )
        };
        let recorded = match RecordedStep::open(view, run, step, dealt) {
            Ok(recorded) => recorded,
            Err(RepeatError::NotRecorded) => {
                found.unrecorded.push(step.record.index.0);
                continue;
            }
            Err(error) => {
                let at = format!("{}@{}", run.name(), step.record.index);
                let what = error.to_string();
                found.damage.push(Finding { at, what });
                continue;
            }
        };
        context.progress.note(&format!(
            "step {}: {} carried out again",
            step.record.index,
            text::count(points.len(), "task")
        ));
        let outcomes = in_parallel(context.threads().get(), points, |point| {
            recorded.repeat(point).map(|repeated| repeated.agreement)
        });
        for (point, outcome) in points.iter().zip(outcomes) {
            found.repeated += 1;
            let what = match outcome {
                Some(Ok(Agreement::SameBits)) => continue,
                Some(Ok(Agreement::Differs)) => "it answers with other bits".to_owned(),
                Some(Err(RepeatError::NoAnswer(why))) => format!("it has no answer now: {why}"),
                Some(Err(error)) => {
                    let (at, what) = (at(*point), error.to_string());
                    found.damage.push(Finding { at, what });
                    continue;
                }
                None => "it could not be asked again: a task panicked".to_owned(),
            };
            found.mismatches.push(Finding {
                at: at(*point),
                what,
            });
        }
    }
}

/// The results of `ask` in the order of `points`, computed on several threads; `None` where it panicked.
fn in_parallel<T: Send>(
    threads: usize,
    points: &[GaussPointId],
    ask: impl Fn(GaussPointId) -> T + Sync,
) -> Vec<Option<T>> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new((0..points.len()).map(|_| None).collect::<Vec<_>>());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.clamp(1, points.len().max(1)))
            .map(|_| {
                scope.spawn(|| {
                    loop {
                        let k = next.fetch_add(1, Ordering::Relaxed);
                        let Some(point) = points.get(k) else { return };
                        let result = ask(*point);
                        results.lock().unwrap_or_else(PoisonError::into_inner)[k] = Some(result);
                    }
                })
            })
            .collect();
        for worker in workers {
            // A panicking worker leaves its slot empty, which is reported; the others go on.
            let _ = worker.join();
        }
    });
    results.into_inner().unwrap_or_else(PoisonError::into_inner)
}

fn conclude(run: &RunView, sample: Sample, found: &Found) -> Result<Report, Failure> {
    let name = run.name();
    let mut out = format!(
        "Run `{name}`: {} of {} checked byte by byte, {} of {} REV tasks carried out again (seed {})\n",
        text::bytes(found.bytes),
        text::count(found.steps, "step"),
        found.repeated,
        found.tasks,
        sample.seed
    );
    for (what, findings) in [("damage", &found.damage), ("other bits", &found.mismatches)] {
        for finding in findings {
            out.push_str(&format!("  {what:<10} {}: {}\n", finding.at, finding.what));
        }
    }
    if !found.unrecorded.is_empty() {
        let steps: Vec<String> = found.unrecorded.iter().map(u32::to_string).collect();
        out.push_str(&format!(
            "  not asked  the tasks of the steps {} were not recorded by the version that computed them\n",
            steps.join(", ")
        ));
    }
    if found.pruned > 0 {
        out.push_str(&format!(
            "  not there  {} pruned before\n",
            text::count(found.pruned, "step")
        ));
    }
    if !found.baseless.is_empty() {
        let steps: Vec<String> = found.baseless.iter().map(u32::to_string).collect();
        out.push_str(&format!(
            "  not asked  the steps before {} were pruned, from which their REVs started\n",
            steps.join(", ")
        ));
    }
    let sound = found.damage.is_empty() && found.mismatches.is_empty();
    if sound && found.repeated > 0 {
        out.push_str("  every hash is right and every answer has the recorded bits\n");
    } else if sound {
        out.push_str("  every hash is right\n");
    }
    let list = |findings: &[Finding]| -> Vec<_> {
        let entries = findings.iter();
        entries
            .map(|finding| json!({ "at": finding.at, "what": finding.what }))
            .collect()
    };
    let data = json!({
        "run": name.as_str(),
        "steps": found.steps,
        "bytes": found.bytes,
        "tasks": found.tasks,
        "repeated": found.repeated,
        "share": sample.share,
        "seed": sample.seed,
        "damage": list(&found.damage),
        "mismatches": list(&found.mismatches),
        "not_recorded": found.unrecorded,
        "pruned": found.pruned,
        "start_pruned": found.baseless,
        "sound": sound,
    });
    let report = Report::new(out, &data);
    if !found.damage.is_empty() {
        let what = format!("failed to verify run `{name}`: it is damaged");
        Err(Failure::new(FailureKind::Store, what)
            .hint("`femdem-flow store check --deep` says what to do about each file")
            .with(report))
    } else if !found.mismatches.is_empty() {
        let what = format!("failed to verify run `{name}`: REVs answer with other bits");
        Err(Failure::new(FailureKind::Run, what)
            .hint("`femdem-flow show RUN` names the machines and versions that computed it; `femdem-flow replay` shows one REV")
            .with(report))
    } else {
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_the_points_and_a_panic_hides_no_other() {
        let points: Vec<GaussPointId> = (0..50).map(GaussPointId).collect();
        let squares = in_parallel(4, &points, |point| point.0 * point.0);
        let expected: Vec<Option<u32>> = (0..50).map(|k| Some(k * k)).collect();
        assert_eq!(squares, expected);
        let one = in_parallel(2, &points, |point| {
            assert_ne!(point.0, 49, "on purpose");
            point.0
        });
        assert_eq!((one[0], one[48], one[49]), (Some(0), Some(48), None));
        assert!(in_parallel(2, &[], |point| point.0).is_empty());
    }
}
