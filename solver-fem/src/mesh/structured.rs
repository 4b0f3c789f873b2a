//! Structured Q8 meshes: rectangle, annulus, and any image of the unit square.
//!
//! Mid-side nodes go through the same mapping as corners, so they lie on the true curve (a circle
//! for the annulus), not on its chord.

use std::collections::BTreeMap;

use thiserror::Error;

use super::{Facet, Mesh};

/// A rectangle with a corner at the origin.
///
/// Boundaries `left`, `right`, `bottom`, `top`. Node sets `bottom_left`, `bottom_right`, `top_right`,
/// `top_left`, `corners` (all four), and `bottom_mid`, `top_mid`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rectangle {
    /// Width and height.
    pub size: [f64; 2],
    /// Number of elements along the width and along the height.
    pub elements: [usize; 2],
}

/// Part of the circle an [`Annulus`] covers, from the positive x axis counter-clockwise.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AnnulusExtent {
    /// x ≥ 0 and y ≥ 0; boundaries `symmetry_x` (on y = 0) and `symmetry_y` (on x = 0).
    Quarter,
    /// y ≥ 0; boundary `symmetry_x` (both pieces on y = 0), node set `axis_y` against sliding in x.
    Half,
    /// The whole ring; node sets `axis_x` (on y = 0) and `axis_y` (on x = 0), the usual pins.
    Full,
}

/// A ring around the origin, graded along the radius. Boundaries `inner` and `outer`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Annulus {
    /// Radius of the cavity.
    pub inner_radius: f64,
    /// Outer radius.
    pub outer_radius: f64,
    /// Number of elements along the circumference (over the whole extent).
    pub circumferential: usize,
    /// Number of elements along the radius.
    pub radial: usize,
    /// Radial size of an element over that of its inner neighbour; 1 is uniform.
    pub growth: f64,
    /// Part of the circle.
    pub extent: AnnulusExtent,
}

/// The figures given make no mesh.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum BuildError {
    /// A length is not positive.
    #[error("build the mesh: {what} must be a positive number, it is {value}")]
    NotPositive {
        /// What the number is.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number of elements is too small.
    #[error("build the mesh: it needs at least {least} elements {what}, {found} were given")]
    TooFewElements {
        /// Along what.
        what: &'static str,
        /// Smallest number that makes a mesh.
        least: usize,
        /// The number given.
        found: usize,
    },
    /// The radii are in the wrong order.
    #[error("build the mesh: the outer radius {outer} must exceed the inner radius {inner}")]
    Radii {
        /// Inner radius.
        inner: f64,
        /// Outer radius.
        outer: f64,
    },
}

fn positive(what: &'static str, value: f64) -> Result<(), BuildError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(BuildError::NotPositive { what, value })
    }
}

fn at_least(what: &'static str, least: usize, found: usize) -> Result<(), BuildError> {
    if found >= least {
        Ok(())
    } else {
        Err(BuildError::TooFewElements { what, least, found })
    }
}

/// How the two ends of the second grid direction meet.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Closure {
    Open,
    Closed,
}

impl Mesh<2> {
    /// A [`Rectangle`] of Q8 elements, row by row from the bottom left.
    ///
    /// # Errors
    /// A size that is not positive, or no elements.
    pub fn rectangle(rectangle: &Rectangle) -> Result<Self, BuildError> {
        let ([width, height], [nx, ny]) = (rectangle.size, rectangle.elements);
        positive("the width", width)?;
        positive("the height", height)?;
        let mut mesh = Mesh::mapped([nx, ny], |s, t| [width * s, height * t])?;
        let mut sets = BTreeMap::new();
        let mut at = |name: &str, x: f64, y: f64| {
            let found = mesh.nodes.iter().position(|node| *node == [x, y]);
            if let Some(node) = found {
                sets.insert(name.to_owned(), vec![node]);
            }
            found
        };
        let mut corners: Vec<_> = [
            at("bottom_left", 0.0, 0.0),
            at("bottom_right", width, 0.0),
            at("top_right", width, height),
            at("top_left", 0.0, height),
        ]
        .into_iter()
        .flatten()
        .collect();
        at("bottom_mid", 0.5 * width, 0.0);
        at("top_mid", 0.5 * width, height);
        corners.sort_unstable();
        sets.insert("corners".into(), corners);
        mesh.node_sets = sets;
        Ok(mesh)
    }

    /// The image of the unit square under `map(s, t)`, with `elements` along s and t; `map` must
    /// keep the orientation. Boundaries `left` (s = 0), `right` (s = 1), `bottom` (t = 0), `top`.
    ///
    /// # Errors
    /// No elements in one direction.
    pub fn mapped(
        elements: [usize; 2],
        map: impl Fn(f64, f64) -> [f64; 2],
    ) -> Result<Self, BuildError> {
        at_least("along the first side", 1, elements[0])?;
        at_least("along the second side", 1, elements[1])?;
        Ok(grid(elements, Closure::Open, map))
    }

