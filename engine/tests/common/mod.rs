//! Artificial work and a director made of closures, shared by the tests.
#![allow(dead_code, reason = "each test file uses a part")]

use std::num::{NonZeroU32, NonZeroUsize};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use engine::{
    Cause, Director, Event, EventKind, EventSink, GraphHandle, LocalPool, NodeId, RetryPolicy,
    TaskContext, TaskOutcome, TaskSpec, Work,
};
use serde::{Deserialize, Serialize};

/// Holds [`Job::Gate`] up; for one test of a file.
pub static GATE: AtomicBool = AtomicBool::new(false);

/// What an artificial task does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Job {
    /// Gives the number back.
    Echo(u64),
    /// A chain of floating-point operations that starts from this seed.
    Mix(u64),
    /// Fails every time.
    Fail,
    /// Fails by its own value.
    NoSolution,
    /// Fails before this attempt.
    SucceedAt(u32),
    /// Panics with this message.
    Panic(String),
    /// Runs for so long, but stops when asked to.
    Polite(Duration),
    /// Runs for so long and listens to nobody.
    Deaf(Duration),
    /// Runs until [`GATE`] is opened and listens to nobody.
    Gate,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum JobError {
    #[error("did not converge in attempt {0}")]
    NotConverged(u32),
    #[error("has no solution")]
    NoSolution,
    #[error("stopped")]
    Stopped,
}

impl Work for Job {
    type Output = u64;
    type Error = JobError;

    fn run(&self, context: &TaskContext) -> Result<u64, JobError> {
        match self {
            Job::Echo(value) => Ok(*value),
            Job::Mix(seed) => Ok(mix(*seed)),
            Job::Fail => Err(JobError::NotConverged(context.attempt())),
            Job::NoSolution => Err(JobError::NoSolution),
            Job::SucceedAt(attempt) if context.attempt() >= *attempt => Ok(u64::from(*attempt)),
            Job::SucceedAt(_) => Err(JobError::NotConverged(context.attempt())),
            Job::Panic(message) => panic!("{message}"),
            Job::Polite(duration) => {
                let begun = Instant::now();
                while begun.elapsed() < *duration {
                    if context.should_stop().is_some() {
                        return Err(JobError::Stopped);
                    }
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(0)
            }
            Job::Gate => {
                while !GATE.load(Ordering::Acquire) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(0)
            }
            Job::Deaf(duration) => {
                std::thread::sleep(*duration);
                Ok(0)
            }
        }
    }

    fn repeats(error: &JobError) -> bool {
        *error == JobError::NoSolution
    }
}

pub fn mix(seed: u64) -> u64 {
    let mut x = 0.1 + seed as f64 * 1e-6;
    for _ in 0..200 {
        x = 3.99 * x * (1.0 - x);
    }
    x.to_bits()
}

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct DirectorError(pub String);

type OnJoin<'a> = Box<
    dyn FnMut(NodeId, &mut Ended, &mut GraphHandle<Job>) -> Result<(), DirectorError> + Send + 'a,
>;
type OnTask<'a> =
    Box<dyn FnMut(NodeId, &mut GraphHandle<Job>) -> Result<(), DirectorError> + Send + 'a>;

/// How tasks and joins ended, in the order of the calls.
#[derive(Debug, Default)]
pub struct Ended {
    pub tasks: Vec<(NodeId, Result<u64, Cause<JobError>>)>,
    pub joins: Vec<NodeId>,
}

impl Ended {
    pub fn of(&self, id: NodeId) -> &Result<u64, Cause<JobError>> {
        let mut found = self.tasks.iter().filter(|(task, _)| *task == id);
        let (_, result) = found.next().expect("the task was reported");
        assert!(found.next().is_none(), "task {id} was reported twice");
        result
    }

