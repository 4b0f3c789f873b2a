//! What can be wrong with a mesh, all of it at once.

use thiserror::Error;

use super::Mesh;
use crate::element::Element;
use crate::tensor;

/// One fault of a mesh.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum MeshProblem {
    /// There is nothing to compute on.
    #[error("the mesh has no element")]
    NoElements,
    /// Connectivity and element kind disagree.
    #[error("the connectivity has {found} nodes per element, a {kind} has {expected}")]
    WrongElementKind {
        /// Name of the element.
        kind: &'static str,
        /// Nodes the element has.
        expected: usize,
        /// Nodes the mesh gives.
        found: usize,
    },
    /// The arrays of the mesh do not fit together.
    #[error("the list of regions has {found} entries for {expected} elements")]
    RegionCount {
        /// Number of elements.
        expected: usize,
        /// Length of the list.
        found: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("node {node} has a coordinate that is not a finite number")]
    NonFiniteCoordinate {
        /// The node.
        node: usize,
    },
    /// An element refers to a node that does not exist.
    #[error("element e{element} refers to node {node}, the mesh has {count}")]
    UnknownNode {
        /// The element.
        element: usize,
        /// The node asked for.
        node: usize,
        /// Number of nodes.
        count: usize,
    },
    /// An element uses a node twice.
    #[error("element e{element} uses node {node} twice")]
    RepeatedNode {
        /// The element.
        element: usize,
        /// The node.
        node: usize,
    },
    /// No element uses a node, so it has no stiffness.
    #[error("node {node} belongs to no element")]
    UnusedNode {
        /// The node.
        node: usize,
    },
    /// An element has no volume.
    #[error("element e{element} has zero area")]
    ZeroArea {
        /// The element.
        element: usize,
    },
    /// The mapping of an element folds over.
    #[error(
        "element e{element} is inverted or too distorted (the mapping folds over at its Gauss point {point})"
    )]
    Inverted {
        /// The element.
        element: usize,
        /// The local Gauss point with the smallest Jacobian determinant.
        point: usize,
    },
    /// The mapping of an element folds over at a corner, though not at its Gauss points.
    #[error("element e{element} folds over at its node {node}: the angle there is not convex")]
    Folded {
        /// The element.
        element: usize,
        /// The corner node.
        node: usize,
    },
    /// Two nodes are at the same place, so that the body is open there.
    #[error("nodes {} and {} are at the same place; the body would be cut open there", .nodes[0], .nodes[1])]
    CoincidentNodes {
        /// Both, ascending.
        nodes: [usize; 2],
    },
    /// More than two elements share a side.
    #[error("the side from node {} to node {} belongs to {} elements (e{}, …), which lie upon one another", .nodes[0], .nodes[1], .elements.len(), .elements[0])]
    OverfullSide {
        /// Its ends, ascending.
        nodes: [usize; 2],
        /// The elements.
        elements: Vec<usize>,
    },
    /// Two elements lie on the same side of the side they share.
    #[error("elements e{} and e{} lie upon one another: both are on the same side of their common edge", .elements[0], .elements[1])]
    Overlap {
        /// Both.
        elements: [usize; 2],
    },
    /// A node lies on the side of an element that does not have it.
    #[error("node {node} lies on a side of element e{element} without being one of its nodes")]
    HangingNode {
        /// The element.
        element: usize,
        /// The node.
        node: usize,
    },
    /// Some elements share no node with the others.
    #[error("{count} elements (e{element}, …) share no node with the rest of the body")]
    LoosePiece {
        /// The first of them.
        element: usize,
        /// How many.
        count: usize,
    },
    /// An element names a region that does not exist.
    #[error("element e{element} is in region {region}, there are {count}")]
    UnknownRegion {
        /// The element.
        element: usize,
        /// The region index.
        region: usize,
        /// Number of regions.
        count: usize,
    },
    /// A boundary without sides, or a node set without nodes.
    #[error("`{name}` is empty")]
    Empty {
        /// Name of the boundary or node set.
        name: String,
    },
    /// A boundary or node set refers to something that does not exist.
    #[error("`{name}` refers to an element side or node that does not exist")]
    Dangling {
        /// Name of the boundary or node set.
        name: String,
    },
}

impl<const D: usize> Mesh<D> {
    /// Every fault of the mesh for the given element, in a fixed order; empty when it is sound.
    pub fn check(&self, element: &dyn Element<D>) -> Vec<MeshProblem> {
        let mut problems = Vec::new();
        if self.element_count() == 0 {
            problems.push(MeshProblem::NoElements);
        }
        let nodes = element.node_count();
        if self.nodes_per_element != nodes || !self.connectivity.len().is_multiple_of(nodes.max(1))
        {
            problems.push(MeshProblem::WrongElementKind {
                kind: element.name(),
                expected: nodes,
                found: self.nodes_per_element,
            });
            // Everything below would misread the connectivity.
            return problems;
        }
        self.check_references(&mut problems);
        self.check_shapes(element, &mut problems);
        self.check_sets(element, &mut problems);
        problems
    }

