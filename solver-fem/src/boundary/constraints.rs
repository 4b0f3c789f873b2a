//! From displacement conditions to equations: which components are given, which are tied to others,
//! which are unknown, and whether the conditions make sense together.

use std::collections::{BTreeMap, BTreeSet};

use super::{BoundaryProblem, Condition, Target, Value};
use crate::element::Element;
use crate::layout::Layout;
use crate::mesh::Mesh;

/// A displacement component with a given value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Prescribed {
    /// Degree of freedom, `node × D + component`.
    pub dof: usize,
    /// Its displacement.
    pub value: Value,
}

/// A node that moves as another one does: its displacement, and v where both carry it, have the same
/// increments.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tie {
    /// The node that follows.
    pub node: usize,
    /// The node it follows.
    pub to: usize,
}

/// What says which degrees of freedom are free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given<'a> {
    pub conditions: &'a [Condition],
    pub ties: &'a [Tie],
    /// Degrees of freedom of v that do not change, ascending.
    pub held: &'a [usize],
    pub load_count: usize,
}

/// The split of the degrees of freedom into prescribed and free ones.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Constraints {
    /// Prescribed components, ascending.
    pub prescribed: Vec<Prescribed>,
    /// Free degrees of freedom that follow no other, ascending; position = equation number.
    pub free: Vec<usize>,
    /// Equation of every degree of freedom, `None` where prescribed; that of another one where it
    /// follows it.
    pub equation: Vec<Option<usize>>,
    /// Pairs (degree of freedom that follows, the one it follows, which itself follows none).
    pub tied: Vec<(usize, usize)>,
}