    pub fn order(&self) -> Vec<u64> {
        self.tasks.iter().map(|(id, _)| id.index()).collect()
    }
}

/// Records what it is told, then asks its closures.
pub struct Script<'a> {
    pub ended: Ended,
    pub on_join: OnJoin<'a>,
    pub on_task: OnTask<'a>,
}

impl<'a> Script<'a> {
    pub fn passive() -> Self {
        Self::at_join(|_, _, _| Ok(()))
    }

    pub fn at_join(
        on_join: impl FnMut(NodeId, &mut Ended, &mut GraphHandle<Job>) -> Result<(), DirectorError>
        + Send
        + 'a,
    ) -> Self {
        Self {
            ended: Ended::default(),
            on_join: Box::new(on_join),
            on_task: Box::new(|_, _| Ok(())),
        }
    }

    pub fn at_task(
        mut self,
        on_task: impl FnMut(NodeId, &mut GraphHandle<Job>) -> Result<(), DirectorError> + Send + 'a,
    ) -> Self {
        self.on_task = Box::new(on_task);
        self
    }
}

impl Director<Job> for Script<'_> {
    type Error = DirectorError;

    fn task_finished(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        graph: &mut GraphHandle<Job>,
    ) -> Result<(), DirectorError> {
        let result = outcome.map(|f| f.output).map_err(|f| f.cause);
        self.ended.tasks.push((id, result));
        (self.on_task)(id, graph)
    }

    fn join(&mut self, id: NodeId, graph: &mut GraphHandle<Job>) -> Result<(), DirectorError> {
        self.ended.joins.push(id);
        (self.on_join)(id, &mut self.ended, graph)
    }
}

pub fn pool(threads: usize) -> Arc<LocalPool> {
    Arc::new(LocalPool::new(NonZeroUsize::new(threads).unwrap()).unwrap())
}

pub fn task(job: Job) -> TaskSpec<Job> {
    TaskSpec::new(format!("{job:?}"), job)
}

pub fn attempts(n: u32) -> RetryPolicy {
    RetryPolicy::attempts(NonZeroU32::new(n).unwrap())
}

pub const MS: Duration = Duration::from_millis(1);
/// So long that a test that waits for it hangs.
pub const AGES: Duration = Duration::from_secs(3600);

/// A sink that keeps all events, and the list of them.
pub fn recorder() -> (EventSink, Arc<Mutex<Vec<Event>>>) {
    let events = Arc::new(Mutex::new(Vec::new()));
    let kept = events.clone();
    let sink = EventSink::new(move |event| kept.lock().unwrap().push(event));
    (sink, events)
}

/// Events without their durations.
pub fn lines(events: &Mutex<Vec<Event>>) -> Vec<String> {
    let events = events.lock().unwrap();
    let line = |event: &Event| match &event.kind {
        EventKind::RunStarted { .. } => "run started".to_string(),
        EventKind::NodesAdded { first, count } => format!("added {first} +{count}"),
        EventKind::TaskStarted { id, attempt, .. } => format!("start {id} #{attempt}"),
        EventKind::TaskFinished { id, attempt, .. } => format!("finish {id} #{attempt}"),
        EventKind::TaskRetried { id, attempt, .. } => format!("retry {id} #{attempt}"),
        EventKind::TaskFailed {
            id, label, cause, ..
        } => format!("fail {id} {label}: {cause}"),
        EventKind::JoinStarted { id, .. } => format!("join {id}"),
        EventKind::JoinFinished { id, .. } => format!("joined {id}"),
        EventKind::TaskWithdrawn { id, attempt, .. } => format!("back {id} #{attempt}"),
        EventKind::Pausing => "pausing".to_string(),
        EventKind::Paused => "paused".to_string(),
        EventKind::Continued => "continued".to_string(),
        EventKind::Cancelled { level } => format!("cancelled {level:?}"),
        EventKind::RunFinished { summary } => format!("end {:?}", summary.end),
    };
    events.iter().map(line).collect()
}
