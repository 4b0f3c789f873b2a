//! From the contents of a file to a mesh.

use std::collections::BTreeMap;

use solver_fem::mesh::{Facet, Mesh, MeshProblem};

use super::error::{GmshError, GmshErrors};
use super::imported::Imported;
use super::kinds::{
    Kind, LINE2, LINE3, QUADRANGLE4, QUADRANGLE8, QUADRANGLE9, TRIANGLE3, TRIANGLE6,
};
use super::raw::{Raw, RawElement};
use crate::input::document::Element;

/// The most elements of one mesh.
pub const MOST_ELEMENTS: usize = 1_000_000;
/// The most faults that are told of one file.
const MOST_FAULTS: usize = 50;
/// How far from the plane of the first node others may lie, over the size of the mesh.
const OUT_OF_PLANE: f64 = 1e-9;

/// The mesh of a file; `file` is the name that it keeps.
pub fn build(raw: Raw, file: &str) -> Result<Imported, GmshErrors> {
    let kind = plane_kind(&raw)?;
    let mut builder = Builder::new(&raw, kind)?;
    builder.check_plane(&raw)?;
    builder.sides();
    builder.name_groups(&raw)?;
    builder.collect_groups(&raw);
    builder.check();
    if !builder.faults.is_empty() {
        builder.faults.truncate(MOST_FAULTS);
        return Err(GmshErrors(builder.faults));
    }
    let numbers = |list: Vec<usize>| list.into_iter().map(|n| n as u32).collect::<Vec<_>>();
    let facets = |list: Vec<Facet>| {
        let pairs = list.into_iter();
        pairs
            .map(|facet| [facet.element as u32, facet.local as u32])
            .collect()
    };
    let mesh = builder.mesh;
    Ok(Imported {
        file: file.to_owned(),
        element: builder.element,
        nodes: mesh.nodes,
        connectivity: numbers(mesh.connectivity),
        boundaries: mesh
            .boundaries
            .into_iter()
            .map(|(name, list)| (name, facets(list)))
            .collect(),
        node_sets: mesh
            .node_sets
            .into_iter()
            .map(|(name, list)| (name, numbers(list)))
            .collect(),
        groups: builder
            .groups
            .into_iter()
            .map(|(name, list)| (name, numbers(list)))
            .collect(),
    })
}

/// The one kind of plane element in the file, if it is one that is computed with.
fn plane_kind(raw: &Raw) -> Result<Kind, GmshError> {
    if let Some(volume) = raw.elements.iter().find(|e| e.kind.dimension == 3) {
        return Err(GmshError::Volume {
            element: volume.tag,
            kind: volume.kind.name,
        });
    }
    let mut plane = raw.elements.iter().filter(|e| e.kind.dimension == 2);
    let first = plane.next().ok_or(GmshError::NoPlaneElements)?;
    if let Some(other) = plane.find(|e| e.kind != first.kind) {
        return Err(GmshError::Mixed {
            first: first.tag,
            first_kind: first.kind.name,
            second: other.tag,
            second_kind: other.kind.name,
        });
    }
    let why = match first.kind.number {
        QUADRANGLE4 | QUADRANGLE8 | QUADRANGLE9 | TRIANGLE6 => return Ok(first.kind),
        TRIANGLE3 => ", which locks where volume is kept",
        _ => ", of an order that is not computed with",
    };
    Err(GmshError::Unsupported {
        element: first.tag,
        kind: first.kind.name,
        why,
    })
}

/// A mesh while it is made.
struct Builder {
    element: Element,
    mesh: Mesh<2>,
    /// Groups of elements.
    groups: BTreeMap<String, Vec<usize>>,
    /// Numbers in the file of the mesh's nodes and elements.
    node_tags: Vec<u64>,
    element_tags: Vec<u64>,
    /// Numbers of the mesh by those of the file: nodes sorted by the latter, `None` where no element uses it.
    by_tag: Vec<(u64, Option<usize>)>,
    /// Physical groups of each element.
    element_groups: Vec<Vec<u32>>,
    sides: BTreeMap<[usize; 2], Vec<Facet>>,
    names: BTreeMap<(u8, u32), String>,
    faults: Vec<GmshError>,
}

