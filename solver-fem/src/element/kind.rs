//! The plane elements by name.

use std::sync::Arc;

use super::{Element, Q4, Q8, Q8Rule, T6, T6Rule};

/// A plane element with its integration rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PlaneElement {
    /// [`Q8`] with 2×2 points.
    #[default]
    Q8,
    /// [`Q8`] with 3×3 points.
    Q8Full,
    /// [`Q4`] with 2×2 points.
    Q4,
    /// [`T6`] with three points.
    T6,
    /// [`T6`] with six points.
    T6Full,
}

impl PlaneElement {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Q8, Self::Q8Full, Self::Q4, Self::T6, Self::T6Full];

    /// The element itself.
    pub fn element(self) -> Arc<dyn Element<2>> {
        match self {
            Self::Q8 => Arc::new(Q8 {
                rule: Q8Rule::Reduced,
            }),
            Self::Q8Full => Arc::new(Q8 { rule: Q8Rule::Full }),
            Self::Q4 => Arc::new(Q4),
            Self::T6 => Arc::new(T6 {
                rule: T6Rule::Reduced,
            }),
            Self::T6Full => Arc::new(T6 { rule: T6Rule::Full }),
        }
    }

    /// Number of displacement nodes.
    pub fn node_count(self) -> usize {
        match self {
            Self::Q8 | Self::Q8Full => 8,
            Self::Q4 => 4,
            Self::T6 | Self::T6Full => 6,
        }
    }

    /// Number of Gauss points.
    pub fn point_count(self) -> usize {
        match self {
            Self::Q8 | Self::Q4 => 4,
            Self::Q8Full => 9,
            Self::T6 => 3,
            Self::T6Full => 6,
        }
    }
}
