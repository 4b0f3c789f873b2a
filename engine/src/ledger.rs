//! The state of a graph that runs: what waits for what, what is ready, what has ended.
//!
//! Synchronous and without a clock; the scheduler around it does the waiting.

use std::cmp::Reverse;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use crate::graph::{Growth, NewNode};
use crate::{NodeId, TaskSpec};

/// How a node ended, as far as its dependants care.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    Succeeded,
    Failed,
}

/// A task as the ledger keeps it while it is open.
#[derive(Debug)]
pub(crate) struct Task<W> {
    pub(crate) spec: TaskSpec<W>,
    /// Attempts started so far.
    pub(crate) attempts: u32,
    /// CPU time of the attempts ended so far.
    pub(crate) cpu: Duration,
    state: TaskState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TaskState {
    /// Waits for other nodes, or is ready.
    Idle,
    /// With the executor.
    Started,
    /// Between two attempts.
    Delayed,
}

/// What becomes of the tasks of a wave that is stopped.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct StoppedWave {
    /// With the executor: to be told to stop.
    pub(crate) started: Vec<NodeId>,
    /// Not with the executor: to be reported as cancelled.
    pub(crate) idle: Vec<NodeId>,
}

#[derive(Debug)]
struct Open<W> {
    label: Arc<str>,
    after: Vec<NodeId>,
    waits_for: usize,
    /// The first dependency that ended without success.
    failed_dependency: Option<NodeId>,
    dependants: Vec<NodeId>,
    /// A join has none.
    task: Option<Task<W>>,
    /// A join whose wave was stopped already.
    wave_stopped: bool,
}

#[derive(Debug)]
enum Slot<W> {
    Ended(Ending),
    Open(Box<Open<W>>),
}

#[derive(Debug)]
pub(crate) struct Ledger<W> {
    /// The node of `slots[0]`; all before are forgotten.
    first: u64,
    slots: VecDeque<Slot<W>>,
    kept_from: NodeId,
    open: usize,
    ready_tasks: BTreeSet<(Reverse<i32>, NodeId)>,
    ready_joins: BTreeSet<NodeId>,
    to_skip: BTreeSet<NodeId>,
}

impl<W> Ledger<W> {
    pub(crate) fn new() -> Self {
        Self {
            first: 0,
            slots: VecDeque::new(),
            kept_from: NodeId(0),
            open: 0,
            ready_tasks: BTreeSet::new(),
            ready_joins: BTreeSet::new(),
            to_skip: BTreeSet::new(),
        }
    }

    /// How many nodes have not ended.
    pub(crate) fn open(&self) -> usize {
        self.open
    }

    pub(crate) fn grow(&mut self, growth: Growth<W>) {
        debug_assert_eq!(growth.first.0, self.first + self.slots.len() as u64);
        for node in growth.nodes {
            self.add(node);
        }
        self.kept_from = self.kept_from.max(growth.kept_from);
        self.forget();
    }

    fn add(&mut self, node: NewNode<W>) {
        let id = NodeId(self.first + self.slots.len() as u64);
        let mut waits_for = 0;
        let mut failed_dependency = None;
        for &dependency in &node.after {
            match self.slot_mut(dependency) {
                Some(Slot::Open(open)) => {
                    open.dependants.push(id);
                    waits_for += 1;
                }
                Some(Slot::Ended(Ending::Failed)) => {
                    failed_dependency.get_or_insert(dependency);
                }
                Some(Slot::Ended(Ending::Succeeded)) | None => {}
            }
        }
        self.slots.push_back(Slot::Open(Box::new(Open {
            label: node.label,
            after: node.after,
            waits_for,
            failed_dependency,
            dependants: Vec::new(),
            task: node.task.map(|spec| Task {
                spec,
                attempts: 0,
                cpu: Duration::ZERO,
                state: TaskState::Idle,
            }),
            wave_stopped: false,
        })));
        self.open += 1;
        self.settle(id);
    }

    /// Moves a node that waits for nothing to where its turn comes.
    fn settle(&mut self, id: NodeId) {
        let Some(open) = self.open_mut(id) else {
            return;
        };
        if open.waits_for > 0 {
            return;
        }
        match (&open.task, open.failed_dependency) {
            (None, _) => {
                self.ready_joins.insert(id);
            }
            (Some(_), Some(_)) => {
                self.to_skip.insert(id);
            }
            (Some(task), None) => {
                let priority = Reverse(task.spec.priority);
                self.ready_tasks.insert((priority, id));
            }
        }
    }

