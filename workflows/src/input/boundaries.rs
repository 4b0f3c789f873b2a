//! The boundaries and nodes that a mesh names; those of a structured mesh are known before it is built.

use super::document::{Annulus, Element, Rectangle, Sector};
use super::gmsh::Imported;
use super::mesh::Mesh;

/// A named boundary or node.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Its name.
    pub name: String,
    /// Whether pressure and traction can act on it.
    pub kind: PlaceKind,
    /// Coordinates of the points that tell it apart: corners, middles, points on the axes. Each is a node of the mesh (up
    /// to rounding); two places meet where they share one.
    pub points: Vec<[f64; 2]>,
}

/// What a place is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// One node, or several.
    Node,
    /// A boundary on a straight line (or two) with the normal along this axis (0 is x).
    Straight(usize),
    /// A curved boundary.
    Curved,
}

/// All places of a mesh.
pub fn places(mesh: &Mesh) -> Vec<Place> {
    match mesh {
        Mesh::Rectangle(rectangle) => of_rectangle(rectangle),
        Mesh::Annulus(annulus) => of_annulus(annulus),
        Mesh::Imported(mesh) => of_file(mesh),
    }
}

/// A coordinate that differs less along a boundary, over the size of the mesh, is the same.
const STRAIGHT: f64 = 1e-9;

/// Boundaries and nodes by the names of their groups, with all their nodes.
fn of_file(mesh: &Imported) -> Vec<Place> {
    let built = mesh.mesh();
    let element = mesh.element.plane().element();
    let tolerance = STRAIGHT * built.diameter();
    let boundaries = built.boundaries.iter().map(|(name, facets)| {
        let mut nodes: Vec<usize> = facets
            .iter()
            .flat_map(|facet| {
                let nodes = built.element(facet.element);
                let local = element.facet_nodes(facet.local).iter();
                local.map(|&a| nodes[a]).collect::<Vec<_>>()
            })
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let points: Vec<[f64; 2]> = nodes.iter().map(|&node| built.nodes[node]).collect();
        let is_constant = |axis: &usize| {
            let first = points.first().map_or(0.0, |point| point[*axis]);
            let near = |point: &[f64; 2]| (point[*axis] - first).abs() <= tolerance;
            points.iter().all(near)
        };
        let kind = match (0..2).find(is_constant) {
            Some(normal) => PlaceKind::Straight(normal),
            None => PlaceKind::Curved,
        };
        place(name, kind, points)
    });
    let sets = built.node_sets.iter().map(|(name, nodes)| {
        let points: Vec<[f64; 2]> = nodes.iter().map(|&node| built.nodes[node]).collect();
        place(name, PlaceKind::Node, points)
    });
    boundaries.chain(sets).collect()
}

fn place(name: impl Into<String>, kind: PlaceKind, points: impl Into<Vec<[f64; 2]>>) -> Place {
    Place {
        name: name.into(),
        kind,
        points: points.into(),
    }
}

fn of_rectangle(rectangle: &Rectangle) -> Vec<Place> {
    use PlaceKind::{Node, Straight};
    let [w, h] = rectangle.size;
    // In the middle of a side of Q4 there is a node for an even number of elements only.
    let [mid_x, mid_y] = rectangle
        .elements
        .map(|n| rectangle.element != Element::Q4 || n.is_multiple_of(2));
    let (left_mid, right_mid) = ([0.0, 0.5 * h], [w, 0.5 * h]);
    let (bottom_mid, top_mid) = ([0.5 * w, 0.0], [0.5 * w, h]);
    let (bottom_left, bottom_right, top_left, top_right) = ([0.0, 0.0], [w, 0.0], [0.0, h], [w, h]);
    let side = |name: &str, normal: usize, ends: [[f64; 2]; 2], mid: [f64; 2]| {
        let has_mid = if normal == 0 { mid_y } else { mid_x };
        let mid = has_mid.then_some(mid);
        let points: Vec<_> = [ends[0]].into_iter().chain(mid).chain([ends[1]]).collect();
        place(name, Straight(normal), points)
    };
    let mut places = vec![
        side("left", 0, [bottom_left, top_left], left_mid),
        side("right", 0, [bottom_right, top_right], right_mid),
        side("bottom", 1, [bottom_left, bottom_right], bottom_mid),
        side("top", 1, [top_left, top_right], top_mid),
    ];
    if mid_x {
        places.push(place("bottom_mid", Node, [bottom_mid]));
        places.push(place("top_mid", Node, [top_mid]));
    }
    places.extend([
        place("bottom_left", Node, [bottom_left]),
        place("bottom_right", Node, [bottom_right]),
        place("top_left", Node, [top_left]),
        place("top_right", Node, [top_right]),
        place(
            "corners",
            Node,
            [bottom_left, bottom_right, top_right, top_left],
        ),
    ]);
    places
}

fn of_annulus(ring: &Annulus) -> Vec<Place> {
    use PlaceKind::{Curved, Node, Straight};
    let (a, b) = (ring.inner_radius, ring.outer_radius);
    let [east, north, west, south] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    // Along the circumference a quadratic element has a node in its middle, too.
    let nodes = ring.elements[0] * if ring.element == Element::Q4 { 1 } else { 2 };
    let directions = match ring.sector {
        Sector::Quarter => vec![east, north],
        Sector::Half if nodes.is_multiple_of(2) => vec![east, north, west],
        Sector::Half => vec![east, west],
        Sector::Full if nodes.is_multiple_of(4) => vec![east, north, west, south],
        Sector::Full if nodes.is_multiple_of(2) => vec![east, west],
        Sector::Full => vec![east],
    };
    let at = |radius: f64, [x, y]: [f64; 2]| [radius * x, radius * y];
    let on = |radius: f64| {
        directions
            .iter()
            .map(|&direction| at(radius, direction))
            .collect::<Vec<_>>()
    };
    let mut places = vec![place("inner", Curved, on(a)), place("outer", Curved, on(b))];
    match ring.sector {
        Sector::Quarter => {
            places.push(place("symmetry_x", Straight(1), [at(a, east), at(b, east)]));
            places.push(place(
                "symmetry_y",
                Straight(0),
                [at(a, north), at(b, north)],
            ));
        }
        Sector::Half => {
            places.push(place(
                "symmetry_x",
                Straight(1),
                [at(a, east), at(b, east), at(a, west), at(b, west)],
            ));
        }
        Sector::Full => {
            let ends = directions
                .iter()
                .filter(|&&direction| direction == east || direction == west);
            let points: Vec<_> = ends.flat_map(|&end| [at(a, end), at(b, end)]).collect();
            places.push(place("axis_x", Node, points));
        }
    }
    // The cut of a quarter holds these nodes already.
    if ring.sector != Sector::Quarter && directions.contains(&north) {
        let ends = directions
            .iter()
            .filter(|&&direction| direction == north || direction == south);
        let points: Vec<_> = ends.flat_map(|&end| [at(a, end), at(b, end)]).collect();
        places.push(place("axis_y", Node, points));
    }
    places
}
