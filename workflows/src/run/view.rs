//! Runs as an onlooker sees them: from files alone, whoever owns the store.

use std::{
    fs::{File, TryLockError},
    path::Path,
};

use store::{Names, ReadOnlyStore, RunRecord, RunState, StepAddress, StepIndex, StepRecord, Store};

use super::{
    Context,
    error::RunError,
    events::{self, Whereabouts},
    manifest::Manifest,
    open::{Holder, explain, find, refused},
    summary::StepSummary,
};
use crate::{
    address::{RunName, StepSelector},
    failure::{Failure, FailureKind},
};

/// A store opened for looking.
pub struct View {
    /// The store.
    pub store: ReadOnlyStore,
    owner: Option<Holder>,
}

/// How a run stands: what the store says of it, told apart from a process that died.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Created, nothing computed yet.
    Prepared,
    /// A process computes it.
    Running,
    /// A process keeps it for later: no new task starts.
    Paused,
    /// The process that computed it is gone without a word.
    Killed,
    /// Stopped in order.
    Interrupted,
    /// At the end of its programme.
    Completed,
    /// At a step that cannot be solved.
    Failed,
    /// Its last load step is damaged or gone: whatever it was, it can neither be shown nor gone on from there.
    Damaged,
}

impl Standing {
    /// Whether a process has it in hand.
    pub fn is_alive(self) -> bool {
        matches!(self, Self::Running | Self::Paused)
    }

    /// One word for machines: a killed run is `interrupted`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Prepared => "prepared",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Killed | Self::Interrupted => "interrupted",
            Self::Completed => "completed",
            Self::Failed => "failed",
            Self::Damaged => "damaged",
        }
    }

    /// For people.
    pub fn phrase(self) -> &'static str {
        match self {
            Self::Killed => "interrupted (killed)",
            other => other.word(),
        }
    }
}

/// A committed step.
#[derive(Clone, Debug)]
pub struct StepView {
    /// What the store says of it.
    pub record: StepRecord,
    /// Its figures; empty where the step is damaged.
    pub summary: StepSummary,
}

impl StepView {
    /// CPU seconds of its tasks and of what joins them.
    pub fn cpu_s(&self) -> f64 {
        self.summary.cpu_s + self.summary.director_s
    }

    /// Increments of the programme done after it, the part of a cut one included.
    pub fn reached(&self) -> f64 {
        match self.summary.increment {
            0 => 0.0,
            increment => (increment - 1) as f64 + self.summary.position,
        }
    }
}

/// A run and its steps.
pub struct RunView {
    /// What the store says of it.
    pub record: RunRecord,
    /// How it stands.
    pub standing: Standing,
    /// What it is.
    pub manifest: Manifest,
    /// Its committed steps, those of its ancestors included, ascending.
    pub steps: Vec<StepView>,
    /// What its event log says.
    pub place: Whereabouts,
}

impl View {
    /// Opens the store for looking.
    pub fn open(context: &Context<'_>) -> Result<Self, Failure> {
        let store =
            Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
        let owner = owner(store.dir());
        Ok(Self { store, owner })
    }

    /// What the store calls the runs, in order.
    pub fn ids(&self) -> Result<Vec<store::RunName>, Failure> {
        self.store
            .run_names()
            .map_err(|error| explain("list the runs", error.into()))
    }

    /// What the runs are called.
    pub fn names(&self) -> Result<Names, Failure> {
        self.store
            .names()
            .map_err(|error| explain("list the runs", error.into()))
    }

    /// An address as people know it.
    pub fn shown(&self, address: &StepAddress) -> StepAddress {
        match self.store.names() {
            Ok(names) => names.shown_address(address),
            Err(_) => address.clone(),
        }
    }

    /// One run.
    pub fn run(&self, name: &RunName) -> Result<RunView, Failure> {
        let id = find(&self.names()?, name).map_err(|failure| {
            match super::queue::waiting(self.store.dir(), name.as_str()) {
                Some(number) => failure.hint(format!(
                    "it is queued as number {number} and not begun: `femdem-flow queue` lists what waits, `femdem-flow queue remove {number}` takes it back"
                )),
                None => failure,
            }
        })?;
        self.read(&id)
            .map_err(|error| explain(&format!("read run `{name}`"), error))
    }