    /// The next task to skip, and the node because of which.
    pub(crate) fn pop_skipped(&mut self) -> Option<(NodeId, NodeId)> {
        let id = self.to_skip.pop_first()?;
        let because = self.open_mut(id)?.failed_dependency?;
        Some((id, because))
    }

    pub(crate) fn pop_ready_join(&mut self) -> Option<NodeId> {
        self.ready_joins.pop_first()
    }

    /// The next task to start; it counts as started, and one more attempt as made.
    pub(crate) fn start_next(&mut self) -> Option<(NodeId, &Task<W>)> {
        let (_, id) = self.ready_tasks.pop_first()?;
        let task = self.task_mut(id)?;
        task.state = TaskState::Started;
        task.attempts += 1;
        Some((id, task))
    }

    /// A started task waits for its next attempt.
    pub(crate) fn delay(&mut self, id: NodeId) {
        if let Some(task) = self.task_mut(id) {
            task.state = TaskState::Delayed;
        }
    }

    /// A started or delayed task is ready for its next attempt.
    pub(crate) fn make_ready_again(&mut self, id: NodeId) {
        if let Some(task) = self.task_mut(id) {
            task.state = TaskState::Idle;
            self.settle(id);
        }
    }

    /// A started task was taken back before its attempt began; the attempt does not count.
    pub(crate) fn take_back(&mut self, id: NodeId) {
        if let Some(task) = self.task_mut(id) {
            task.attempts -= 1;
        }
        self.make_ready_again(id);
    }

    /// Whether anything could start or be skipped now.
    pub(crate) fn has_ready(&self) -> bool {
        !(self.ready_tasks.is_empty() && self.ready_joins.is_empty() && self.to_skip.is_empty())
    }

    pub(crate) fn label(&self, id: NodeId) -> Option<&Arc<str>> {
        match self.slot(id)? {
            Slot::Open(open) => Some(&open.label),
            Slot::Ended(_) => None,
        }
    }

    pub(crate) fn task_mut(&mut self, id: NodeId) -> Option<&mut Task<W>> {
        self.open_mut(id)?.task.as_mut()
    }

    /// Ends a node, drops what it held, and settles what waited for it. Gives back its task.
    pub(crate) fn end(&mut self, id: NodeId, ending: Ending) -> Option<Task<W>> {
        let slot = self.slot_mut(id)?;
        if matches!(slot, Slot::Ended(_)) {
            return None;
        }
        let Slot::Open(open) = std::mem::replace(slot, Slot::Ended(ending)) else {
            return None;
        };
        self.open -= 1;
        self.to_skip.remove(&id);
        for dependant in open.dependants {
            // A dependant that ended early, as part of a stopped wave, no longer waits.
            let Some(waiting) = self.open_mut(dependant) else {
                continue;
            };
            waiting.waits_for -= 1;
            if ending == Ending::Failed {
                waiting.failed_dependency.get_or_insert(id);
            }
            self.settle(dependant);
        }
        self.forget();
        open.task
    }

    /// The joins that wait for a task, directly or through other tasks.
    pub(crate) fn joins_of(&self, task: NodeId) -> Vec<NodeId> {
        let mut joins = BTreeSet::new();
        let mut seen = BTreeSet::from([task]);
        let mut to_visit = vec![task];
        while let Some(id) = to_visit.pop() {
            let Some(Slot::Open(open)) = self.slot(id) else {
                continue;
            };
            for &dependant in &open.dependants {
                match self.slot(dependant) {
                    Some(Slot::Open(open)) if open.task.is_none() => {
                        joins.insert(dependant);
                    }
                    Some(Slot::Open(_)) if seen.insert(dependant) => to_visit.push(dependant),
                    _ => {}
                }
            }
        }
        joins.into_iter().collect()
    }

    /// Takes every open task that `join` waits for, directly or through other tasks, out of what may
    /// start. The caller then ends them. Once for each join.
    pub(crate) fn stop_wave(&mut self, join: NodeId) -> StoppedWave {
        let mut stopped = StoppedWave::default();
        let mut to_visit = match self.open_mut(join) {
            Some(open) if open.task.is_none() && !open.wave_stopped => {
                open.wave_stopped = true;
                open.after.clone()
            }
            _ => return stopped,
        };
        let mut seen = BTreeSet::new();
        while let Some(id) = to_visit.pop() {
            if !seen.insert(id) {
                continue;
            }
            let Some(Slot::Open(open)) = self.slot(id) else {
                continue;
            };
            let Some(task) = &open.task else { continue };
            to_visit.extend_from_slice(&open.after);
            if task.state == TaskState::Started {
                stopped.started.push(id);
            } else {
                let priority = Reverse(task.spec.priority);
                stopped.idle.push(id);
                self.ready_tasks.remove(&(priority, id));
                self.to_skip.remove(&id);
            }
        }
        stopped.started.sort_unstable();
        stopped.idle.sort_unstable();
        stopped
    }