    /// An [`Annulus`] of Q8 elements; within a ray from the inside out, then ray by ray.
    ///
    /// # Errors
    /// A radius or growth that is not positive, radii in the wrong order, too few elements.
    pub fn annulus(annulus: &Annulus) -> Result<Self, BuildError> {
        let Annulus {
            inner_radius: inner,
            outer_radius: outer,
            growth,
            ..
        } = *annulus;
        positive("the inner radius", inner)?;
        positive("the outer radius", outer)?;
        positive("the growth ratio", growth)?;
        if outer <= inner {
            return Err(BuildError::Radii { inner, outer });
        }
        let full = annulus.extent == AnnulusExtent::Full;
        at_least("along the radius", 1, annulus.radial)?;
        at_least(
            "along the circumference",
            if full { 3 } else { 1 },
            annulus.circumferential,
        )?;

        let quarters = match annulus.extent {
            AnnulusExtent::Quarter => 1.0,
            AnnulusExtent::Half => 2.0,
            AnnulusExtent::Full => 4.0,
        };
        let radii = graded(inner, outer, annulus.radial, growth);
        let map = |s: f64, t: f64| {
            let position = s * annulus.radial as f64;
            let layer = (position as usize).min(annulus.radial - 1);
            let r = radii[layer] + (position - layer as f64) * (radii[layer + 1] - radii[layer]);
            let [c, s] = direction(quarters * t);
            [r * c, r * s]
        };
        let closure = if full { Closure::Closed } else { Closure::Open };
        let mut mesh = grid([annulus.radial, annulus.circumferential], closure, map);
        let mut take = |name: &str| mesh.boundaries.remove(name).unwrap_or_default();
        let (inner, outer) = (take("left"), take("right"));
        let (first, last) = (take("bottom"), take("top"));
        mesh.boundaries.insert("inner".into(), inner);
        mesh.boundaries.insert("outer".into(), outer);
        let on_axis = |i: usize| -> Vec<usize> {
            (0..mesh.nodes.len())
                .filter(|&node| mesh.nodes[node][i] == 0.0)
                .collect()
        };
        match annulus.extent {
            AnnulusExtent::Quarter => {
                mesh.boundaries.insert("symmetry_x".into(), first);
                mesh.boundaries.insert("symmetry_y".into(), last);
            }
            AnnulusExtent::Half => {
                let axis_y = on_axis(0);
                if !axis_y.is_empty() {
                    mesh.node_sets.insert("axis_y".into(), axis_y);
                }
                let both = first.into_iter().chain(last).collect();
                mesh.boundaries.insert("symmetry_x".into(), both);
            }
            AnnulusExtent::Full => {
                for (name, nodes) in [("axis_x", on_axis(1)), ("axis_y", on_axis(0))] {
                    if !nodes.is_empty() {
                        mesh.node_sets.insert(name.into(), nodes);
                    }
                }
            }
        }
        Ok(mesh)
    }
}

/// Radii of the layers: sizes in geometric progression, both ends exact.
fn graded(inner: f64, outer: f64, layers: usize, growth: f64) -> Vec<f64> {
    let mut sums = vec![0.0];
    let mut size = 1.0;
    for layer in 0..layers {
        sums.push(sums[layer] + size);
        size *= growth;
    }
    let total = sums[layers];
    let mut radii: Vec<f64> = sums
        .iter()
        .map(|s| inner + (outer - inner) * s / total)
        .collect();
    radii[layers] = outer;
    radii
}

/// Unit vector at `quarters` right angles from the x axis, exact on the axes so that nodes of a
/// symmetry plane have exactly zero in their normal component.
fn direction(quarters: f64) -> [f64; 2] {
    if quarters.fract() == 0.0 {
        return match quarters as i64 % 4 {
            0 => [1.0, 0.0],
            1 => [0.0, 1.0],
            2 => [-1.0, 0.0],
            _ => [0.0, -1.0],
        };
    }
    let angle = quarters * std::f64::consts::FRAC_PI_2;
    [libm::cos(angle), libm::sin(angle)]
}

