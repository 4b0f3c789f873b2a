//! Whether the elements of a plane mesh fit together: what a program that makes meshes can get wrong and the shape of
//! single elements does not show.

use std::collections::BTreeMap;

use super::{Facet, Mesh, MeshProblem};
use crate::element::Element;

/// Distances below this part of the mesh's diameter are none: far above the rounding of coordinates in files, far below
/// any element.
const COINCIDENT: f64 = 1e-9;

impl Mesh<2> {
    /// Faults between elements, in a fixed order: nodes that coincide, sides of more than two elements, sides turned
    /// against each other, nodes that hang on the side of another element, pieces that hang together nowhere. For a
    /// mesh that [`Mesh::check`] finds sound.
    pub fn check_conformity(&self, element: &dyn Element<2>) -> Vec<MeshProblem> {
        let mut problems = Vec::new();
        let tolerance = COINCIDENT * self.diameter();
        self.coincident_nodes(tolerance, &mut problems);
        // A node twice makes its sides open, which would be told again for each of them.
        if !problems.is_empty() {
            return problems;
        }
        let sides = self.sides(element);
        let mut open = Vec::new();
        for (key, users) in &sides {
            match users[..] {
                [facet] => open.push(facet),
                [a, b] => problems.extend(self.mismatch(element, a, b)),
                _ => problems.push(MeshProblem::OverfullSide {
                    nodes: [key[0], key[1]],
                    elements: users.iter().map(|facet| facet.element).collect(),
                }),
            }
        }
        self.hanging_nodes(element, &open, tolerance, &mut problems);
        self.loose_pieces(&mut problems);
        problems
    }

    /// Every side as its two end nodes, ascending, with the elements that have it.
    pub fn sides(&self, element: &dyn Element<2>) -> BTreeMap<[usize; 2], Vec<Facet>> {
        let mut sides: BTreeMap<[usize; 2], Vec<Facet>> = BTreeMap::new();
        for number in 0..self.element_count() {
            let nodes = self.element(number);
            for local in 0..element.facet_count() {
                let ends = element.facet_nodes(local);
                let (a, b) = (nodes[ends[0]], nodes[ends[1]]);
                sides.entry([a.min(b), a.max(b)]).or_default().push(Facet {
                    element: number,
                    local,
                });
            }
        }
        sides
    }

    fn coincident_nodes(&self, tolerance: f64, problems: &mut Vec<MeshProblem>) {
        let order = self.by_x(0..self.nodes.len());
        for (place, &a) in order.iter().enumerate() {
            let near = order[place + 1..]
                .iter()
                .take_while(|&&b| self.nodes[b][0] - self.nodes[a][0] <= tolerance);
            for &b in near {
                if (self.nodes[b][1] - self.nodes[a][1]).abs() <= tolerance {
                    problems.push(MeshProblem::CoincidentNodes {
                        nodes: [a.min(b), a.max(b)],
                    });
                }
            }
        }
    }

    /// What is wrong between two elements with a common side: both run along it in the same sense, or they have
    /// different nodes in its middle.
    fn mismatch(&self, element: &dyn Element<2>, a: Facet, b: Facet) -> Option<MeshProblem> {
        let nodes = |facet: Facet| {
            let nodes = self.element(facet.element);
            element.facet_nodes(facet.local).iter().map(|&k| nodes[k])
        };
        if nodes(a).next() == nodes(b).next() {
            return Some(MeshProblem::Overlap {
                elements: [a.element, b.element],
            });
        }
        let foreign = nodes(b).find(|node| nodes(a).all(|own| own != *node))?;
        Some(MeshProblem::HangingNode {
            element: a.element,
            node: foreign,
        })
    }

    /// A node of one open side that lies inside another one.
    fn hanging_nodes(
        &self,
        element: &dyn Element<2>,
        open: &[Facet],
        tolerance: f64,
        problems: &mut Vec<MeshProblem>,
    ) {
        let nodes_of = |facet: &Facet| {
            let nodes = self.element(facet.element);
            let local = element.facet_nodes(facet.local).iter();
            local.map(|&a| nodes[a]).collect::<Vec<_>>()
        };
        let mut on_open: Vec<usize> = open.iter().flat_map(nodes_of).collect();
        on_open.sort_unstable();
        on_open.dedup();
        let order = self.by_x(on_open.into_iter());
        let xs: Vec<f64> = order.iter().map(|&node| self.nodes[node][0]).collect();
        for facet in open {
            let own = nodes_of(facet);
            let (a, b) = (self.nodes[own[0]], self.nodes[own[1]]);
            let (low, high) = (a[0].min(b[0]) - tolerance, a[0].max(b[0]) + tolerance);
            let first = xs.partition_point(|&x| x < low);
            for &node in order[first..]
                .iter()
                .take_while(|&&node| self.nodes[node][0] <= high)
            {
                if !own.contains(&node) && is_between(self.nodes[node], a, b, tolerance) {
                    problems.push(MeshProblem::HangingNode {
                        element: facet.element,
                        node,
                    });
                }
            }
        }
    }

