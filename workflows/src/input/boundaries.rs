//! The boundaries and nodes that a structured mesh names, known before the mesh is built.

use super::document::{Annulus, Mesh, Sector};

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
    /// A straight boundary with its normal along this axis (0 is x).
    Straight(usize),
    /// A curved boundary.
    Curved,
}

/// All places of a mesh.
pub fn places(mesh: &Mesh) -> Vec<Place> {
    match mesh {
        Mesh::Rectangle(rectangle) => of_rectangle(rectangle.size),
        Mesh::Annulus(annulus) => of_annulus(annulus),
    }
}

fn place(name: impl Into<String>, kind: PlaceKind, points: impl Into<Vec<[f64; 2]>>) -> Place {
    Place {
        name: name.into(),
        kind,
        points: points.into(),
    }
}

fn of_rectangle([w, h]: [f64; 2]) -> Vec<Place> {
    use PlaceKind::{Node, Straight};
    let (left_mid, right_mid) = ([0.0, 0.5 * h], [w, 0.5 * h]);
    let (bottom_mid, top_mid) = ([0.5 * w, 0.0], [0.5 * w, h]);
    let (bottom_left, bottom_right, top_left, top_right) = ([0.0, 0.0], [w, 0.0], [0.0, h], [w, h]);
    vec![
        place("left", Straight(0), [bottom_left, left_mid, top_left]),
        place("right", Straight(0), [bottom_right, right_mid, top_right]),
        place(
            "bottom",
            Straight(1),
            [bottom_left, bottom_mid, bottom_right],
        ),
        place("top", Straight(1), [top_left, top_mid, top_right]),
        place("bottom_mid", Node, [bottom_mid]),
        place("top_mid", Node, [top_mid]),
        place("bottom_left", Node, [bottom_left]),
        place("bottom_right", Node, [bottom_right]),
        place("top_left", Node, [top_left]),
        place("top_right", Node, [top_right]),
        place(
            "corners",
            Node,
            [bottom_left, bottom_right, top_right, top_left],
        ),
    ]
}

fn of_annulus(ring: &Annulus) -> Vec<Place> {
    use PlaceKind::{Curved, Node, Straight};
    let (a, b) = (ring.inner_radius, ring.outer_radius);
    let [east, north, west, south] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    let directions = match ring.sector {
        Sector::Quarter => vec![east, north],
        Sector::Half => vec![east, north, west],
        Sector::Full if ring.elements[0].is_multiple_of(2) => vec![east, north, west, south],
        // A full ring of n elements has nodes at the angles k·π/n, which reach π/2 for even n only.
        Sector::Full => vec![east, west],
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
        Sector::Full => places.push(place(
            "axis_x",
            Node,
            [at(a, east), at(b, east), at(a, west), at(b, west)],
        )),
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