    /// One run that is known to be there, by what the store calls it.
    pub fn read(&self, name: &store::RunName) -> Result<RunView, RunError> {
        let record = self.store.run(name)?;
        let manifest = super::session::manifest(&record.manifest)?;
        let steps = self.store.steps(name)?;
        let lost = steps.last().is_some_and(StepRecord::is_lost);
        let steps = steps_of(name, steps);
        let place = events::read(&self.store.events_path(name));
        let standing = self.standing_at(record.state, &place, lost);
        Ok(RunView {
            record,
            standing,
            manifest,
            steps,
            place,
        })
    }

    /// How a run stands, without looking at its steps: whether one is lost is not seen.
    pub fn standing_of(&self, id: &store::RunName) -> Result<Standing, RunError> {
        let record = self.store.run(id)?;
        let place = events::read(&self.store.events_path(id));
        Ok(self.standing_at(record.state, &place, false))
    }

    /// The process that holds the store, if one does.
    pub fn holder(&self) -> Option<&Holder> {
        self.owner.as_ref()
    }

    fn standing_at(&self, state: RunState, place: &Whereabouts, lost: bool) -> Standing {
        match self.standing(state, place.pid) {
            Standing::Running if place.pausing.is_some() => Standing::Paused,
            Standing::Running => Standing::Running,
            _ if lost => Standing::Damaged,
            standing => standing,
        }
    }

    /// How a run stands, pauses apart.
    fn standing(&self, state: RunState, session: Option<u32>) -> Standing {
        match state {
            RunState::Prepared => Standing::Prepared,
            RunState::Interrupted => Standing::Interrupted,
            RunState::Completed => Standing::Completed,
            RunState::Failed => Standing::Failed,
            // The owner of the store may be at another of its runs.
            RunState::Running => match self.owner.as_ref().map(|owner| owner.pid) {
                Some(pid) if pid.is_none() || session.is_none() || pid == session => {
                    Standing::Running
                }
                _ => Standing::Killed,
            },
        }
    }
}

/// Steps with their figures. Those that cannot be read are told of and missing from what is shown; a step that is damaged
/// may have none, which its health tells.
fn steps_of(run: &store::RunName, records: Vec<StepRecord>) -> Vec<StepView> {
    let mut unread: Option<(StepIndex, rmp_serde::decode::Error)> = None;
    let steps = records.into_iter().map(|record| {
        let summary = match rmp_serde::from_slice(&record.summary) {
            Ok(summary) => summary,
            Err(error) => {
                if !record.summary.is_empty() && unread.is_none() {
                    unread = Some((record.index, error));
                }
                StepSummary::default()
            }
        };
        StepView { record, summary }
    });
    let steps = steps.collect();
    if let Some((step, error)) = unread {
        tracing::warn!(
            %error,
            "the figures of load step {step} of `{run}` cannot be read, and perhaps those of others; they are missing from what is shown"
        );
    }
    steps
}

/// Who owns the store in `dir`.
///
/// The lock itself is the only sure sign: process numbers are reused, and mean nothing on another host. Where nobody
/// holds it, asking holds it for an instant, shared with others who ask.
pub fn owner(dir: &Path) -> Option<Holder> {
    let path = dir.join("LOCK");
    let file = File::open(&path).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => {
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            let value = |key: &str| {
                let mut lines = text.lines();
                lines.find_map(|line| line.strip_prefix(key).map(str::trim))
            };
            Some(Holder {
                pid: value("pid ").and_then(|pid| pid.parse().ok()),
                host: value("host ").map(str::to_owned),
            })
        }
        Ok(()) | Err(TryLockError::Error(_)) => None,
    }
}

impl RunView {
    /// What people call it.
    pub fn name(&self) -> &store::RunName {
        self.record.shown()
    }

    /// What the store calls it: the name it was born with.
    pub fn id(&self) -> &store::RunName {
        &self.record.name
    }

    /// The last committed step.
    pub fn last(&self) -> Option<&StepView> {
        self.steps.last()
    }

    /// Number of the last committed step.
    pub fn last_index(&self) -> u32 {
        self.last().map_or(0, |step| step.record.index.0)
    }