pub(crate) fn names<T>(map: &BTreeMap<String, T>) -> String {
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
    /// Collects what is given on a sound mesh; every fault goes to `problems`.
    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        layout: &Layout<D>,
        given: &Given<'_>,
        problems: &mut Vec<BoundaryProblem>,
    ) -> Self {
        let Given {
            conditions,
            ties,
            held,
            load_count,
        } = *given;
        let before = problems.len();
        let leader = leaders(layout, mesh.nodes.len(), ties, problems);
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
                let dof = leader[node * D + component];
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
        let mut values: BTreeMap<usize, Value> = given
            .into_iter()
            .map(|(dof, (_, value))| (dof, value))
            .collect();
        if problems.len() == before {
            if values.len() == leads(&leader[..layout.displacement_count()]) {
                problems.push(BoundaryProblem::NoUnknowns);
            }
            let fixed: Vec<usize> = values.keys().copied().collect();
            problems.extend(rigid_motions(mesh, &fixed));
        }
        let constant = Value::Constant(0.0);
        values.extend(held.iter().map(|&dof| (leader[dof], constant)));
        let tied: Vec<(usize, usize)> = leader
            .iter()
            .enumerate()
            .filter_map(|(dof, &to)| (dof != to).then_some((dof, to)))
            .collect();
        for &(dof, to) in &tied {
            if let Some(value) = values.get(&to).copied() {
                values.insert(dof, value);
            }
        }
        let idle = idle_multipliers(mesh, layout, |dof| values.contains_key(&dof));
        values.extend(idle.into_iter().map(|dof| (dof, constant)));

        let unknown = |dof: &usize| leader[*dof] == *dof && !values.contains_key(dof);
        let free: Vec<usize> = (0..layout.len()).filter(unknown).collect();
        let mut equation = vec![None; layout.len()];
        for (number, &dof) in free.iter().enumerate() {
            equation[dof] = Some(number);
        }
        for &(dof, to) in &tied {
            equation[dof] = equation[to];
        }
        let prescribed = values
            .into_iter()
            .map(|(dof, value)| Prescribed { dof, value })
            .collect();
        let constraints = Constraints {
            prescribed,
            free,
            equation,
            tied,
        };
        constraints.check_loads(mesh, element, conditions, problems);
        constraints
    }

    /// Adds what a list of forces has on a degree of freedom that follows another to that other one.
    pub(crate) fn gather(&self, forces: &mut [f64]) {
        for &(dof, to) in &self.tied {
            forces[to] += forces[dof];
            forces[dof] = 0.0;
        }
    }

    /// Gives a degree of freedom that follows another the other's increment.
    pub(crate) fn spread(&self, increments: &mut [f64]) {
        for &(dof, to) in &self.tied {
            increments[dof] = increments[to];
        }
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
                Condition::Displacement { .. } | Condition::BodyForce { .. } => continue,
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

/// The degree of freedom each one follows in the end, itself where it follows none.
fn leaders<const D: usize>(
    layout: &Layout<D>,
    nodes: usize,
    ties: &[Tie],
    problems: &mut Vec<BoundaryProblem>,
) -> Vec<usize> {
    let mut node_of: Vec<usize> = (0..nodes).collect();
    let mut faults = false;
    for tie in ties {
        let known = tie.node < nodes && tie.to < nodes;
        if !known || tie.node == tie.to || node_of[tie.node] != tie.node {
            problems.push(BoundaryProblem::Tie {
                node: tie.node,
                to: tie.to,
            });
            faults = true;
            continue;
        }
        node_of[tie.node] = tie.to;
    }
    let mut leader: Vec<usize> = (0..layout.len()).collect();
    if faults {
        return leader;
    }
    for node in 0..nodes {
        let mut to = node;
        // A chain longer than the mesh is a circle.
        for _ in 0..nodes {
            if node_of[to] == to {
                break;
            }
            to = node_of[to];
        }
        if node_of[to] != to {
            problems.push(BoundaryProblem::Tie { node, to });
            return (0..layout.len()).collect();
        }
        for i in 0..D {
            leader[node * D + i] = to * D + i;
        }
        if let (Some(from), Some(to)) = (layout.gradient_dof(node), layout.gradient_dof(to)) {
            for component in 0..D * D {
                leader[from + component] = to + component;
            }
        }
    }
    leader
}

/// Number of degrees of freedom that follow none.
fn leads(leader: &[usize]) -> usize {
    let own = leader.iter().enumerate();
    own.filter(|(dof, to)| dof == *to).count()
}

/// Components λ_ij of elements in which u_i and v_ij are held throughout: there is nothing for them
/// to do, and no equation could find them.
fn idle_multipliers<const D: usize>(
    mesh: &Mesh<D>,
    layout: &Layout<D>,
    held: impl Fn(usize) -> bool,
) -> Vec<usize> {
    let mut idle = Vec::new();
    for element in 0..mesh.element_count() {
        let Some(first) = layout.multiplier_dof(element) else {
            continue;
        };
        let nodes = mesh.element(element);
        for i in 0..D {
            for j in 0..D {
                let mut motion = nodes.iter().map(|node| node * D + i);
                let mut gradient = nodes
                    .iter()
                    .filter_map(|&node| Some(layout.gradient_dof(node)? + i * D + j));
                if motion.all(&held) && gradient.all(&held) {
                    idle.push(first + i * D + j);
                }
            }
        }
    }
    idle
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
        } => (Some(target.clone()), Some(*component), value),
        Condition::Traction {
            boundary,
            component,
            value,
        } => {
            let target = Target::Boundary(boundary.clone());
            (Some(target), Some(*component), value)
        }
        Condition::Pressure { boundary, value } => {
            (Some(Target::Boundary(boundary.clone())), None, value)
        }
        Condition::BodyForce { component, value } => (None, Some(*component), value),
    };
    match target {
        Some(Target::Boundary(name)) if !mesh.boundaries.contains_key(&name) => {
            let known = names(&mesh.boundaries);
            problems.push(BoundaryProblem::UnknownBoundary {
                condition,
                name,
                known,
            });
        }
        Some(Target::NodeSet(name)) if !mesh.node_sets.contains_key(&name) => {
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
