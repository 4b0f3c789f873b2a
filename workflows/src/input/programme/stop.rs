//! What may end a stage early.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::input::plain::Plain;

/// What may end a stage early.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Stop {
    /// A load comes to a value.
    Load(usize, Bound),
    /// V/V0 − 1 of the cavity behind a boundary comes to a value.
    Volume(String, Bound),
    /// The equivalent shear strain of some Gauss point exceeds a value.
    ShearStrain(f64),
    /// A load changes no more: over so many increments all its values lie within this part of the largest.
    Settled {
        /// Index of the load.
        load: usize,
        /// Largest less smallest value, over the largest magnitude.
        within: f64,
        /// Number of increments of the programme.
        over: u32,
    },
    /// The mean displacement of the nodes there comes to a value.
    Displacement(Along, Bound),
    /// The force that the supports there exert on the body comes to a value.
    Force(Along, Bound),
    /// What is measured has lost this part of its largest magnitude since the stage began.
    Drop(Measured, f64),
}

/// One component at a boundary or set of nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Along {
    /// Name of the boundary or node set.
    pub on: String,
    /// 0 is x, 1 is y.
    pub component: usize,
}

impl fmt::Display for Along {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = ["x", "y"].get(self.component).unwrap_or(&"?");
        write!(f, "`{}` along {axis}", self.on)
    }
}

/// What may pass a peak.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Measured {
    /// The load of this index.
    Load(usize),
    /// The force that the supports there exert on the body.
    Force(Along),
}

impl Stop {
    /// What it says, `loads` being the names of the loads.
    pub fn words(&self, loads: &[String]) -> String {
        let name = |load: &usize| loads.get(*load).map_or("", String::as_str);
        match self {
            Self::Load(load, bound) => format!("`{}` is {bound}", name(load)),
            Self::Volume(boundary, bound) => format!("the volume of `{boundary}` is {bound}"),
            Self::ShearStrain(most) => format!("a shear strain is above {}", Plain(*most)),
            Self::Settled { load, within, over } => {
                let (name, within) = (name(load), Plain(*within));
                let ending = if *over == 1 { "" } else { "s" };
                format!("`{name}` kept within {within} of its value over {over} increment{ending}")
            }
            Self::Displacement(at, bound) => format!("the displacement of {at} is {bound}"),
            Self::Force(at, bound) => format!("the support force on {at} is {bound}"),
            Self::Drop(Measured::Load(load), part) => {
                format!(
                    "`{}` has dropped by {} of its largest value",
                    name(load),
                    Plain(*part)
                )
            }
            Self::Drop(Measured::Force(at), part) => {
                let part = Plain(*part);
                format!("the support force on {at} has dropped by {part} of its largest value")
            }
        }
    }

    /// How many increments back it looks.
    pub fn steps(&self) -> Option<u32> {
        match self {
            Self::Settled { over, .. } => Some(*over),
            _ => None,
        }
    }
}

/// A value that is come to from below or from above.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Bound {
    /// At this value or above it.
    Above(f64),
    /// At this value or below it.
    Below(f64),
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(value) => write!(f, "above {}", Plain(*value)),
            Self::Below(value) => write!(f, "below {}", Plain(*value)),
        }
    }
}

impl Bound {
    /// Whether `value` is there.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Above(bound) => value >= bound,
            Self::Below(bound) => value <= bound,
        }
    }
}
