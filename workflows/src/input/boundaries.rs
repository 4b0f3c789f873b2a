//! The boundaries and nodes that a structured mesh names, known before the mesh is built.

use super::document::{Mesh, Sector};

/// A named boundary or node.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Its name.
    pub name: &'static str,
    /// Whether pressure and traction can act on it.
    pub kind: PlaceKind,
    /// Points of it that tell it apart: corners, middles, points on the axes. Two places meet where they share one.
    pub points: Vec<[f64; 2]>,
}

/// What a place is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// One node.
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
        Mesh::Annulus(annulus) => {
            of_annulus(annulus.sector, annulus.inner_radius, annulus.outer_radius)
        }
    }
}

fn place(name: &'static str, kind: PlaceKind, points: impl Into<Vec<[f64; 2]>>) -> Place {
    Place {
        name,
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
        place("left_mid", Node, [left_mid]),
        place("right_mid", Node, [right_mid]),
        place("bottom_mid", Node, [bottom_mid]),
        place("top_mid", Node, [top_mid]),
        place("bottom_left", Node, [bottom_left]),
        place("bottom_right", Node, [bottom_right]),
        place("top_left", Node, [top_left]),
        place("top_right", Node, [top_right]),
    ]
}

fn of_annulus(sector: Sector, a: f64, b: f64) -> Vec<Place> {
    use PlaceKind::{Curved, Node, Straight};
    let (east, north, west, south) = ([1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]);
    let at = |radius: f64, direction: [f64; 2]| [radius * direction[0], radius * direction[1]];
    let ring = |radius: f64, directions: &[[f64; 2]]| {
        directions
            .iter()
            .map(|&d| at(radius, d))
            .collect::<Vec<_>>()
    };
    let directions: &[[f64; 2]] = match sector {
        Sector::Quarter => &[east, north],
        Sector::Half => &[east, north, west],
        Sector::Full => &[east, north, west, south],
    };
    let mut places = vec![
        place("inner", Curved, ring(a, directions)),
        place("outer", Curved, ring(b, directions)),
    ];
    match sector {
        Sector::Quarter => {
            places.push(place("symmetry_x", Straight(1), [at(a, east), at(b, east)]));
            places.push(place(
                "symmetry_y",
                Straight(0),
                [at(a, north), at(b, north)],
            ));
        }
        Sector::Half => {
            let points = [at(a, east), at(b, east), at(a, west), at(b, west)];
            places.push(place("symmetry_x", Straight(1), points));
        }
        Sector::Full => {
            let names = ["inner_east", "inner_north", "inner_west", "inner_south"];
            places.extend(
                names
                    .into_iter()
                    .zip(directions)
                    .map(|(name, &d)| place(name, Node, [at(a, d)])),
            );
            let names = ["outer_east", "outer_north", "outer_west", "outer_south"];
            places.extend(
                names
                    .into_iter()
                    .zip(directions)
                    .map(|(name, &d)| place(name, Node, [at(b, d)])),
            );
        }
    }
    places
}