/// Q8 grid: lattice points (i, j) of a (2nx+1) × (2ny+1) grid without the element middles.
fn grid([nx, ny]: [usize; 2], closure: Closure, map: impl Fn(f64, f64) -> [f64; 2]) -> Mesh<2> {
    let rows = if closure == Closure::Closed {
        2 * ny
    } else {
        2 * ny + 1
    };
    let width = 2 * nx + 1;
    let mut numbers = vec![usize::MAX; rows * width];
    let mut nodes = Vec::new();
    for j in 0..rows {
        for i in 0..width {
            if i % 2 == 1 && j % 2 == 1 {
                continue;
            }
            numbers[j * width + i] = nodes.len();
            nodes.push(map(i as f64 / (2 * nx) as f64, j as f64 / (2 * ny) as f64));
        }
    }
    let node = |i: usize, j: usize| numbers[(j % rows) * width + i];
    let mut connectivity = Vec::with_capacity(8 * nx * ny);
    let mut sides: BTreeMap<String, Vec<Facet>> = BTreeMap::new();
    for ey in 0..ny {
        for ex in 0..nx {
            let (i, j, element) = (2 * ex, 2 * ey, ey * nx + ex);
            for (di, dj) in [
                (0, 0),
                (2, 0),
                (2, 2),
                (0, 2),
                (1, 0),
                (2, 1),
                (1, 2),
                (0, 1),
            ] {
                connectivity.push(node(i + di, j + dj));
            }
            let mut side = |name: &str, local| {
                sides
                    .entry(name.to_owned())
                    .or_default()
                    .push(Facet { element, local });
            };
            if ey == 0 && closure == Closure::Open {
                side("bottom", 0);
            }
            if ex + 1 == nx {
                side("right", 1);
            }
            if ey + 1 == ny && closure == Closure::Open {
                side("top", 2);
            }
            if ex == 0 {
                side("left", 3);
            }
        }
    }
    Mesh {
        nodes,
        nodes_per_element: 8,
        connectivity,
        regions: vec![0; nx * ny],
        region_names: vec!["default".into()],
        boundaries: sides,
        node_sets: BTreeMap::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Q8;

    fn ring(extent: AnnulusExtent) -> Mesh<2> {
        Mesh::annulus(&Annulus {
            inner_radius: 1.0,
            outer_radius: 5.0,
            circumferential: 8,
            radial: 5,
            growth: 1.3,
            extent,
        })
        .expect("sound")
    }

    #[test]
    fn mid_side_nodes_of_a_cavity_lie_on_the_circle_not_on_its_chord() {
        for extent in [
            AnnulusExtent::Quarter,
            AnnulusExtent::Half,
            AnnulusExtent::Full,
        ] {
            let mesh = ring(extent);
            assert_eq!(mesh.check(&Q8::default()), vec![]);
            for (name, radius) in [("inner", 1.0), ("outer", 5.0)] {
                assert_eq!(mesh.boundaries[name].len(), 8);
                for facet in &mesh.boundaries[name] {
                    let local = if name == "inner" {
                        [3, 0, 7]
                    } else {
                        [1, 2, 5]
                    };
                    for a in local {
                        let [x, y] = mesh.nodes[mesh.element(facet.element)[a]];
                        assert!((x.hypot(y) - radius).abs() < 1e-14);
                    }
                }
            }
        }
    }

    #[test]
    fn symmetry_planes_are_exactly_on_their_axes() {
        let mesh = ring(AnnulusExtent::Quarter);
        for (name, component, local) in [("symmetry_x", 1, [0, 1, 4]), ("symmetry_y", 0, [2, 3, 6])]
        {
            assert_eq!(mesh.boundaries[name].len(), 5);
            for facet in &mesh.boundaries[name] {
                for a in local {
                    assert_eq!(mesh.nodes[mesh.element(facet.element)[a]][component], 0.0);
                }
            }
        }
    }

    #[test]
    fn a_full_ring_has_no_seam() {
        let mesh = ring(AnnulusExtent::Full);
        assert_eq!(mesh.nodes.len(), 16 * 11 - 8 * 5);
        assert_eq!(mesh.node_sets["axis_x"].len(), 2 * 11);
    }

    #[test]
    fn the_bottom_middle_is_a_node_for_odd_and_even_meshes() {
        for nx in 1..5 {
            let mesh = Mesh::rectangle(&Rectangle {
                size: [1.0, 2.0],
                elements: [nx, 3],
            });
            let mesh = mesh.expect("sound");
            let node = mesh.node_sets["bottom_mid"][0];
            assert_eq!(mesh.nodes[node], [0.5, 0.0]);
            assert_eq!(mesh.node_sets["corners"].len(), 4);
        }
    }

    #[test]
    fn figures_that_make_no_mesh_are_refused_with_their_name() {
        let error = Mesh::rectangle(&Rectangle {
            size: [-1.0, 2.0],
            elements: [1, 1],
        });
        assert!(
            error
                .expect_err("refused")
                .to_string()
                .contains("the width")
        );
        let error = Mesh::rectangle(&Rectangle {
            size: [1.0, 2.0],
            elements: [0, 1],
        });
        assert!(matches!(error, Err(BuildError::TooFewElements { .. })));
    }
}