    fn loose_pieces(&self, problems: &mut Vec<MeshProblem>) {
        let mut parent: Vec<usize> = (0..self.nodes.len()).collect();
        fn root(parent: &mut [usize], mut node: usize) -> usize {
            while parent[node] != node {
                parent[node] = parent[parent[node]];
                node = parent[node];
            }
            node
        }
        for element in 0..self.element_count() {
            let nodes = self.element(element);
            let first = root(&mut parent, nodes[0]);
            for &node in &nodes[1..] {
                let other = root(&mut parent, node);
                parent[other] = first;
            }
        }
        if self.element_count() == 0 {
            return;
        }
        let main = root(&mut parent, self.element(0)[0]);
        let apart: Vec<usize> = (0..self.element_count())
            .filter(|&e| root(&mut parent, self.element(e)[0]) != main)
            .collect();
        if let Some(&element) = apart.first() {
            problems.push(MeshProblem::LoosePiece {
                element,
                count: apart.len(),
            });
        }
    }

    fn by_x(&self, nodes: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut order: Vec<usize> = nodes.collect();
        order.sort_by(|&a, &b| {
            self.nodes[a][0]
                .total_cmp(&self.nodes[b][0])
                .then(a.cmp(&b))
        });
        order
    }
}

/// Whether `x` lies on the straight line from `a` to `b` and at neither end.
fn is_between(x: [f64; 2], a: [f64; 2], b: [f64; 2], tolerance: f64) -> bool {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [x[0] - a[0], x[1] - a[1]];
    let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
    if length <= tolerance {
        return false;
    }
    let distance = (along[0] * from[1] - along[1] * from[0]).abs() / length;
    let position = (along[0] * from[0] + along[1] * from[1]) / length;
    distance <= tolerance && position > tolerance && position < length - tolerance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Q4;

    /// Two Q4 on the left, one as high as both on the right.
    fn hanging() -> Mesh<2> {
        Mesh {
            nodes: vec![
                [0.0, 0.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [0.0, 1.0],
                [1.0, 2.0],
                [0.0, 2.0],
                [3.0, 0.0],
                [3.0, 2.0],
            ],
            nodes_per_element: 4,
            connectivity: vec![0, 1, 2, 3, 3, 2, 4, 5, 1, 6, 7, 4],
            regions: vec![0; 3],
            region_names: vec!["default".into()],
            boundaries: BTreeMap::new(),
            node_sets: BTreeMap::new(),
        }
    }

    #[test]
    fn a_node_on_the_side_of_a_larger_element_is_found() {
        let mesh = hanging();
        assert_eq!(mesh.check(&Q4), vec![]);
        assert_eq!(
            mesh.check_conformity(&Q4),
            [MeshProblem::HangingNode {
                element: 2,
                node: 2
            }]
        );
    }

    #[test]
    fn pieces_that_only_seem_to_touch_are_found() {
        let mut mesh = hanging();
        // The right element with nodes of its own, at the same places.
        mesh.nodes.extend([[1.0, 0.0], [1.0, 2.0]]);
        mesh.connectivity[8] = 8;
        mesh.connectivity[11] = 9;
        assert_eq!(
            mesh.check_conformity(&Q4),
            [
                MeshProblem::CoincidentNodes { nodes: [1, 8] },
                MeshProblem::CoincidentNodes { nodes: [4, 9] }
            ]
        );
        // Apart.
        for node in [6, 7, 8, 9] {
            mesh.nodes[node][0] += 1.0;
        }
        assert_eq!(
            mesh.check_conformity(&Q4),
            [MeshProblem::LoosePiece {
                element: 2,
                count: 1
            }]
        );
    }

    #[test]
    fn an_element_upon_another_is_found() {
        let mut mesh = hanging();
        mesh.connectivity.extend([0, 1, 2, 3]);
        mesh.regions.push(0);
        let problems = mesh.check_conformity(&Q4);
        assert!(
            problems.contains(&MeshProblem::OverfullSide {
                nodes: [2, 3],
                elements: vec![0, 1, 3]
            }),
            "{problems:?}"
        );
        let overlap = MeshProblem::Overlap { elements: [0, 3] };
        assert!(problems.contains(&overlap), "{problems:?}");
    }

    #[test]
    fn neighbours_with_two_middle_nodes_on_one_side_are_found() {
        let rectangle = crate::mesh::Rectangle {
            size: [2.0, 1.0],
            elements: [2, 1],
        };
        let mut mesh = Mesh::rectangle(&rectangle).expect("sound");
        let q8 = crate::element::Q8::default();
        assert_eq!(mesh.check_conformity(&q8), vec![]);
        let new = mesh.nodes.len();
        mesh.nodes.push([1.0, 0.6]);
        mesh.connectivity[8 + 7] = new;
        assert_eq!(
            mesh.check_conformity(&q8),
            [MeshProblem::HangingNode {
                element: 0,
                node: new
            }]
        );
    }
}
