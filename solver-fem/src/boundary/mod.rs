//! Boundary conditions and loads: prescribed displacements, dead tractions, follower pressure, body forces.
//!
//! A condition says where, what and **which load**: its [`Value`] is a constant or
//! `load × factor + constant`. The load values themselves are numbers handed in at every step; the
//! load programme that makes them lives elsewhere.

mod body_force;
mod cavity;
mod constraints;
mod external;
mod facets;
mod loads;

use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use cavity::{Cavity, CavityProblem};
pub use constraints::{Constraints, Prescribed, Tie};
pub(crate) use constraints::{Given, names};
pub use external::ExternalLoads;

/// A quantity that may follow a load.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub enum Value {
    /// The same throughout.
    Constant(f64),
    /// `loads[index] × factor + constant`.
    Load {
        /// Index into the load values of the step.
        index: usize,
        /// Multiplier.
        factor: f64,
        /// Added.
        constant: f64,
    },
}

impl Value {
    /// The load of this index, as it is.
    pub fn load(index: usize) -> Self {
        Value::Load {
            index,
            factor: 1.0,
            constant: 0.0,
        }
    }

    /// Derivative with respect to the load of this index.
    pub fn slope(&self, load: usize) -> f64 {
        match *self {
            Value::Load { index, factor, .. } if index == load => factor,
            Value::Load { .. } | Value::Constant(_) => 0.0,
        }
    }

    /// The number for given load values; a load that is not there counts as zero (problems are
    /// checked against their number of loads when they are built).
    pub fn at(&self, loads: &[f64]) -> f64 {
        match *self {
            Value::Constant(value) => value,
            Value::Load {
                index,
                factor,
                constant,
            } => loads.get(index).copied().unwrap_or(0.0) * factor + constant,
        }
    }
}

/// What a displacement is prescribed on.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
pub enum Target {
    /// All nodes of a named boundary of the mesh.
    Boundary(String),
    /// A named node set of the mesh.
    NodeSet(String),
}

impl Target {
    /// A boundary by name.
    pub fn boundary(name: &str) -> Self {
        Target::Boundary(name.to_owned())
    }

    /// A node set by name.
    pub fn node_set(name: &str) -> Self {
        Target::NodeSet(name.to_owned())
    }
}

/// One boundary condition.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
pub enum Condition {
    /// One displacement component of all nodes of the target.
    ///
    /// The component **moves by the change of the value** over a step, from where it was at the
    /// last commit: a boundary that moved freely in one stage can be driven in the next without a
    /// jump, and a constant means "stays where it is".
    Displacement {
        /// The nodes.
        target: Target,
        /// Component, from 0.
        component: usize,
        /// Displacement in length units, positive along the axis.
        value: Value,
    },
    /// Dead traction: one component of the force per initial length of edge (area of face in 3D),
    /// which keeps its direction and total whatever the deformation.
    Traction {
        /// The boundary.
        boundary: String,
        /// Component, from 0.
        component: usize,
        /// Force per initial length and unit thickness, positive along the axis.
        value: Value,
    },
    /// Follower pressure: traction −p·n on the deformed boundary, n outward.
    Pressure {
        /// The boundary.
        boundary: String,
        /// Pressure p, **positive when it pushes into the body**.
        value: Value,
    },
    /// Body force on the whole body: one component of the force per **initial** volume, as its own weight is. The mass of a
    /// piece does not change with its volume, so neither does the force on it.
    BodyForce {
        /// Component, from 0.
        component: usize,
        /// Force per initial volume (area × unit thickness in 2D), positive along the axis.
        value: Value,
    },
}

impl Condition {
    /// Prescribes one component.
    pub fn displacement(target: Target, component: usize, value: Value) -> Self {
        Condition::Displacement {
            target,
            component,
            value,
        }
    }

    /// Holds the component normal to a plane of symmetry that is normal to axis `component`.
    pub fn symmetry(boundary: &str, component: usize) -> Self {
        Self::displacement(Target::boundary(boundary), component, Value::Constant(0.0))
    }

    /// Holds every component of a node set.
    pub fn pin<const D: usize>(node_set: &str) -> Vec<Self> {
        (0..D)
            .map(|i| Self::displacement(Target::node_set(node_set), i, Value::Constant(0.0)))
            .collect()
    }

    /// Follower pressure.
    pub fn pressure(boundary: &str, value: Value) -> Self {
        Condition::Pressure {
            boundary: boundary.to_owned(),
            value,
        }
    }

    /// Body force.
    pub fn body_force(component: usize, value: Value) -> Self {
        Condition::BodyForce { component, value }
    }

    /// Dead traction.
    pub fn traction(boundary: &str, component: usize, value: Value) -> Self {
        Condition::Traction {
            boundary: boundary.to_owned(),
            component,
            value,
        }
    }
}

/// One fault of the boundary conditions. `condition` counts from 0 in the order given.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum BoundaryProblem {
    /// There is no boundary of that name.
    #[error("condition {condition}: there is no boundary `{name}` (there are: {known})")]
    UnknownBoundary {
        /// Number of the condition.
        condition: usize,
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// There is no node set of that name.
    #[error("condition {condition}: there is no node set `{name}` (there are: {known})")]
    UnknownNodeSet {
        /// Number of the condition.
        condition: usize,
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The component does not exist in this dimension.
    #[error(
        "condition {condition}: component {component} does not exist in {dimension} dimensions"
    )]
    UnknownComponent {
        /// Number of the condition.
        condition: usize,
        /// The component asked for.
        component: usize,
        /// Space dimension.
        dimension: usize,
    },
    /// The value refers to a load that does not exist.
    #[error("condition {condition}: there is no load {index}, there are {count}")]
    UnknownLoad {
        /// Number of the condition.
        condition: usize,
        /// The load asked for.
        index: usize,
        /// Number of loads.
        count: usize,
    },
    /// A constant or factor is NaN or infinite.
    #[error("condition {condition}: its value is not a finite number")]
    NonFiniteValue {
        /// Number of the condition.
        condition: usize,
    },
    /// Two conditions give the same displacement component different values.
    #[error(
        "conditions {first} and {second} prescribe different displacements of node {node}, component {component}"
    )]
    Conflict {
        /// Number of the earlier condition.
        first: usize,
        /// Number of the later condition.
        second: usize,
        /// A node they share (the first one).
        node: usize,
        /// The component.
        component: usize,
    },
    /// A load acts only on components that are all prescribed, so it can do nothing.
    #[error("condition {condition}: `{boundary}` is held everywhere, the load has no effect")]
    LoadOnHeldBoundary {
        /// Number of the condition.
        condition: usize,
        /// The boundary.
        boundary: String,
    },
    /// A tie refers to a node that does not exist, to itself, or back to itself through others; or a
    /// node follows two others.
    #[error("node {node} cannot follow node {to}")]
    Tie {
        /// The node that should follow.
        node: usize,
        /// The node it should follow.
        to: usize,
    },
    /// The body can move as a whole.
    #[error("the body is free to move as a whole: {motion}")]
    RigidMotion {
        /// The motion in words.
        motion: String,
    },
    /// Everything is prescribed, nothing is left to compute.
    #[error("every displacement is prescribed: there is no unknown left")]
    NoUnknowns,
}