    fn check_references(&self, problems: &mut Vec<MeshProblem>) {
        for (node, position) in self.nodes.iter().enumerate() {
            if position.iter().any(|x| !x.is_finite()) {
                problems.push(MeshProblem::NonFiniteCoordinate { node });
            }
        }
        let count = self.nodes.len();
        let mut used = vec![false; count];
        for element in 0..self.element_count() {
            let nodes = self.element(element);
            for (position, &node) in nodes.iter().enumerate() {
                match used.get_mut(node) {
                    Some(flag) => *flag = true,
                    None => problems.push(MeshProblem::UnknownNode {
                        element,
                        node,
                        count,
                    }),
                }
                if nodes[..position].contains(&node) {
                    problems.push(MeshProblem::RepeatedNode { element, node });
                }
            }
        }
        for (node, used) in used.into_iter().enumerate() {
            if !used {
                problems.push(MeshProblem::UnusedNode { node });
            }
        }
        if self.regions.len() != self.element_count() {
            problems.push(MeshProblem::RegionCount {
                expected: self.element_count(),
                found: self.regions.len(),
            });
        }
        let count = self.region_names.len();
        for (element, &region) in self.regions.iter().enumerate() {
            if region >= count {
                problems.push(MeshProblem::UnknownRegion {
                    element,
                    region,
                    count,
                });
            }
        }
    }

    fn check_shapes(&self, element: &dyn Element<D>, problems: &mut Vec<MeshProblem>) {
        let rule = element.quadrature();
        let mut gradients = vec![[0.0; D]; element.node_count()];
        for number in 0..self.element_count() {
            let nodes = self.element(number);
            if nodes.iter().any(|&node| node >= self.nodes.len()) {
                continue;
            }
            // Small against a box around the element: free of units.
            let mut size: f64 = 0.0;
            for &a in nodes {
                for i in 0..D {
                    size = size.max((self.nodes[a][i] - self.nodes[nodes[0]][i]).abs());
                }
            }
            let (mut volume, mut smallest, mut worst) = (0.0, f64::INFINITY, 0);
            let mut determinant_at = |xi: &[f64; D]| {
                element.shape_gradients(xi, &mut gradients);
                let mut jacobian = tensor::zero::<D>();
                for (a, &node) in nodes.iter().enumerate() {
                    for i in 0..D {
                        for j in 0..D {
                            jacobian[i][j] += self.nodes[node][i] * gradients[a][j];
                        }
                    }
                }
                tensor::determinant(&jacobian)
            };
            for (local, point) in rule.iter().enumerate() {
                let determinant = determinant_at(&point.xi);
                volume += determinant * point.weight;
                if determinant < smallest {
                    (smallest, worst) = (determinant, local);
                }
            }
            let negligible = 1e-12 * (0..D).map(|_| size).product::<f64>();
            if !volume.is_finite() {
                continue;
            }
            if volume.abs() <= negligible {
                problems.push(MeshProblem::ZeroArea { element: number });
            } else if smallest <= negligible {
                problems.push(MeshProblem::Inverted {
                    element: number,
                    point: worst,
                });
            } else {
                // A determinant of zero is what a middle node at the quarter of its side makes on purpose.
                let corners = element.node_positions()[..element.corner_count()].iter();
                let folded = corners
                    .zip(nodes)
                    .find(|(xi, _)| determinant_at(xi) < -negligible);
                if let Some((_, &node)) = folded {
                    problems.push(MeshProblem::Folded {
                        element: number,
                        node,
                    });
                }
            }
        }
    }

    fn check_sets(&self, element: &dyn Element<D>, problems: &mut Vec<MeshProblem>) {
        for (name, facets) in &self.boundaries {
            if facets.is_empty() {
                problems.push(MeshProblem::Empty { name: name.clone() });
            }
            let (elements, sides) = (self.element_count(), element.facet_count());
            if facets
                .iter()
                .any(|facet| facet.element >= elements || facet.local >= sides)
            {
                problems.push(MeshProblem::Dangling { name: name.clone() });
            }
        }
        for (name, nodes) in &self.node_sets {
            if nodes.is_empty() {
                problems.push(MeshProblem::Empty { name: name.clone() });
            }
            if nodes.iter().any(|&node| node >= self.nodes.len()) {
                problems.push(MeshProblem::Dangling { name: name.clone() });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Q8;
    use crate::mesh::Rectangle;

    #[test]
    fn every_fault_is_named_at_once() {
        let rectangle = Rectangle {
            size: [2.0, 1.0],
            elements: [2, 1],
        };
        let mut mesh = Mesh::rectangle(&rectangle).expect("sound");
        assert_eq!(mesh.check(&Q8::default()), vec![]);
        mesh.boundaries.insert("nowhere".into(), vec![]);
        mesh.node_sets.insert("beyond".into(), vec![999]);
        for node in mesh.element(1).to_vec() {
            mesh.nodes[node][1] = 0.0;
        }
        let problems = mesh.check(&Q8::default());
        assert!(problems.contains(&MeshProblem::ZeroArea { element: 1 }));
        assert!(problems.contains(&MeshProblem::Empty {
            name: "nowhere".into()
        }));
        assert!(problems.contains(&MeshProblem::Dangling {
            name: "beyond".into()
        }));
        assert_eq!(
            MeshProblem::ZeroArea { element: 1 }.to_string(),
            "element e1 has zero area",
            "users see this text"
        );
    }

    #[test]
    fn a_clockwise_element_is_named_inverted() {
        let rectangle = Rectangle {
            size: [1.0, 1.0],
            elements: [1, 1],
        };
        let mut mesh = Mesh::rectangle(&rectangle).expect("sound");
        for node in &mut mesh.nodes {
            node[0] = -node[0];
        }
        assert!(matches!(
            mesh.check(&Q8::default())[..],
            [MeshProblem::Inverted { element: 0, .. }]
        ));
    }
}
