//! From displacement conditions to equations: which components are given, which are unknown, and
//! whether the conditions make sense together.

use std::collections::{BTreeMap, BTreeSet};

use super::{BoundaryProblem, Condition, Target, Value};
use crate::element::Element;
use crate::mesh::Mesh;

/// A displacement component with a given value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Prescribed {
    /// Degree of freedom, `node × D + component`.
    pub dof: usize,
    /// Its displacement.
    pub value: Value,
}

/// The split of the degrees of freedom into prescribed and free ones.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Constraints {
    /// Prescribed components, ascending.
    pub prescribed: Vec<Prescribed>,
    /// Free degrees of freedom, ascending; position = equation number.
    pub free: Vec<usize>,
    /// Equation of every degree of freedom, `None` where prescribed.
    pub equation: Vec<Option<usize>>,
}

fn names<T>(map: &BTreeMap<String, T>) -> String {
    if map.is_empty() {
        return "none".into();
    }
    map.keys()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Nodes of a boundary, ascending.
pub(super) fn boundary_nodes<const D: usize>(
    mesh: &Mesh<D>,
    element: &dyn Element<D>,
    boundary: &str,
) -> BTreeSet<usize> {
    let facets = mesh.boundaries.get(boundary).into_iter().flatten();
    facets
        .flat_map(|facet| {
            let nodes = mesh.element(facet.element);
            element
                .facet_nodes(facet.local)
                .iter()
                .map(|&local| nodes[local])
        })
        .collect()
}

impl Constraints {
    /// Collects the displacement conditions of a sound mesh; every fault goes to `problems`.
    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        conditions: &[Condition],
        load_count: usize,
        problems: &mut Vec<BoundaryProblem>,
    ) -> Self {
        let before = problems.len();
        let mut given: BTreeMap<usize, (usize, Value)> = BTreeMap::new();
        let mut reported = BTreeSet::new();
        for (number, condition) in conditions.iter().enumerate() {
            check(number, condition, mesh, load_count, problems);
            let Condition::Displacement {
                target,
                component,
                value,
            } = condition
            else {
                continue;
            };
            if *component >= D {
                continue;
            }
            let nodes = match target {
                Target::Boundary(name) => boundary_nodes(mesh, element, name),
                Target::NodeSet(name) => mesh
                    .node_sets
                    .get(name)
                    .into_iter()
                    .flatten()
                    .copied()
                    .collect(),
            };
            for node in nodes {
                let dof = node * D + component;
                let (first, known) = *given.entry(dof).or_insert((number, *value));
                // One report per pair of conditions: a shared edge has many nodes.
                if known != *value && reported.insert((first, number)) {
                    problems.push(BoundaryProblem::Conflict {
                        first,
                        second: number,
                        node,
                        component: *component,
                    });
                }
            }
        }
        let dofs = mesh.nodes.len() * D;
        let free: Vec<usize> = (0..dofs).filter(|dof| !given.contains_key(dof)).collect();
        let mut equation = vec![None; dofs];
        for (number, &dof) in free.iter().enumerate() {
            equation[dof] = Some(number);
        }
        if problems.len() == before {
            if free.is_empty() {
                problems.push(BoundaryProblem::NoUnknowns);
            }
            let held: Vec<usize> = given.keys().copied().collect();
            problems.extend(rigid_motions(mesh, &held));
        }
        let prescribed = given
            .into_iter()
            .map(|(dof, (_, value))| Prescribed { dof, value })
            .collect();
        let constraints = Constraints {
            prescribed,
            free,
            equation,
        };
        constraints.check_loads(mesh, element, conditions, problems);
        constraints
    }

    /// A load whose every node component is held cannot act.
    fn check_loads<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        conditions: &[Condition],
        problems: &mut Vec<BoundaryProblem>,
    ) {
        for (condition, given) in conditions.iter().enumerate() {
            let (boundary, components) = match given {
                Condition::Displacement { .. } => continue,
                Condition::Traction {
                    boundary,
                    component,
                    ..
                } => (boundary, *component..component + 1),
                Condition::Pressure { boundary, .. } => (boundary, 0..D),
            };
            let nodes = boundary_nodes(mesh, element, boundary);
            let held = |node: &usize| {
                components
                    .clone()
                    .all(|i| matches!(self.equation.get(node * D + i), Some(None)))
            };
            if !nodes.is_empty() && nodes.iter().all(held) {
                let boundary = boundary.clone();
                problems.push(BoundaryProblem::LoadOnHeldBoundary {
                    condition,
                    boundary,
                });
            }
        }
    }
}

