//! Packings being made: those that the cache lacks are tasks of the graph.

use std::{collections::BTreeMap, time::Duration};

use engine::{Finished, GraphHandle, NodeId, TaskOutcome, TaskSpec};
use store::Store;

use super::{
    error::RunError,
    frames::{self, Deal},
    packings::{Plan, cache_key},
    work::{Done, Job, Packing},
};

/// Packings being made.
pub struct Preparing {
    plan: Plan,
    packings: Vec<Option<Packing>>,
    tasks: BTreeMap<NodeId, usize>,
    failures: Vec<String>,
    cached: usize,
    /// CPU time of each packing made here, in the order of the plan.
    cpu: Vec<Option<Duration>>,
}

/// What was prepared.
pub struct Prepared {
    /// Which packing each Gauss point gets.
    pub deal: Deal,
    /// The packings.
    pub packings: Vec<Packing>,
    /// CPU time of each; `None` for those from the cache.
    pub cpu: Vec<Option<Duration>>,
}

impl Preparing {
    /// Takes what the cache of `store` has and makes tasks of the rest.
    ///
    /// # Errors
    /// The graph takes no more tasks.
    pub fn begin(
        plan: Plan,
        store: &Store,
        graph: &mut GraphHandle<Job>,
    ) -> Result<Self, RunError> {
        let mut packings = Vec::with_capacity(plan.jobs.len());
        let mut tasks = BTreeMap::new();
        for (number, job) in plan.jobs.iter().enumerate() {
            let cached = store.cache_get(&cache_key(job));
            let packing: Option<Packing> =
                cached.and_then(|bytes| rmp_serde::from_slice(&bytes).ok());
            if packing.is_none() {
                let spec = TaskSpec::new(format!("packing {number}"), job.clone());
                tasks.insert(graph.add_task(spec)?, number);
            }
            packings.push(packing);
        }
        let cached = packings.len() - tasks.len();
        Ok(Self {
            cpu: vec![None; packings.len()],
            plan,
            packings,
            tasks,
            failures: Vec::new(),
            cached,
        })
    }

    /// How many packings are needed.
    pub fn needed(&self) -> usize {
        self.packings.len()
    }

    /// How many of them were in the cache.
    pub fn cached(&self) -> usize {
        self.cached
    }

    /// The tasks that make the rest.
    pub fn tasks(&self) -> Vec<NodeId> {
        self.tasks.keys().copied().collect()
    }

    /// Takes the outcome of a task and puts the packing into the cache; returns its number, if it is one.
    ///
    /// # Errors
    /// The task was no preparation.
    pub fn take(
        &mut self,
        id: NodeId,
        outcome: TaskOutcome<Job>,
        store: &Store,
    ) -> Result<Option<usize>, RunError> {
        let Some(&number) = self.tasks.get(&id) else {
            return Ok(None);
        };
        match outcome {
            Ok(Finished {
                output: Done::Packing(packing),
                cpu,
                ..
            }) => {
                self.cpu[number] = Some(cpu);
                let key = cache_key(&self.plan.jobs[number]);
                if let Err(error) = store.cache_put(&key, frames::encode(&packing)) {
                    // The next run prepares it again.
                    tracing::warn!(%error, "a packing could not be cached");
                }
                self.packings[number] = Some(*packing);
                Ok(Some(number))
            }
            Ok(_) => Err(RunError::Engine("a preparation gave something else".into())),
            Err(failure) if matches!(failure.cause, engine::Cause::Cancelled) => Ok(None),
            Err(failure) => {
                self.failures.push(failure.to_string());
                Ok(None)
            }
        }
    }

    /// The packings and who gets which; `None` where the preparation was cancelled: what is made is in the cache.
    ///
    /// # Errors
    /// Packings that could not be made.
    pub fn finish(self) -> Result<Option<Prepared>, RunError> {
        if let Some(reason) = self.failures.first() {
            let (failed, of) = (self.failures.len(), self.packings.len());
            return Err(RunError::Preparation {
                failed,
                of,
                reason: reason.clone(),
            });
        }
        let packings: Option<Vec<Packing>> = self.packings.into_iter().collect();
        Ok(packings.map(|packings| Prepared {
            deal: self.plan.deal,
            packings,
            cpu: self.cpu,
        }))
    }
}
