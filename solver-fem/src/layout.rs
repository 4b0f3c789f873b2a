//! Which numbers a problem solves for, and where each stands in the list of all.
//!
//! A displacement problem has the components of the displacement u at every node, and nothing else.
//! Where an element carries a second gradient, three fields follow each other:
//!
//! | field | carried by | per carrier | order |
//! |---|---|---|---|
//! | displacement u_i | every node | D | node × D + i |
//! | gradient v_ij | corners of second-gradient elements | D² | corner, then i, then j |
//! | multiplier λ_ij | second-gradient elements | D² | element, then i, then j |
//!
//! Positions of nodes stand in the place of displacements, so that the leading part of the list is
//! what geometry reads.

use crate::mesh::Mesh;

/// What kind of unknown a degree of freedom is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Field {
    /// A component of the displacement (of the position, in a list of unknowns); length.
    Displacement,
    /// A component of the gradient field v, its increment over the step; no unit.
    Gradient,
    /// A component of the multiplier λ; stress.
    Multiplier,
}

/// The degrees of freedom of a problem.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout<const D: usize> {
    nodes: usize,
    /// Corner number of every node; empty where no element carries a gradient.
    corner_of: Vec<Option<u32>>,
    corners: usize,
    /// Multiplier number of every element; empty likewise.
    multiplier_of: Vec<Option<u32>>,
    multipliers: usize,
}

impl<const D: usize> Layout<D> {
    /// Displacements only.
    pub fn displacement(mesh: &Mesh<D>) -> Self {
        Layout {
            nodes: mesh.nodes.len(),
            corner_of: Vec::new(),
            corners: 0,
            multiplier_of: Vec::new(),
            multipliers: 0,
        }
    }

    /// Displacements everywhere, v and λ on the elements for which `carries` holds; v sits on their
    /// first `corners` nodes.
    pub fn second_gradient(
        mesh: &Mesh<D>,
        corners: usize,
        carries: impl Fn(usize) -> bool,
    ) -> Self {
        let mut layout = Self::displacement(mesh);
        let mut used = vec![false; mesh.nodes.len()];
        layout.multiplier_of = vec![None; mesh.element_count()];
        for element in (0..mesh.element_count()).filter(|&element| carries(element)) {
            layout.multiplier_of[element] = Some(layout.multipliers as u32);
            layout.multipliers += 1;
            for &node in &mesh.element(element)[..corners] {
                used[node] = true;
            }
        }
        layout.corner_of = vec![None; mesh.nodes.len()];
        for (node, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            layout.corner_of[node] = Some(layout.corners as u32);
            layout.corners += 1;
        }
        layout
    }

    /// Number of displacement components.
    pub fn displacement_count(&self) -> usize {
        self.nodes * D
    }

    /// Number of components of v.
    pub fn gradient_count(&self) -> usize {
        self.corners * D * D
    }

    /// Number of components of λ.
    pub fn multiplier_count(&self) -> usize {
        self.multipliers * D * D
    }

    /// Number of all degrees of freedom.
    pub fn len(&self) -> usize {
        self.displacement_count() + self.gradient_count() + self.multiplier_count()
    }

    /// Whether there is nothing to solve for.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// First of the D² components of v at a node; `None` where the node carries none.
    pub fn gradient_dof(&self, node: usize) -> Option<usize> {
        let corner = (*self.corner_of.get(node)?)?;
        Some(self.displacement_count() + corner as usize * D * D)
    }

    /// First of the D² components of λ of an element; `None` for a plain element.
    pub fn multiplier_dof(&self, element: usize) -> Option<usize> {
        let number = (*self.multiplier_of.get(element)?)?;
        let before = self.displacement_count() + self.gradient_count();
        Some(before + number as usize * D * D)
    }

    /// Nodes that carry v, ascending, in the order of its components.
    pub fn gradient_nodes(&self) -> impl Iterator<Item = usize> + '_ {
        let numbered = self.corner_of.iter().enumerate();
        numbered.filter_map(|(node, corner)| corner.map(|_| node))
    }

    /// The field a degree of freedom belongs to.
    pub fn field(&self, dof: usize) -> Field {
        if dof < self.displacement_count() {
            Field::Displacement
        } else if dof < self.displacement_count() + self.gradient_count() {
            Field::Gradient
        } else {
            Field::Multiplier
        }
    }

    /// Degrees of freedom of an element: u of its nodes in their order, then, where it carries them,
    /// v of its corners and λ.
    pub fn element_dofs(&self, mesh: &Mesh<D>, element: usize) -> Vec<usize> {
        let nodes = mesh.element(element);
        let mut dofs: Vec<usize> = nodes
            .iter()
            .flat_map(|&node| (0..D).map(move |i| node * D + i))
            .collect();
        if let Some(multiplier) = self.multiplier_dof(element) {
            // Meshes are of one kind of element: no corner is a mid-side node of a neighbour.
            let corners = nodes.iter().filter_map(|&node| self.gradient_dof(node));
            dofs.extend(corners.flat_map(|first| first..first + D * D));
            dofs.extend(multiplier..multiplier + D * D);
        }
        dofs
    }

    /// A degree of freedom in words: `u1 of node 5`, `v12 of node 5`, `λ12 of element e3`.
    pub fn describe(&self, dof: usize) -> String {
        let pair = |component: usize| (component / D + 1, component % D + 1);
        let place = |list: &[Option<u32>], number: usize| {
            let found = list.iter().position(|&n| n == Some(number as u32));
            found.unwrap_or(list.len())
        };
        match self.field(dof) {
            Field::Displacement => format!("u{} of node {}", dof % D + 1, dof / D),
            Field::Gradient => {
                let local = dof - self.displacement_count();
                let (i, j) = pair(local % (D * D));
                format!(
                    "v{i}{j} of node {}",
                    place(&self.corner_of, local / (D * D))
                )
            }
            Field::Multiplier => {
                let local = dof - self.displacement_count() - self.gradient_count();
                let (i, j) = pair(local % (D * D));
                let element = place(&self.multiplier_of, local / (D * D));
                format!("λ{i}{j} of element e{element}")
            }
        }
    }
}