/// Names, components and loads of one condition.
fn check<const D: usize>(
    condition: usize,
    given: &Condition,
    mesh: &Mesh<D>,
    count: usize,
    problems: &mut Vec<BoundaryProblem>,
) {
    let (target, component, value) = match given {
        Condition::Displacement {
            target,
            component,
            value,
        } => (target.clone(), Some(*component), value),
        Condition::Traction {
            boundary,
            component,
            value,
        } => (Target::Boundary(boundary.clone()), Some(*component), value),
        Condition::Pressure { boundary, value } => {
            (Target::Boundary(boundary.clone()), None, value)
        }
    };
    match target {
        Target::Boundary(name) if !mesh.boundaries.contains_key(&name) => {
            let known = names(&mesh.boundaries);
            problems.push(BoundaryProblem::UnknownBoundary {
                condition,
                name,
                known,
            });
        }
        Target::NodeSet(name) if !mesh.node_sets.contains_key(&name) => {
            let known = names(&mesh.node_sets);
            problems.push(BoundaryProblem::UnknownNodeSet {
                condition,
                name,
                known,
            });
        }
        _ => {}
    }
    if let Some(component) = component.filter(|&component| component >= D) {
        problems.push(BoundaryProblem::UnknownComponent {
            condition,
            component,
            dimension: D,
        });
    }
    let numbers = match *value {
        Value::Constant(constant) => [constant, 0.0],
        Value::Load {
            index,
            factor,
            constant,
        } => {
            if index >= count {
                problems.push(BoundaryProblem::UnknownLoad {
                    condition,
                    index,
                    count,
                });
            }
            [factor, constant]
        }
    };
    if numbers.iter().any(|number| !number.is_finite()) {
        problems.push(BoundaryProblem::NonFiniteValue { condition });
    }
}

/// Rigid motions that the held components do not prevent.
///
/// A rigid motion u = a + ω×(x − c) is left where the held rows of the mode matrix are linearly
/// dependent: zero eigenvalues of the small Gram matrix, one row and column per mode.
fn rigid_motions<const D: usize>(mesh: &Mesh<D>, held: &[usize]) -> Vec<BoundaryProblem> {
    let size = mesh.diameter();
    let mut centre = [0.0; D];
    for node in &mesh.nodes {
        for i in 0..D {
            centre[i] += node[i] / mesh.nodes.len() as f64;
        }
    }
    let rotations: Vec<(usize, usize)> = (0..D)
        .flat_map(|i| (i + 1..D).map(move |j| (i, j)))
        .collect();
    let modes = D + rotations.len();
    let mut gram = nalgebra::DMatrix::<f64>::zeros(modes, modes);
    for &dof in held {
        let (node, component) = (dof / D, dof % D);
        let mut row = vec![0.0; modes];
        row[component] = 1.0;
        for (k, &(i, j)) in rotations.iter().enumerate() {
            let x = &mesh.nodes[node];
            if component == i {
                row[D + k] = -(x[j] - centre[j]) / size;
            } else if component == j {
                row[D + k] = (x[i] - centre[i]) / size;
            }
        }
        for a in 0..modes {
            for b in 0..modes {
                gram[(a, b)] += row[a] * row[b];
            }
        }
    }
    let scale = (held.len() as f64).max(1.0);
    let Some(eigen) = nalgebra::SymmetricEigen::try_new(gram, f64::EPSILON, 1000) else {
        return Vec::new();
    };
    let mut left: Vec<usize> = (0..modes)
        .filter(|&k| eigen.eigenvalues[k] <= 1e-12 * scale)
        .collect();
    left.sort_unstable();
    left.into_iter()
        .map(|k| {
            let mode = eigen.eigenvectors.column(k);
            let words: Vec<String> = (0..modes)
                .filter(|&a| mode[a].abs() > 0.3)
                .map(|a| {
                    let axis = |i: usize| ["x", "y", "z"].get(i).copied().unwrap_or("?");
                    match a.checked_sub(D) {
                        None => format!("translation in {}", axis(a)),
                        Some(r) => {
                            let (i, j) = rotations[r];
                            format!("rotation in the {}{} plane", axis(i), axis(j))
                        }
                    }
                })
                .collect();
            BoundaryProblem::RigidMotion {
                motion: words.join(" with "),
            }
        })
        .collect()
}
