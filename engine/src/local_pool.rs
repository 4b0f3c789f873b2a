//! The cores of this machine as an executor.

use std::collections::VecDeque;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::sync::oneshot;

use crate::executor::perform;
use crate::{Attempt, BoxFuture, Executor, NodeId, TaskContext, TaskError, Work};

/// Why a pool could not be made.
#[derive(Debug, thiserror::Error)]
#[error("start the threads of the pool")]
pub struct LocalPoolError(#[from] ThreadPoolBuildError);

/// A rayon pool that carries tasks out on this machine.
///
/// Tasks start in the order in which they are handed over. A thread whose task was abandoned (it ran
/// past its limit) is lost until that task ends; a spare thread stands in for it meanwhile, so that
/// the pool keeps its width. A task that never ends keeps its thread until the process ends.
///
/// The pool outlives runs; several runs may share it.
pub struct LocalPool {
    threads: NonZeroUsize,
    pool: ThreadPool,
    shared: Arc<Shared>,
}

type Job = Box<dyn FnOnce() + Send>;

/// Jobs have a queue of their own; what goes into rayon is only the advice to look into it. So a
/// spare thread can take over what was meant for a lost one.
#[derive(Default)]
struct Shared {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    queue: VecDeque<Job>,
    /// Threads whose task was abandoned and has not ended.
    lost: usize,
    /// Pools of one thread, one for each lost thread as soon as there is work for it.
    spares: Vec<ThreadPool>,
}

impl LocalPool {
    /// A pool of so many threads.
    ///
    /// # Errors
    /// [`LocalPoolError`] if the threads cannot be started.
    pub fn new(threads: NonZeroUsize) -> Result<Self, LocalPoolError> {
        Ok(Self {
            threads,
            pool: build(threads.get())?,
            shared: Arc::default(),
        })
    }

    /// Runs `f` inside the pool, so that rayon's parallel iterators in it use these threads; for the
    /// director's own computations. It returns when `f` is done.
    pub fn install<R: Send>(&self, f: impl FnOnce() -> R + Send) -> R {
        self.pool.install(f)
    }

    fn submit(&self, job: Job) {
        let mut state = self.shared.lock();
        state.queue.push_back(job);
        state.add_spares(&self.shared);
        for spare in &state.spares {
            advise(spare, &self.shared);
        }
        drop(state);
        advise(&self.pool, &self.shared);
    }
}

impl<W: Work> Executor<W> for LocalPool {
    fn execute(
        &self,
        task: NodeId,
        work: Arc<W>,
        context: TaskContext,
    ) -> BoxFuture<'static, Attempt<W::Output, W::Error>> {
        let (sender, receiver) = oneshot::channel();
        let phase = Arc::new(AtomicU8::new(QUEUED));
        let guard = AbandonGuard {
            task,
            phase: phase.clone(),
            context: context.clone(),
            shared: self.shared.clone(),
        };
        let shared = self.shared.clone();
        self.submit(Box::new(move || {
            if !step(&phase, QUEUED, RUNNING) {
                return;
            }
            let attempt = perform(work.as_ref(), &context);
            drop(work);
            if phase.swap(DONE, Ordering::AcqRel) == ABANDONED {
                shared.thread_returned();
            } else {
                // Nobody waits any more if the run was dropped.
                let _ = sender.send(attempt);
            }
        }));
        Box::pin(async move {
            let attempt = receiver.await;
            drop(guard);
            attempt.unwrap_or_else(|_| {
                Attempt::failed(TaskError::Lost {
                    message: "its thread gave no result".to_string(),
                })
            })
        })
    }

    fn slots(&self) -> usize {
        self.threads.get()
    }
}

const QUEUED: u8 = 0;
const RUNNING: u8 = 1;
const DONE: u8 = 2;
const ABANDONED: u8 = 3;

fn step(phase: &AtomicU8, from: u8, to: u8) -> bool {
    phase
        .compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire)
        .is_ok()
}

/// Sees that nobody waits for a job any more, because the future that did was dropped.
struct AbandonGuard {
    task: NodeId,
    phase: Arc<AtomicU8>,
    context: TaskContext,
    shared: Arc<Shared>,
}

impl Drop for AbandonGuard {
    fn drop(&mut self) {
        if step(&self.phase, QUEUED, ABANDONED) {
            return;
        }
        // The order matters: the thread is counted as lost before it can count as returned.
        let mut state = self.shared.lock();
        if step(&self.phase, RUNNING, ABANDONED) {
            tracing::warn!(task = %self.task, "a thread is lost to a task that was given up");
            self.context.cancel();
            state.lost += 1;
            if !state.queue.is_empty() {
                state.add_spares(&self.shared);
            }
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock and leaves the state half changed.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run_next(&self) {
        let job = self.lock().queue.pop_front();
        if let Some(job) = job {
            job();
        }
    }

    fn thread_returned(&self) {
        let mut state = self.lock();
        state.lost -= 1;
        let surplus = state.spares.len().saturating_sub(state.lost);
        // A dropped pool still does what it was given, then its thread ends.
        let retired: Vec<_> = state.spares.drain(..surplus).collect();
        drop(state);
        drop(retired);
    }
}

impl State {
    fn add_spares(&mut self, shared: &Arc<Shared>) {
        while self.spares.len() < self.lost {
            match build(1) {
                Ok(spare) => {
                    // It may be that all threads are lost: what is queued has nobody else.
                    for _ in 0..self.queue.len() {
                        advise(&spare, shared);
                    }
                    self.spares.push(spare);
                }
                Err(error) => {
                    // Tried again with the next job.
                    tracing::warn!(%error, "no thread can stand in for a lost one");
                    return;
                }
            }
        }
    }
}

fn advise(pool: &ThreadPool, shared: &Arc<Shared>) {
    let shared = shared.clone();
    pool.spawn(move || shared.run_next());
}

fn build(threads: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("task-{index}"))
        // Tasks are contained one by one; this is for a value that panics when it is dropped, where
        // rayon would end the process.
        .panic_handler(|_| tracing::error!("a panic outside a task in the pool"))
        .build()
}
