//! Building a graph, before a run and during it.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{CancelLevel, CancelToken, TaskSpec};

/// A node of a graph: a task or a join. Numbered in the order of addition, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct NodeId(pub(crate) u64);

impl NodeId {
    /// The position in the order of addition, from 0.
    pub fn index(self) -> u64 {
        self.0
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Why a node cannot be referred to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NodeError {
    /// There is no such node (yet); a dependency points to a node that exists already.
    #[error("refer to node {node}: the graph has only {len} nodes")]
    Unknown {
        /// The node.
        node: NodeId,
        /// How many nodes there are.
        len: u64,
    },
    /// The node was forgotten.
    #[error("refer to node {node}: all nodes before {kept_from} were forgotten")]
    Forgotten {
        /// The node.
        node: NodeId,
        /// The first node that is still known.
        kept_from: NodeId,
    },
}

/// The nodes that a run starts with.
#[derive(Debug)]
pub struct Graph<W> {
    pub(crate) growth: Growth<W>,
}

impl<W> Graph<W> {
    /// An empty graph.
    pub fn new() -> Self {
        Self {
            growth: Growth::after(NodeId(0), NodeId(0)),
        }
    }

    /// Adds a task.
    ///
    /// # Errors
    /// [`NodeError::Unknown`] if it is to come after a node that does not exist.
    pub fn add_task(&mut self, spec: TaskSpec<W>) -> Result<NodeId, NodeError> {
        self.growth.add_task(spec)
    }

    /// Adds a join, at which the director is called once all of `after` have ended in any way. A
    /// join that waits for nothing is called at once.
    ///
    /// # Errors
    /// [`NodeError::Unknown`] if it is to come after a node that does not exist.
    pub fn add_join(
        &mut self,
        label: impl Into<Arc<str>>,
        after: Vec<NodeId>,
    ) -> Result<NodeId, NodeError> {
        self.growth.add_join(label.into(), after)
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.growth.nodes.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.growth.nodes.is_empty()
    }
}

impl<W> Default for Graph<W> {
    fn default() -> Self {
        Self::new()
    }
}

/// The director's hand on a graph that runs.
///
/// What it asks for happens when the call of the director returns; if that call returns an error,
/// nothing of it happens.
#[derive(Debug)]
pub struct GraphHandle<W> {
    growth: Growth<W>,
    cancel: CancelToken,
}

impl<W> GraphHandle<W> {
    pub(crate) fn new(next: NodeId, cancel: CancelToken) -> Self {
        Self {
            growth: Growth::after(next, NodeId(0)),
            cancel,
        }
    }

    /// Adds a task, as [`Graph::add_task`] does. It may come after nodes that have ended.
    ///
    /// # Errors
    /// [`NodeError`] if it is to come after a node that does not exist or was forgotten.
    pub fn add_task(&mut self, spec: TaskSpec<W>) -> Result<NodeId, NodeError> {
        self.growth.add_task(spec)
    }

    /// Adds a join, as [`Graph::add_join`] does.
    ///
    /// # Errors
    /// [`NodeError`] if it is to come after a node that does not exist or was forgotten.
    pub fn add_join(
        &mut self,
        label: impl Into<Arc<str>>,
        after: Vec<NodeId>,
    ) -> Result<NodeId, NodeError> {
        self.growth.add_join(label.into(), after)
    }

    /// Stops the wave of a join: every task that the join waits for, directly or through other tasks.
    ///
    /// Those not started are reported as cancelled, those running are told to stop; then the join
    /// is called as usual. Nothing happens if `join` has ended or is a task.
    ///
    /// # Errors
    /// [`NodeError`] if there is no such node any more, or yet.
    pub fn stop_wave(&mut self, join: NodeId) -> Result<(), NodeError> {
        self.growth.check(join)?;
        self.growth.stop_waves.push(join);
        Ok(())
    }

    /// Promises not to refer to any node before `node` again, so that what is kept of ended nodes
    /// (16 bytes each) is dropped. Nodes that have not ended are not affected.
    pub fn forget_before(&mut self, node: NodeId) {
        let next = self.growth.next();
        self.growth.kept_from = self.growth.kept_from.max(node.min(next));
    }

    /// What the run was asked to do, so that a long join can give up early.
    pub fn cancel_level(&self) -> CancelLevel {
        self.cancel.level()
    }

    /// Takes what was asked for since the last time.
    pub(crate) fn take(&mut self) -> Growth<W> {
        let rest = Growth::after(self.growth.next(), self.growth.kept_from);
        std::mem::replace(&mut self.growth, rest)
    }
}

/// Nodes to be added to those that exist, and other wishes.
///
/// The numbers of nodes are consecutive, so that the first one and the count say which exist; no look
/// at the graph itself is needed, and the director may add nodes while the scheduler goes on.
#[derive(Debug)]
pub(crate) struct Growth<W> {
    pub(crate) first: NodeId,
    pub(crate) kept_from: NodeId,
    pub(crate) nodes: Vec<NewNode<W>>,
    pub(crate) stop_waves: Vec<NodeId>,
}

#[derive(Debug)]
pub(crate) struct NewNode<W> {
    pub(crate) label: Arc<str>,
    /// Sorted, each once.
    pub(crate) after: Vec<NodeId>,
    /// A join has none.
    pub(crate) task: Option<TaskSpec<W>>,
}

impl<W> Growth<W> {
    fn after(first: NodeId, kept_from: NodeId) -> Self {
        Self {
            first,
            kept_from,
            nodes: Vec::new(),
            stop_waves: Vec::new(),
        }
    }

    pub(crate) fn next(&self) -> NodeId {
        NodeId(self.first.0 + self.nodes.len() as u64)
    }

    fn add_task(&mut self, mut spec: TaskSpec<W>) -> Result<NodeId, NodeError> {
        let after = std::mem::take(&mut spec.after);
        self.add(spec.label.clone(), after, Some(spec))
    }

    fn add_join(&mut self, label: Arc<str>, after: Vec<NodeId>) -> Result<NodeId, NodeError> {
        self.add(label, after, None)
    }

    fn add(
        &mut self,
        label: Arc<str>,
        mut after: Vec<NodeId>,
        task: Option<TaskSpec<W>>,
    ) -> Result<NodeId, NodeError> {
        for &node in &after {
            self.check(node)?;
        }
        after.sort_unstable();
        after.dedup();
        let id = self.next();
        self.nodes.push(NewNode { label, after, task });
        Ok(id)
    }

    fn check(&self, node: NodeId) -> Result<(), NodeError> {
        if node >= self.next() {
            return Err(NodeError::Unknown {
                node,
                len: self.next().0,
            });
        }
        if node < self.kept_from {
            return Err(NodeError::Forgotten {
                node,
                kept_from: self.kept_from,
            });
        }
        Ok(())
    }
}
