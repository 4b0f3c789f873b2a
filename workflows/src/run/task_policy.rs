//! What `task_retries` and `task_time_limit` of the input promise, held against executors that hang and crash on purpose:
//! no run may wait for ever, nor come to other numbers because a machine faltered.

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use engine::{Attempt, BoxFuture, Executor, NodeId, PauseToken, TaskContext, TaskError, perform};
use store::{RunName, Store};

use super::{
    campaign::Campaign,
    control::Signals,
    core::{Core, Ending},
    error::RunError,
    session::{self, Conducted, Equipment, conduct_on},
    work::{Done, Job, JobError},
};
use crate::{input::Problem, progress::Silent};

/// What befalls the tasks of element 1.
#[derive(Clone, Copy)]
enum Fault {
    /// They crash.
    Panic,
    /// They never end, and listen to nobody.
    Hang,
}

/// Carries tasks out, but for the first attempts at those of element 1.
struct Faulty {
    fault: Fault,
    attempts: u32,
}

impl Executor<Job> for Faulty {
    fn execute(
        &self,
        _: NodeId,
        work: Arc<Job>,
        context: TaskContext,
    ) -> BoxFuture<'static, Attempt<Done, JobError>> {
        let hit = matches!(&*work, Job::Element(job) if job.element == 1);
        if !hit || context.attempt() > self.attempts {
            let attempt = perform(&*work, &context);
            return Box::pin(async { attempt });
        }
        match self.fault {
            Fault::Panic => Box::pin(async {
                let message = "on purpose".to_owned();
                Attempt::failed(TaskError::Panicked { message })
            }),
            Fault::Hang => Box::pin(async move {
                // The limit counts from here.
                let _ = context.begin();
                std::future::pending().await
            }),
        }
    }

    fn slots(&self) -> usize {
        1
    }
}

/// Four elastic elements pressed in two steps, with these settings of the solver.
fn block(solver: &str) -> Problem {
    let text = format!(
        "name: block\nmesh: {{ rectangle: {{ size: [1.0, 1.0], elements: [2, 2] }} }}\n\
         materials: {{ rock: {{ elastic: {{ young: 100.0, poisson: 0.25, initial_stress: -1.0 }} }} }}\nmaterial: rock\n\
         loads: {{ down: 0.0 }}\nboundary:\n  - {{ on: left, displacement: {{ x: 0 }} }}\n  \
         - {{ on: right, displacement: {{ x: 0 }} }}\n  - {{ on: bottom, displacement: {{ y: 0 }} }}\n  \
         - {{ on: top, displacement: {{ y: down }} }}\n\
         programme: [ {{ name: press, ramp: {{ down: -0.002 }}, steps: 2 }} ]\nsolver: {{ {solver} }}\n"
    );
    let problem = crate::input::parse(&text, "block.yaml", std::path::Path::new("."));
    problem.unwrap_or_else(|errors| panic!("{errors}"))
}

/// How the run of the block ends: by itself or not, and the digest of its last step.
fn computed(
    solver: &str,
    fault: Fault,
    attempts: u32,
) -> (Result<Option<Ending>, RunError>, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let problem = block(solver);
    let manifest = session::described(problem.clone(), NonZeroUsize::MIN, None);
    let name = RunName::new("block").unwrap();
    let run = session::create(&store, name, None, &manifest).unwrap();
    let signals = Signals::listen().unwrap();
    let equipment = Equipment {
        store: &store,
        threads: NonZeroUsize::MIN,
        progress: &Silent,
        signals: &signals,
        deadline: None,
    };
    let core = Core::new(&store, &run, &Silent).unwrap();
    let mut campaign = Campaign::new(core, &problem);
    let executor = Arc::new(Faulty { fault, attempts });
    let conducted = conduct_on(executor, &mut campaign, &equipment, PauseToken::new(), None);
    let ended = conducted.map(|conducted| {
        assert_eq!(conducted, Conducted::Whole);
        campaign.ending().cloned()
    });
    let last = store.steps(&run).unwrap().pop();
    (
        ended,
        last.and_then(|step| step.digest)
            .map(|digest| digest.to_string()),
    )
}

const WHOLE: &str = "task_retries: 1, task_time_limit: 1, smallest_step: 0.5";

#[test]
fn a_task_that_crashes_once_is_tried_again_and_changes_no_bit() {
    let (ended, digest) = computed(WHOLE, Fault::Panic, 0);
    assert_eq!(ended.unwrap(), Some(Ending::Completed));
    assert!(digest.is_some());
    let (ended, again) = computed(WHOLE, Fault::Panic, 1);
    assert_eq!(ended.unwrap(), Some(Ending::Completed));
    assert_eq!(again, digest);
}

#[test]
fn a_task_that_hangs_once_is_given_up_and_tried_again_and_changes_no_bit() {
    let (_, digest) = computed(WHOLE, Fault::Hang, 0);
    let begun = std::time::Instant::now();
    let (ended, again) = computed(WHOLE, Fault::Hang, 1);
    assert_eq!(ended.unwrap(), Some(Ending::Completed));
    assert_eq!(again, digest);
    // It was waited for, in each wave: the limit is what was asked for, and not the default of ten minutes.
    assert!(begun.elapsed() >= Duration::from_secs(1));
}

#[test]
fn a_task_that_always_crashes_has_no_answer_so_that_the_step_is_cut_until_the_run_ends_in_words() {
    let (ended, digest) = computed(WHOLE, Fault::Panic, u32::MAX);
    let Some(Ending::Failed(why)) = ended.unwrap() else {
        panic!("it went on");
    };
    assert!(why.contains("panicked: on purpose"), "{why}");
    // The initial state is all there is.
    assert!(digest.is_some());
}

#[test]
fn a_task_that_always_hangs_stops_the_run_rather_than_let_the_clock_into_the_result() {
    let none = "task_retries: 0, task_time_limit: 1";
    for (solver, tried) in [(WHOLE, 2), (none, 1)] {
        let (ended, _) = computed(solver, Fault::Hang, u32::MAX);
        match ended {
            Err(RunError::Task {
                attempts, label, ..
            }) => {
                assert_eq!((attempts, label.as_str()), (tried, "e1"));
            }
            other => panic!("{other:?}"),
        }
    }
}
