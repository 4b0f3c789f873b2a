//! What is held of v on the boundaries.
//!
//! v stands for grad u: where the displacement u_i is the same along a boundary, its derivative along
//! every tangent t of the boundary is zero, v_it = 0. That follows from the displacement conditions
//! (smooth platen, normal y: u_y given, v_yx = 0; rough platen: u_x and u_y given, v_xx = v_yx = 0).
//! On a plane of symmetry the shear v_tn vanishes too. What is not held is free of double traction.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::boundary::{Condition, Target};
use crate::element::Element;
use crate::layout::Layout;
use crate::mesh::{Facet, Mesh};

/// What is held of v on a boundary.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug, Default)]
pub enum Side {
    /// v_it = 0 for every displacement component i that is prescribed and every tangent t: what
    /// holds where nothing else is said.
    #[default]
    Platen,
    /// A plane of symmetry with normal n: v_nt = v_tn = 0 for every tangent t.
    Symmetry,
    /// Nothing: no double traction.
    Free,
    /// These components (i, j), from 0.
    Held(Vec<[usize; 2]>),
}

/// One fault of a second gradient.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum SideProblem {
    /// A modulus is negative or not a number.
    #[error(
        "the second-gradient modulus of region `{region}` must not be negative, it is {modulus}"
    )]
    Modulus {
        /// Name of the region.
        region: String,
        /// The modulus.
        modulus: f64,
    },
    /// The element has no field on its corners.
    #[error("a {element} carries no second gradient; use Q8 (or T6)")]
    Element {
        /// Name of the element.
        element: &'static str,
    },
    /// A second-gradient element has no neighbour of its kind.
    #[error(
        "element e{element} alone carries a second gradient: such an element needs a neighbour across a side that carries one too, or v has motions without stiffness"
    )]
    Alone {
        /// The element.
        element: usize,
    },
    /// A boundary is named that the mesh does not have.
    #[error("there is no boundary `{name}` to hold v on (there are: {known})")]
    UnknownBoundary {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The tangent of a boundary is no axis.
    #[error(
        "boundary `{boundary}` holds the displacement but does not run along an axis (side {facet} of element e{element}): say what is held of v there, or leave it free of double traction"
    )]
    Inclined {
        /// The boundary.
        boundary: String,
        /// An element at it.
        element: usize,
        /// Local number of its side.
        facet: usize,
    },
    /// A plane of symmetry may leave its place.
    #[error(
        "boundary `{boundary}` is a plane of symmetry for v, but its normal displacement is not held"
    )]
    SymmetryMoves {
        /// The boundary.
        boundary: String,
    },
    /// A component does not exist.
    #[error("v{}{} on boundary `{boundary}` does not exist in {dimension} dimensions", component[0] + 1, component[1] + 1)]
    UnknownComponent {
        /// The boundary.
        boundary: String,
        /// The component, from 0.
        component: [usize; 2],
        /// Space dimension.
        dimension: usize,
    },
}

/// Axis that the side of an element is normal to; `None` for an inclined or curved one.
fn normal_axis<const D: usize>(
    mesh: &Mesh<D>,
    element: &dyn Element<D>,
    facet: &Facet,
    tolerance: f64,
) -> Option<usize> {
    let nodes = mesh.element(facet.element);
    let local = element.facet_nodes(facet.local);
    let first = mesh.nodes[nodes[local[0]]];
    (0..D).find(|&axis| {
        let mut off = local
            .iter()
            .map(|&a| mesh.nodes[nodes[a]][axis] - first[axis]);
        off.all(|distance| distance.abs() <= tolerance)
    })
}