    /// What to do about a damaged last step: the hint of whatever meets it.
    pub fn way_out(&self) -> String {
        way_out(self.name(), self.steps.iter().map(|step| &step.record))
    }

    /// Numbers of the steps that are damaged or gone.
    pub fn damaged(&self) -> Vec<u32> {
        let steps = self.steps.iter();
        let lost = steps.filter(|step| step.record.is_lost());
        lost.map(|step| step.record.index.0).collect()
    }

    /// Digest of the last committed step, hexadecimal.
    pub fn digest(&self) -> Option<String> {
        self.last()
            .and_then(|step| step.record.digest)
            .map(|digest| digest.to_string())
    }

    /// CPU seconds of all its steps.
    pub fn cpu_s(&self) -> f64 {
        self.steps.iter().map(StepView::cpu_s).sum()
    }

    /// The steps that it computed itself, those shared with its ancestors left out.
    pub fn own_steps(&self) -> impl Iterator<Item = &StepView> {
        let own = |step: &&StepView| step.record.run == self.record.name;
        self.steps.iter().filter(own)
    }

    /// CPU seconds of its own steps.
    pub fn own_cpu_s(&self) -> f64 {
        self.own_steps().map(StepView::cpu_s).sum()
    }

    /// Bytes of the packs of its own steps.
    pub fn bytes(&self) -> u64 {
        self.own_steps().map(|step| step.record.bytes).sum()
    }

    /// Increments of the programme, and how many are done.
    pub fn increments(&self) -> (f64, u64) {
        let done = self.last().map_or(0.0, StepView::reached);
        (done, self.manifest.problem.programme.len())
    }

    /// The step that `selector` means.
    pub fn step(&self, selector: StepSelector) -> Result<&StepView, Failure> {
        let found = match selector {
            StepSelector::Last => self.last(),
            StepSelector::Index(index) => self
                .steps
                .iter()
                .find(|step| u64::from(step.record.index.0) == index),
        };
        found.ok_or_else(|| {
            let name = self.name();
            let what = format!("failed to find load step {selector} of run `{name}`");
            let hint = match self.last() {
                Some(last) => format!("its committed load steps are 0 to {}", last.record.index),
                None => {
                    format!("it has no committed load step yet; see `femdem-flow status {name}`")
                }
            };
            Failure::new(FailureKind::Usage, what).hint(hint)
        })
    }
}

/// What to do where the last of `steps` is damaged: back to the last sound one before all that is lost.
pub fn way_out<'a>(
    name: &store::RunName,
    steps: impl DoubleEndedIterator<Item = &'a StepRecord>,
) -> String {
    let sound = steps.rev().find(|step| step.is_sound());
    match sound {
        Some(step) => format!(
            "restore its file from a copy (`femdem-flow store check` names it), or `femdem-flow store set-back {name}@{}`, from where \
             `femdem-flow resume {name}` computes it again",
            step.index
        ),
        None => "restore its files from a copy: `femdem-flow store check` names them".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_file_left_by_a_dead_process_is_no_owner() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(owner(folder.path()), None);
        let store = Store::open(folder.path()).unwrap();
        assert_eq!(
            owner(folder.path()),
            Some(Holder {
                pid: Some(std::process::id()),
                host: Some(crate::machine::host()),
            })
        );
        drop(store);
        assert!(folder.path().join("LOCK").exists());
        assert_eq!(owner(folder.path()), None);
    }

    #[test]
    fn a_killed_run_is_told_apart_from_one_that_its_owner_computes() {
        let folder = tempfile::tempdir().unwrap();
        let open = |owner| View {
            store: Store::open_read_only(folder.path()).unwrap(),
            owner,
        };
        drop(Store::open(folder.path()).unwrap());
        let of = |pid| Some(Holder { pid, host: None });
        let standing = |owner, session| open(owner).standing(RunState::Running, session);
        assert_eq!(standing(None, Some(7)), Standing::Killed);
        assert_eq!(standing(of(Some(7)), Some(7)), Standing::Running);
        assert_eq!(standing(of(Some(8)), Some(7)), Standing::Killed);
        assert_eq!(standing(of(None), Some(7)), Standing::Running);
        assert_eq!(Standing::Killed.word(), "interrupted");
    }
}