impl Builder {
    /// The elements, turned counter-clockwise, and the nodes that they use.
    fn new(raw: &Raw, kind: Kind) -> Result<Self, GmshError> {
        // The centre of a nine-node quadrangle is left out.
        let (element, count) = match kind.number {
            QUADRANGLE4 => (Element::Q4, 4),
            TRIANGLE6 => (Element::T6, 6),
            _ => (Element::Q8, 8),
        };
        let mut places: Vec<(u64, usize)> = raw
            .nodes
            .iter()
            .enumerate()
            .map(|(place, (tag, _))| (*tag, place))
            .collect();
        places.sort_unstable();
        if let Some(twice) = places.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(GmshError::NodeTwice { node: twice[0].0 });
        }
        let place_of = |element: u64, node: u64| {
            let found = places.binary_search_by_key(&node, |&(tag, _)| tag);
            let found = found.map_err(|_| GmshError::UnknownNode { element, node })?;
            Ok(places[found].1)
        };
        // Format 2.2 writes an element once for each of its groups.
        let mut seen: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
        let (mut connectivity, mut element_tags) = (Vec::new(), Vec::new());
        let mut element_groups: Vec<Vec<u32>> = Vec::new();
        for raw_element in raw.elements.iter().filter(|e| e.kind.dimension == 2) {
            let tags = raw_element.nodes.iter().take(count);
            let nodes: Vec<usize> = tags
                .map(|&node| place_of(raw_element.tag, node))
                .collect::<Result<_, _>>()?;
            let mut key = nodes.clone();
            key.sort_unstable();
            let number = *seen.entry(key).or_insert_with(|| {
                connectivity.extend(nodes);
                element_tags.push(raw_element.tag);
                element_groups.push(Vec::new());
                element_groups.len() - 1
            });
            element_groups[number].extend(raw_element.groups.iter());
        }
        if element_tags.len() > MOST_ELEMENTS {
            return Err(GmshError::TooMany {
                found: element_tags.len(),
                most: MOST_ELEMENTS,
            });
        }
        let mut used = vec![None; raw.nodes.len()];
        for &place in &connectivity {
            used[place] = Some(0);
        }
        let (mut nodes, mut node_tags) = (Vec::new(), Vec::new());
        for (mark, (tag, [x, y, _])) in used.iter_mut().zip(&raw.nodes) {
            if let Some(number) = mark {
                *number = nodes.len();
                nodes.push([*x, *y]);
                node_tags.push(*tag);
            }
        }
        for place in &mut connectivity {
            *place = used[*place].unwrap_or_default();
        }
        for element in connectivity.chunks_exact_mut(count) {
            if is_clockwise(element, &nodes, count) {
                turn(element);
            }
        }
        let by_tag = places
            .into_iter()
            .map(|(tag, place)| (tag, used[place]))
            .collect();
        let elements = element_tags.len();
        Ok(Self {
            element,
            mesh: Mesh {
                nodes,
                nodes_per_element: count,
                connectivity,
                regions: vec![0; elements],
                region_names: vec!["default".into()],
                boundaries: BTreeMap::new(),
                node_sets: BTreeMap::new(),
            },
            groups: BTreeMap::new(),
            node_tags,
            element_tags,
            by_tag,
            element_groups,
            sides: BTreeMap::new(),
            names: BTreeMap::new(),
            faults: Vec::new(),
        })
    }

    /// All used nodes lie in one plane z = const.
    fn check_plane(&self, raw: &Raw) -> Result<(), GmshError> {
        let tolerance = OUT_OF_PLANE * self.mesh.diameter();
        let mut used = raw
            .nodes
            .iter()
            .filter(|(tag, _)| self.node(*tag).is_some());
        let Some((_, [_, _, plane])) = used.next() else {
            return Ok(());
        };
        match used.find(|(_, [_, _, z])| (z - plane).abs() > tolerance) {
            None => Ok(()),
            Some((node, [_, _, z])) => Err(GmshError::NotPlane {
                node: *node,
                z: *z,
                plane: *plane,
            }),
        }
    }

    /// The node of the mesh that has this number in the file; `None` where no element uses it.
    fn node(&self, tag: u64) -> Option<usize> {
        let found = self.by_tag.binary_search_by_key(&tag, |&(tag, _)| tag);
        self.by_tag[found.ok()?].1
    }

    fn sides(&mut self) {
        self.sides = self.mesh.sides(self.element.plane().element().as_ref());
    }

    /// A name for every group that an element is in; what conditions can mean must have one name.
    fn name_groups(&mut self, raw: &Raw) -> Result<(), GmshErrors> {
        const WHAT: [&str; 3] = ["points", "lines", "surfaces"];
        const UNNAMED: [&str; 3] = ["point", "curve", "surface"];
        let own = |element: &RawElement| {
            let dimension = element.kind.dimension;
            let groups = element.groups.to_vec();
            groups.into_iter().map(move |group| (dimension, group))
        };
        let mut used: Vec<(u8, u32)> = raw.elements.iter().flat_map(own).collect();
        used.sort_unstable();
        used.dedup();
        let mut taken: BTreeMap<(bool, String), &'static str> = BTreeMap::new();
        for (dimension, number) in used {
            let place = usize::from(dimension.min(2));
            let name = raw.names.get(&(dimension, number));
            let name = name.map_or_else(|| format!("{}_{number}", UNNAMED[place]), String::clone);
            // Surfaces are named in regions, lines and points in conditions.
            if let Some(first) = taken.insert((dimension == 2, name.clone()), WHAT[place]) {
                self.faults.push(GmshError::NameTwice {
                    name: name.clone(),
                    first,
                    second: WHAT[place],
                });
            }
            self.names.insert((dimension, number), name);
        }
        match self.faults.is_empty() {
            true => Ok(()),
            false => Err(GmshErrors(std::mem::take(&mut self.faults))),
        }
    }

    fn name(&self, dimension: u8, group: u32) -> String {
        let name = self.names.get(&(dimension, group));
        name.cloned().unwrap_or_default()
    }

    /// Lines become boundaries, or node sets where one of them lies inside; points become node sets.
    fn collect_groups(&mut self, raw: &Raw) {
        for element in 0..self.element_groups.len() {
            for group in std::mem::take(&mut self.element_groups[element]) {
                let name = self.name(2, group);
                self.groups.entry(name).or_default().push(element);
            }
        }
        let mut lines: BTreeMap<String, (Vec<Facet>, Vec<usize>)> = BTreeMap::new();
        for element in raw.elements.iter().filter(|e| e.kind.dimension < 2) {
            for &group in element.groups.iter() {
                let name = self.name(element.kind.dimension, group);
                if element.kind.dimension == 0 {
                    self.point(element, name);
                } else {
                    self.line(element, name, &mut lines);
                }
            }
        }
        for (name, (facets, nodes)) in lines {
            let is_inside = |facet: &Facet| self.users(*facet).is_some_and(|users| users > 1);
            if facets.iter().any(is_inside) {
                self.mesh.node_sets.insert(name, nodes);
            } else {
                self.mesh.boundaries.insert(name, facets);
            }
        }
        let lists = self
            .groups
            .values_mut()
            .chain(self.mesh.node_sets.values_mut());
        lists.for_each(|list| {
            list.sort_unstable();
            list.dedup();
        });
        self.mesh.boundaries.values_mut().for_each(|list| {
            list.sort_unstable();
            list.dedup();
        });
    }

    fn point(&mut self, element: &RawElement, group: String) {
        match element.nodes.first().and_then(|&tag| self.node(tag)) {
            Some(node) => self.mesh.node_sets.entry(group).or_default().push(node),
            None => self.faults.push(GmshError::StrayPoint {
                node: element.nodes.first().copied().unwrap_or_default(),
                group,
            }),
        }
    }

    fn line(
        &mut self,
        element: &RawElement,
        group: String,
        lines: &mut BTreeMap<String, (Vec<Facet>, Vec<usize>)>,
    ) {
        let nodes: Option<Vec<usize>> = element.nodes.iter().map(|&tag| self.node(tag)).collect();
        let wanted = if self.element == Element::Q4 {
            LINE2
        } else {
            LINE3
        };
        let facet = nodes
            .as_ref()
            .filter(|_| element.kind.number == wanted)
            .and_then(|nodes| {
                self.sides
                    .get(&[nodes[0].min(nodes[1]), nodes[0].max(nodes[1])])
            })
            .and_then(|users| users.first().copied())
            .filter(|&facet| {
                nodes
                    .iter()
                    .flatten()
                    .all(|node| self.facet_nodes(facet).contains(node))
            });
        let (Some(facet), Some(nodes)) = (facet, nodes) else {
            let line = element.tag;
            self.faults.push(GmshError::StrayLine { line, group });
            return;
        };
        let (facets, all) = lines.entry(group).or_default();
        facets.push(facet);
        all.extend(nodes);
    }

    /// Number of elements that have the side.
    fn users(&self, facet: Facet) -> Option<usize> {
        let nodes = self.facet_nodes(facet);
        let (a, b) = (nodes[0], nodes[1]);
        Some(self.sides.get(&[a.min(b), a.max(b)])?.len())
    }

    fn facet_nodes(&self, facet: Facet) -> Vec<usize> {
        let element = self.element.plane().element();
        let nodes = self.mesh.element(facet.element);
        let local = element.facet_nodes(facet.local).iter();
        local.map(|&a| nodes[a]).collect()
    }

    /// What the solver finds wrong, in the numbers of the file.
    fn check(&mut self) {
        let element = self.element.plane().element();
        let mut problems = self.mesh.check(element.as_ref());
        if problems.is_empty() {
            problems = self.mesh.check_conformity(element.as_ref());
        }
        problems.truncate(MOST_FAULTS);
        for problem in problems {
            let (elements, nodes) = named(&problem);
            let tags = |numbers: Vec<usize>, tags: &[u64]| {
                numbers
                    .into_iter()
                    .filter_map(|n| tags.get(n).copied())
                    .collect()
            };
            self.faults.push(GmshError::Mesh {
                elements: tags(elements, &self.element_tags),
                nodes: tags(nodes, &self.node_tags),
                problem,
            });
        }
    }
}

