//! The mesh as resolved: what a run stores of it, and what can be told of it before it is built.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::document::{Annulus, Element, Rectangle};
use super::gmsh::Imported;

/// Shape of the body and its division into elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mesh {
    /// A rectangle with sides along x and y.
    Rectangle(Rectangle),
    /// A ring around the origin, or a part of one.
    Annulus(Annulus),
    /// What was in a file.
    Imported(Arc<Imported>),
}

impl Mesh {
    /// The kind of its elements.
    pub fn element(&self) -> Element {
        match self {
            Self::Rectangle(rectangle) => rectangle.element,
            Self::Annulus(annulus) => annulus.element,
            Self::Imported(mesh) => mesh.element,
        }
    }

    /// Number of elements.
    pub fn element_count(&self) -> u64 {
        let of_grid = |[first, second]: [u32; 2]| {
            u64::from(first) * u64::from(second) * self.element().per_field()
        };
        match self {
            Self::Rectangle(rectangle) => of_grid(rectangle.elements),
            Self::Annulus(annulus) => of_grid(annulus.elements),
            Self::Imported(mesh) => mesh.element_count() as u64,
        }
    }

    /// Gauss points of one element.
    pub fn points_per_element(&self) -> usize {
        self.element().plane().point_count()
    }

    /// Gauss points of all elements.
    pub fn point_count(&self) -> u64 {
        self.element_count() * self.points_per_element() as u64
    }
}