    /// Drops the records of ended nodes that nobody will refer to.
    fn forget(&mut self) {
        while self.first < self.kept_from.0 && matches!(self.slots.front(), Some(Slot::Ended(_))) {
            self.slots.pop_front();
            self.first += 1;
        }
    }

    fn slot(&self, id: NodeId) -> Option<&Slot<W>> {
        let index = usize::try_from(id.0.checked_sub(self.first)?).ok()?;
        self.slots.get(index)
    }

    fn slot_mut(&mut self, id: NodeId) -> Option<&mut Slot<W>> {
        let index = usize::try_from(id.0.checked_sub(self.first)?).ok()?;
        self.slots.get_mut(index)
    }

    fn open_mut(&mut self, id: NodeId) -> Option<&mut Open<W>> {
        match self.slot_mut(id)? {
            Slot::Open(open) => Some(open),
            Slot::Ended(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Graph, GraphHandle};

    fn task(label: &str) -> TaskSpec<()> {
        TaskSpec::new(label, ())
    }

    fn started(ledger: &mut Ledger<()>) -> Vec<u64> {
        std::iter::from_fn(|| ledger.start_next().map(|(id, _)| id.0)).collect()
    }

    #[test]
    fn ready_tasks_start_by_priority_then_by_age() {
        let mut graph = Graph::new();
        for priority in [0, 5, 0, 5, -1] {
            graph.add_task(task("t").priority(priority)).unwrap();
        }
        let mut ledger = Ledger::new();
        ledger.grow(graph.growth);
        assert_eq!(started(&mut ledger), [1, 3, 0, 2, 4]);
    }

    #[test]
    fn a_graph_that_runs_for_days_does_not_accumulate() {
        let mut handle = GraphHandle::new(NodeId(0), crate::CancelToken::new());
        let mut ledger = Ledger::new();
        let mut last = None;
        for _ in 0..1000 {
            let id = handle.add_task(task("t").after(last)).unwrap();
            handle.forget_before(id);
            last = Some(id);
            ledger.grow(handle.take());
            assert_eq!(started(&mut ledger), [id.0]);
            ledger.end(id, Ending::Succeeded);
            assert!(ledger.slots.len() <= 2);
        }
        assert_eq!(ledger.open(), 0);
    }

    #[test]
    fn what_is_kept_of_an_ended_node_is_16_bytes() {
        assert_eq!(size_of::<Slot<[u64; 100]>>(), 16);
    }

    #[test]
    fn forgetting_keeps_what_has_not_ended() {
        let mut handle = GraphHandle::new(NodeId(0), crate::CancelToken::new());
        let a = handle.add_task(task("a")).unwrap();
        let b = handle.add_task(task("b").after([a])).unwrap();
        handle.forget_before(NodeId(99));
        assert!(handle.add_task(task("c").after([b])).is_err());
        let mut ledger = Ledger::new();
        ledger.grow(handle.take());
        assert_eq!(started(&mut ledger), [a.0]);
        ledger.end(a, Ending::Succeeded);
        assert_eq!(started(&mut ledger), [b.0], "b still runs");
        ledger.end(b, Ending::Succeeded);
        assert!(ledger.slots.is_empty());
    }

    #[test]
    fn a_stopped_wave_reaches_back_through_chains_but_not_past_a_join() {
        let mut graph = Graph::new();
        let before = graph.add_task(task("before")).unwrap();
        let gate = graph.add_join("gate", vec![before]).unwrap();
        let a = graph.add_task(task("a")).unwrap();
        let b = graph.add_task(task("b").after([a])).unwrap();
        let c = graph.add_task(task("c").after([gate])).unwrap();
        let other = graph.add_task(task("other")).unwrap();
        let join = graph.add_join("join", vec![b, c]).unwrap();
        let mut ledger = Ledger::new();
        ledger.grow(graph.growth);
        assert_eq!(ledger.joins_of(a), [join]);
        assert_eq!(started(&mut ledger), [before.0, a.0, other.0]);
        let stopped = ledger.stop_wave(join);
        assert_eq!((stopped.started, stopped.idle), (vec![a], vec![b, c]));
        assert_eq!(ledger.stop_wave(join), StoppedWave::default(), "only once");
    }
}
