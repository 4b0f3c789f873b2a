//! The kinds of elements that Gmsh numbers.

/// One kind of element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// Gmsh's number for it.
    pub number: u32,
    /// Dimension: 0 is a point, 3 a volume.
    pub dimension: u8,
    /// Number of nodes.
    pub nodes: u16,
    /// In words.
    pub name: &'static str,
}

/// The kind of this number, where it is known.
pub fn kind(number: u32) -> Option<Kind> {
    KINDS
        .iter()
        .find(|(known, ..)| *known == number)
        .map(|&(number, dimension, nodes, name)| Kind {
            number,
            dimension,
            nodes,
            name,
        })
}

pub const LINE2: u32 = 1;
pub const TRIANGLE3: u32 = 2;
pub const QUADRANGLE4: u32 = 3;
pub const LINE3: u32 = 8;
pub const TRIANGLE6: u32 = 9;
pub const QUADRANGLE9: u32 = 10;
pub const QUADRANGLE8: u32 = 16;

/// Number, dimension, nodes, name. Those of higher order are here to be refused by name.
const KINDS: [(u32, u8, u16, &str); 36] = [
    (LINE2, 1, 2, "two-node line"),
    (TRIANGLE3, 2, 3, "three-node triangle"),
    (QUADRANGLE4, 2, 4, "four-node quadrangle"),
    (4, 3, 4, "four-node tetrahedron"),
    (5, 3, 8, "eight-node hexahedron"),
    (6, 3, 6, "six-node prism"),
    (7, 3, 5, "five-node pyramid"),
    (LINE3, 1, 3, "three-node line"),
    (TRIANGLE6, 2, 6, "six-node triangle"),
    (QUADRANGLE9, 2, 9, "nine-node quadrangle"),
    (11, 3, 10, "ten-node tetrahedron"),
    (12, 3, 27, "27-node hexahedron"),
    (13, 3, 18, "18-node prism"),
    (14, 3, 14, "14-node pyramid"),
    (15, 0, 1, "point"),
    (QUADRANGLE8, 2, 8, "eight-node quadrangle"),
    (17, 3, 20, "20-node hexahedron"),
    (18, 3, 15, "15-node prism"),
    (19, 3, 13, "13-node pyramid"),
    (20, 2, 9, "nine-node triangle"),
    (21, 2, 10, "ten-node triangle"),
    (22, 2, 12, "twelve-node triangle"),
    (23, 2, 15, "15-node triangle"),
    (24, 2, 15, "15-node triangle"),
    (25, 2, 21, "21-node triangle"),
    (26, 1, 4, "four-node line"),
    (27, 1, 5, "five-node line"),
    (28, 1, 6, "six-node line"),
    (29, 3, 20, "20-node tetrahedron"),
    (30, 3, 35, "35-node tetrahedron"),
    (31, 3, 56, "56-node tetrahedron"),
    (36, 2, 16, "16-node quadrangle"),
    (37, 2, 25, "25-node quadrangle"),
    (39, 2, 12, "twelve-node quadrangle"),
    (92, 3, 64, "64-node hexahedron"),
    (93, 3, 125, "125-node hexahedron"),
];