/// The elements and nodes that a fault names.
fn named(problem: &MeshProblem) -> (Vec<usize>, Vec<usize>) {
    match problem {
        MeshProblem::RepeatedNode { element, node }
        | MeshProblem::Folded { element, node }
        | MeshProblem::HangingNode { element, node } => (vec![*element], vec![*node]),
        MeshProblem::ZeroArea { element }
        | MeshProblem::Inverted { element, .. }
        | MeshProblem::LoosePiece { element, .. } => (vec![*element], vec![]),
        MeshProblem::CoincidentNodes { nodes } => (vec![], nodes.to_vec()),
        MeshProblem::OverfullSide { nodes, elements } => (elements.clone(), nodes.to_vec()),
        MeshProblem::Overlap { elements } => (elements.to_vec(), vec![]),
        _ => (vec![], vec![]),
    }
}

/// Whether the polygon of the corners is run through clockwise: 2A = Σ x_a y_{a+1} − x_{a+1} y_a < 0.
fn is_clockwise(element: &[usize], nodes: &[[f64; 2]], count: usize) -> bool {
    let corners = if count == 6 { 3 } else { 4 };
    let origin = nodes[element[0]];
    let relative = |a: usize| {
        let [x, y] = nodes[element[a % corners]];
        [x - origin[0], y - origin[1]]
    };
    let twice: f64 = (0..corners)
        .map(|a| {
            let ([x, y], [u, v]) = (relative(a), relative(a + 1));
            x * v - u * y
        })
        .sum();
    twice < 0.0
}

/// The same element run through the other way: corner 0 stays, and middles stay on their sides.
fn turn(element: &mut [usize]) {
    match element.len() {
        4 => element.swap(1, 3),
        6 => {
            element.swap(1, 2);
            element.swap(3, 5);
        }
        _ => {
            element.swap(1, 3);
            element.swap(4, 7);
            element.swap(5, 6);
        }
    }
}
