//! Meshes: nodes, elements, regions, named boundaries and named node sets.

mod check;
mod conformity;
mod region;
mod reshape;
mod structured;

use std::collections::BTreeMap;

pub use check::MeshProblem;
pub use region::UnknownElement;
pub use structured::{Annulus, AnnulusExtent, BuildError, Rectangle};

/// One side of one element.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Facet {
    /// Element number.
    pub element: usize,
    /// Local facet number, as [`crate::element::Element::facet_nodes`] counts.
    pub local: usize,
}

/// A mesh of one kind of element in its initial configuration.
#[derive(Clone, PartialEq, Debug)]
pub struct Mesh<const D: usize> {
    /// Initial coordinates of every node, in the user's length unit.
    pub nodes: Vec<[f64; D]>,
    /// Number of nodes of one element.
    pub nodes_per_element: usize,
    /// Node numbers, element after element, in the order of the reference element.
    pub connectivity: Vec<usize>,
    /// Region of every element, an index into [`region_names`](Self::region_names).
    pub regions: Vec<usize>,
    /// Names of the regions; region 0 is what was never assigned.
    pub region_names: Vec<String>,
    /// Named sets of element sides.
    pub boundaries: BTreeMap<String, Vec<Facet>>,
    /// Named sets of nodes, ascending.
    pub node_sets: BTreeMap<String, Vec<usize>>,
}

impl<const D: usize> Mesh<D> {
    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.connectivity
            .len()
            .checked_div(self.nodes_per_element)
            .unwrap_or(0)
    }

    /// Nodes of an element. `element` must be smaller than [`element_count`](Self::element_count).
    pub fn element(&self, element: usize) -> &[usize] {
        let size = self.nodes_per_element;
        &self.connectivity[element * size..(element + 1) * size]
    }

    /// Initial coordinates, node after node: the flat form in which positions travel.
    pub fn flat_coordinates(&self) -> Vec<f64> {
        self.nodes.iter().flatten().copied().collect()
    }

    /// Mean position of the nodes of an element.
    pub fn element_centre(&self, element: usize) -> [f64; D] {
        let mut centre = [0.0; D];
        for &node in self.element(element) {
            for i in 0..D {
                centre[i] += self.nodes[node][i] / self.nodes_per_element as f64;
            }
        }
        centre
    }

    /// Diagonal of the box around the initial mesh: the length small displacements are judged by.
    pub fn diameter(&self) -> f64 {
        let mut square = 0.0;
        for i in 0..D {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for node in &self.nodes {
                low = low.min(node[i]);
                high = high.max(node[i]);
            }
            if high > low {
                square += (high - low) * (high - low);
            }
        }
        square.sqrt()
    }
}
