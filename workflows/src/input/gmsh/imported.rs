//! The mesh as a run stores it: nothing of the file is needed any more.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use solver_fem::mesh::{Facet, Mesh};

use crate::input::document::Element;

/// A mesh from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Imported {
    /// The file, as the input names it.
    pub file: String,
    /// The kind of its elements.
    pub element: Element,
    /// Nodes, in the order of the file.
    pub nodes: Vec<[f64; 2]>,
    /// Nodes of the elements, one element after the other, in the order of the file.
    pub connectivity: Vec<u32>,
    /// Groups of lines on the boundary: element and its side, ascending.
    pub boundaries: BTreeMap<String, Vec<[u32; 2]>>,
    /// Groups of points, and of lines inside the body: their nodes, ascending.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Groups of surfaces: their elements, ascending. An element may be in several.
    pub groups: BTreeMap<String, Vec<u32>>,
}

impl Imported {
    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.connectivity.len() / self.element.plane().node_count()
    }

    /// The mesh for the macro solver.
    pub fn mesh(&self) -> Mesh<2> {
        let numbers = |list: &[u32]| list.iter().map(|&n| n as usize).collect::<Vec<_>>();
        let facets = |list: &[[u32; 2]]| {
            list.iter()
                .map(|&[element, local]| Facet {
                    element: element as usize,
                    local: local as usize,
                })
                .collect()
        };
        Mesh {
            nodes: self.nodes.clone(),
            nodes_per_element: self.element.plane().node_count(),
            connectivity: numbers(&self.connectivity),
            regions: vec![0; self.element_count()],
            region_names: vec!["default".into()],
            boundaries: self
                .boundaries
                .iter()
                .map(|(name, list)| (name.clone(), facets(list)))
                .collect(),
            node_sets: self
                .node_sets
                .iter()
                .map(|(name, list)| (name.clone(), numbers(list)))
                .collect(),
        }
    }

    /// In a line, with what tells two meshes apart.
    pub fn in_words(&self) -> String {
        format!(
            "{}, {} nodes, fingerprint {:016x}",
            self.file,
            self.nodes.len(),
            self.fingerprint()
        )
    }

    /// FNV-1a over coordinates, elements and groups: tells meshes apart that differ by mistake, not by intent.
    fn fingerprint(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bytes: &[u8]| {
            for &byte in bytes {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for x in self.nodes.iter().flatten() {
            add(&x.to_bits().to_le_bytes());
        }
        for node in &self.connectivity {
            add(&node.to_le_bytes());
        }
        for (name, sides) in &self.boundaries {
            add(name.as_bytes());
            sides.iter().flatten().for_each(|n| add(&n.to_le_bytes()));
        }
        for (name, list) in self.node_sets.iter().chain(&self.groups) {
            add(name.as_bytes());
            list.iter().for_each(|n| add(&n.to_le_bytes()));
        }
        hash
    }
}