/// Degrees of freedom of v that are held, ascending; every fault goes to `problems`.
pub(super) fn held<const D: usize>(
    sides: &BTreeMap<String, Side>,
    mesh: &Mesh<D>,
    element: &dyn Element<D>,
    layout: &Layout<D>,
    conditions: &[Condition],
    problems: &mut Vec<SideProblem>,
) -> Vec<usize> {
    let mut prescribed: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
    for condition in conditions {
        if let Condition::Displacement {
            target: Target::Boundary(name),
            component,
            ..
        } = condition
        {
            prescribed.entry(name).or_default().insert(*component);
        }
    }
    for name in sides.keys() {
        if !mesh.boundaries.contains_key(name) {
            problems.push(SideProblem::UnknownBoundary {
                name: name.clone(),
                known: crate::boundary::names(&mesh.boundaries),
            });
        }
    }
    let tolerance = 1e-9 * mesh.diameter();
    let mut held = BTreeSet::new();
    for (name, facets) in &mesh.boundaries {
        let side = sides.get(name).unwrap_or(&Side::Platen);
        let components = prescribed.get(name.as_str());
        for facet in facets {
            let carried: Vec<usize> = corners(mesh, element, facet)
                .filter_map(|node| layout.gradient_dof(node))
                .collect();
            if carried.is_empty() {
                continue;
            }
            let normal = normal_axis(mesh, element, facet, tolerance);
            let pairs = match pairs::<D>(side, components, normal) {
                Ok(pairs) => pairs,
                Err(fault) => {
                    let boundary = name.clone();
                    problems.push(match fault {
                        Fault::Inclined => SideProblem::Inclined {
                            boundary,
                            element: facet.element,
                            facet: facet.local,
                        },
                        Fault::SymmetryMoves => SideProblem::SymmetryMoves { boundary },
                        Fault::UnknownComponent(component) => SideProblem::UnknownComponent {
                            boundary,
                            component,
                            dimension: D,
                        },
                    });
                    // One report per boundary.
                    break;
                }
            };
            for first in carried {
                held.extend(pairs.iter().map(|[i, j]| first + i * D + j));
            }
        }
    }
    held.into_iter().collect()
}

/// Nodes of a side that are corners of its element.
fn corners<'a, const D: usize>(
    mesh: &'a Mesh<D>,
    element: &'a dyn Element<D>,
    facet: &'a Facet,
) -> impl Iterator<Item = usize> + 'a {
    let nodes = mesh.element(facet.element);
    let local = element.facet_nodes(facet.local).iter();
    local.map(|&a| nodes[a])
}

enum Fault {
    Inclined,
    SymmetryMoves,
    UnknownComponent([usize; 2]),
}

/// Components (i, j) of v that are held on a side with this normal.
fn pairs<const D: usize>(
    side: &Side,
    components: Option<&BTreeSet<usize>>,
    normal: Option<usize>,
) -> Result<Vec<[usize; 2]>, Fault> {
    let tangents = |normal: usize| (0..D).filter(move |&axis| axis != normal);
    match side {
        Side::Free => Ok(Vec::new()),
        Side::Held(pairs) => match pairs.iter().find(|[i, j]| *i >= D || *j >= D) {
            Some(pair) => Err(Fault::UnknownComponent(*pair)),
            None => Ok(pairs.clone()),
        },
        Side::Symmetry => {
            let normal = normal.ok_or(Fault::Inclined)?;
            if !components.is_some_and(|held| held.contains(&normal)) {
                return Err(Fault::SymmetryMoves);
            }
            Ok(tangents(normal)
                .flat_map(|t| [[normal, t], [t, normal]])
                .collect())
        }
        Side::Platen => {
            let Some(components) = components else {
                return Ok(Vec::new());
            };
            let normal = normal.ok_or(Fault::Inclined)?;
            let components = components.iter().filter(|&&i| i < D);
            Ok(components
                .flat_map(|&i| tangents(normal).map(move |t| [i, t]))
                .collect())
        }
    }
}

/// Second-gradient elements that share no side with another one.
///
/// One element has motions of v without stiffness that any neighbour takes away.
pub(super) fn neighbourless<const D: usize>(
    mesh: &Mesh<D>,
    layout: &Layout<D>,
    corners: usize,
) -> Vec<SideProblem> {
    let carrying = |element: &usize| layout.multiplier_dof(*element).is_some();
    let elements: Vec<usize> = (0..mesh.element_count()).filter(carrying).collect();
    let mut users: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &element in &elements {
        for &node in &mesh.element(element)[..corners] {
            users.entry(node).or_default().push(element);
        }
    }
    let alone = |element: &usize| {
        let mut shared: BTreeMap<usize, usize> = BTreeMap::new();
        for node in &mesh.element(*element)[..corners] {
            for other in users[node].iter().filter(|other| *other != element) {
                *shared.entry(*other).or_default() += 1;
            }
        }
        shared.values().all(|&nodes| nodes < D)
    };
    elements
        .into_iter()
        .filter(alone)
        .map(|element| SideProblem::Alone { element })
        .collect()
}
