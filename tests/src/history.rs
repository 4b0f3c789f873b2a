//! What a run has committed, read through the `store` crate: the verbs of the program are not asked about themselves.

use std::collections::BTreeMap;
use std::path::Path;

use serde::de::DeserializeOwned;
use solver_fem::{Tensor2, newton::MacroState};
use store::{
    Digest, FrameId, OpenError, ReadOnlyStore, RunName, RunState, StepHealth, StepIndex,
    StepReader, Store,
};

/// Kind of the frame that holds the macro state of a step (`workflows/src/run/frames.rs`).
const MACRO: u16 = 5;

/// Digest of every committed step, and how the run stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct History {
    /// How the run stands.
    pub state: RunState,
    /// The committed steps, ascending from step 0, with their digests.
    pub steps: Vec<(u32, Digest)>,
}

/// An element test at one committed step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestPoint {
    /// F from the initial cell.
    pub gradient: Tensor2<2>,
    /// Cauchy stress, tension positive.
    pub stress: Tensor2<2>,
}

/// The history of `run`, every byte of its packs checked; `None` where there is no such run yet.
///
/// # Panics
/// Where a pack is damaged or a step is missing.
pub fn of(store: &Path, run: &str) -> Option<History> {
    read(store, run, Unsound::Panic, |step| {
        step.verify()
            .expect("a committed step is sound to the last byte");
    })
}

/// The history of `run` as its packs say it, their frames unread: a step that no resume had to read may be damaged inside.
///
/// # Panics
/// Where a pack cannot be opened or a step is missing.
pub fn told(store: &Path, run: &str) -> Option<History> {
    read(store, run, Unsound::Panic, |_| {})
}

/// The same without the steps whose packs cannot be opened.
pub fn left(store: &Path, run: &str) -> Option<History> {
    read(store, run, Unsound::LeftOut, |_| {})
}

/// What becomes of a step whose pack cannot be opened.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Unsound {
    Panic,
    LeftOut,
}

fn read(
    store: &Path,
    run: &str,
    unsound: Unsound,
    look_at: impl Fn(&StepReader),
) -> Option<History> {
    let (store, name) = open(store, run)?;
    let record = store.run(&name).expect("the record of a run can be read");
    let mut steps = Vec::new();
    for listed in store
        .steps(&name)
        .expect("the steps of a run can be listed")
    {
        if unsound == Unsound::LeftOut && !listed.is_sound() {
            continue;
        }
        assert!(
            listed.is_sound(),
            "{}@{}: {:?}",
            run,
            listed.index,
            listed.health
        );
        let step = store
            .step(&name, listed.index)
            .expect("a committed step can be opened");
        look_at(&step);
        steps.push((listed.index.0, step.digest()));
    }
    Some(History {
        state: record.state,
        steps,
    })
}

/// Whether the states of a committed step are still there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// They are, sound to the last byte.
    Whole,
    /// They were given up; digest and figures remain.
    Pruned,
}

/// How a run stands and its steps, pruned ones included.
pub type Steps = (RunState, Vec<(u32, Digest, Kept)>);

/// Every run of a store with its steps, every byte of every pack checked; nothing where there is no store yet.
///
/// # Errors
/// What is damaged, missing or unreadable.
pub fn everything(store: &Path) -> Result<BTreeMap<String, Steps>, String> {
    let store = match Store::open_read_only(store) {
        Ok(store) => store,
        Err(OpenError::Missing { .. }) => return Ok(BTreeMap::new()),
        Err(error) => return Err(error.to_string()),
    };
    let names = store.run_names().map_err(|error| error.to_string())?;
    let runs = names.into_iter().map(|name| {
        let steps = steps_of(&store, &name).map_err(|error| format!("{name}: {error}"))?;
        Ok((name.to_string(), steps))
    });
    runs.collect()
}

/// The same in a line for each run.
pub fn in_words(runs: &BTreeMap<String, Steps>) -> String {
    let mut words = String::new();
    for (run, (state, steps)) in runs {
        words += &format!("\n  {run}: {state:?}");
        for (step, digest, kept) in steps {
            let mark = if *kept == Kept::Pruned { " pruned" } else { "" };
            words += &format!(", {step} {}{mark}", &digest.to_string()[..8]);
        }
    }
    words
}

fn steps_of(store: &ReadOnlyStore, run: &RunName) -> Result<Steps, String> {
    let state = store.run(run).map_err(|error| error.to_string())?.state;
    let mut steps = Vec::new();
    for listed in store.steps(run).map_err(|error| error.to_string())? {
        let kept = match listed.health {
            StepHealth::Sound => {
                let step = store.step(run, listed.index);
                step.and_then(|step| step.verify())
                    .map_err(|error| error.to_string())?;
                Kept::Whole
            }
            StepHealth::Pruned => Kept::Pruned,
            lost => return Err(format!("step {} is {lost:?}", listed.index)),
        };
        let digest = listed.digest.ok_or("a step without a digest")?;
        steps.push((listed.index.0, digest, kept));
    }
    Ok((state, steps))
}

/// The macro states of a body at every committed step, from step 0.
pub fn bodies(store: &Path, run: &str) -> Vec<MacroState<2>> {
    macro_states(store, run)
}

/// The element test at every committed step, from step 0.
pub fn element_test(store: &Path, run: &str) -> Vec<TestPoint> {
    let points: Vec<(Tensor2<2>, Tensor2<2>)> = macro_states(store, run);
    points
        .into_iter()
        .map(|(gradient, stress)| TestPoint { gradient, stress })
        .collect()
}

fn macro_states<T: DeserializeOwned>(store: &Path, run: &str) -> Vec<T> {
    let (store, name) = open(store, run).expect("the run is there");
    let last = store.run(&name).expect("its record can be read").last_step;
    let steps = 0..=last.expect("at least the initial state is committed").0;
    steps
        .map(|step| {
            let reader = store
                .step(&name, StepIndex(step))
                .expect("a committed step can be opened");
            let bytes = reader
                .frame(FrameId::new(MACRO, 0))
                .expect("it has a macro state");
            rmp_serde::from_slice(&bytes).expect("the macro state has this form")
        })
        .collect()
}

fn open(store: &Path, run: &str) -> Option<(ReadOnlyStore, RunName)> {
    let name = RunName::new(run).expect("tests use valid names");
    let store = Store::open_read_only(store).ok()?;
    let names = store.names().expect("runs can be listed");
    let born = names.resolve(&name)?;
    Some((store, born))
}
