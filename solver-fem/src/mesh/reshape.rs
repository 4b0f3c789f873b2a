//! Other elements on the grid of a structured Q8 mesh.

use super::{Facet, Mesh};

/// A triangle cut from a quadrilateral: its nodes as local nodes of the quadrilateral (8 is the middle), and for each
/// of its sides the side of the quadrilateral that it is.
struct Triangle {
    nodes: [usize; 6],
    sides: [Option<usize>; 3],
}

/// Cut from corner 0 to corner 2.
const RISING: [Triangle; 2] = [
    Triangle {
        nodes: [0, 1, 2, 4, 5, 8],
        sides: [Some(0), Some(1), None],
    },
    Triangle {
        nodes: [0, 2, 3, 8, 6, 7],
        sides: [None, Some(2), Some(3)],
    },
];
/// Cut from corner 1 to corner 3.
const FALLING: [Triangle; 2] = [
    Triangle {
        nodes: [0, 1, 3, 4, 8, 7],
        sides: [Some(0), None, Some(3)],
    },
    Triangle {
        nodes: [1, 2, 3, 5, 6, 8],
        sides: [Some(1), Some(2), None],
    },
];

impl Mesh<2> {
    /// A mesh of Q8 as one of Q4 on the same corners: the nodes in the middle of sides go, and the others keep their
    /// order. Node sets lose what goes; one of which nothing is left is dropped. Anything but a mesh of Q8 is returned
    /// as it is.
    pub fn into_linear(mut self) -> Self {
        if self.nodes_per_element != 8 {
            return self;
        }
        let corners: Vec<usize> = self
            .connectivity
            .chunks_exact(8)
            .flat_map(|element| element[..4].iter().copied())
            .collect();
        let mut kept = vec![None; self.nodes.len()];
        for &node in &corners {
            kept[node] = Some(());
        }
        let mut count = 0..;
        let number: Vec<Option<usize>> = kept
            .into_iter()
            .map(|kept| kept.and_then(|()| count.next()))
            .collect();
        let nodes = self.nodes.into_iter().zip(&number);
        self.nodes = nodes
            .filter_map(|(node, number)| number.map(|_| node))
            .collect();
        self.connectivity = corners.iter().filter_map(|&node| number[node]).collect();
        self.nodes_per_element = 4;
        for set in self.node_sets.values_mut() {
            *set = set.iter().filter_map(|&node| number[node]).collect();
        }
        self.node_sets.retain(|_, set| !set.is_empty());
        self
    }

    /// A mesh of Q8 in rows of `per_row` as one of T6: element e becomes the triangles 2e and 2e+1. The cuts alternate
    /// like the fields of a chessboard, so that the mesh prefers neither diagonal. Nodes keep their numbers, the middles
    /// of the cuts follow. Anything but a mesh of Q8 is returned as it is.
    pub fn into_triangles(mut self, per_row: usize) -> Self {
        if self.nodes_per_element != 8 {
            return self;
        }
        let mut connectivity = Vec::with_capacity(12 * self.element_count());
        // Where each side of each quadrilateral went.
        let mut sides = vec![[None; 4]; self.element_count()];
        for (element, quad) in self.connectivity.chunks_exact(8).enumerate() {
            let (row, column) = (element / per_row.max(1), element % per_row.max(1));
            let cut = if (row + column) % 2 == 0 {
                RISING
            } else {
                FALLING
            };
            let middle = self.nodes.len();
            self.nodes.push(middle_of(quad, &self.nodes));
            for (half, triangle) in cut.iter().enumerate() {
                connectivity.extend(
                    triangle
                        .nodes
                        .map(|local| quad.get(local).copied().unwrap_or(middle)),
                );
                for (local, side) in triangle.sides.iter().enumerate() {
                    if let Some(side) = side {
                        sides[element][*side] = Some(Facet {
                            element: 2 * element + half,
                            local,
                        });
                    }
                }
            }
        }
        self.connectivity = connectivity;
        self.nodes_per_element = 6;
        self.regions = self.regions.iter().flat_map(|&r| [r, r]).collect();
        for facets in self.boundaries.values_mut() {
            *facets = facets
                .iter()
                .filter_map(|facet| sides[facet.element][facet.local])
                .collect();
        }
        self
    }
}

/// The serendipity mapping at ξ = η = 0: half the middles of the sides less a quarter of the corners.
fn middle_of(quad: &[usize], nodes: &[[f64; 2]]) -> [f64; 2] {
    let mut middle = [0.0; 2];
    for (local, &node) in quad.iter().enumerate() {
        let weight = if local < 4 { -0.25 } else { 0.5 };
        for i in 0..2 {
            middle[i] += weight * nodes[node][i];
        }
    }
    middle
}
