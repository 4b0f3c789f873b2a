//! Second gradient: a body whose energy also depends on the gradient of its strain, so that a
//! localisation band has a width of its own.
//!
//! Beside the displacement u there are the field v, which stands for grad u and has a gradient of its
//! own, and the multiplier λ that ties the two ([`point`] has the equations). u lives on the nodes of
//! an element, v on its corners, λ is constant in it. v counts from the beginning of the step, λ
//! is a stress and goes on from step to step; the double stress χ is kept at Gauss points.
//!
//! A region with the modulus zero is made of plain elements and carries neither v nor λ. At its border v is
//! free: no double traction. `docs/design/second-gradient.md` tells what was measured.

pub(crate) mod element;
pub mod law;
pub mod point;
mod sides;
pub mod spin;
mod state;

use std::collections::BTreeMap;

pub use element::CornerPoint;
pub use element::double_stresses;
pub use sides::{Side, SideProblem};
pub use state::SecondGradientState;

use crate::boundary::Condition;
use crate::element::Element;
use crate::layout::Layout;
use crate::mesh::Mesh;
use sides::neighbourless;

/// Which regions carry a second gradient, and what is held of v on the boundaries.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SecondGradient {
    /// The modulus D (stress × length²) of every region, in the order of the mesh's region names; a
    /// region beyond the list, or with modulus 0, is plain.
    pub moduli: Vec<f64>,
    /// Boundaries on which something else is held of v than what displacement conditions imply
    /// ([`Side::Platen`]).
    pub sides: BTreeMap<String, Side>,
}

impl SecondGradient {
    /// The same modulus in every region, boundaries as the displacement conditions imply.
    pub fn uniform<const D: usize>(mesh: &Mesh<D>, modulus: f64) -> Self {
        SecondGradient {
            moduli: vec![modulus; mesh.region_names.len()],
            sides: BTreeMap::new(),
        }
    }

    /// Modulus of an element, 0 for a plain one.
    pub(crate) fn modulus<const D: usize>(&self, mesh: &Mesh<D>, element: usize) -> f64 {
        let region = mesh.regions[element];
        self.moduli.get(region).copied().unwrap_or(0.0)
    }

    /// Whether no region has a modulus.
    pub fn is_plain(&self) -> bool {
        self.moduli.iter().all(|&modulus| modulus == 0.0)
    }

    /// The unknowns of a mesh whose elements have `corners` corners.
    pub(crate) fn layout<const D: usize>(&self, mesh: &Mesh<D>, corners: usize) -> Layout<D> {
        if self.is_plain() {
            return Layout::displacement(mesh);
        }
        Layout::second_gradient(mesh, corners, |element| self.modulus(mesh, element) != 0.0)
    }

    /// Every fault of the moduli on a sound mesh.
    pub(crate) fn check<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        layout: &Layout<D>,
        corners: usize,
    ) -> Vec<SideProblem> {
        let mut problems = Vec::new();
        for (region, &modulus) in self.moduli.iter().enumerate() {
            if !(modulus >= 0.0 && modulus.is_finite()) {
                let name = mesh.region_names.get(region);
                problems.push(SideProblem::Modulus {
                    region: name.map_or_else(|| region.to_string(), Clone::clone),
                    modulus,
                });
            }
        }
        problems.extend(neighbourless(mesh, layout, corners));
        problems
    }

    /// Degrees of freedom of v that are held, ascending; every fault goes to `problems`.
    pub(crate) fn held<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        element: &dyn Element<D>,
        layout: &Layout<D>,
        conditions: &[Condition],
        problems: &mut Vec<SideProblem>,
    ) -> Vec<usize> {
        if layout.gradient_count() == 0 {
            return Vec::new();
        }
        sides::held(&self.sides, mesh, element, layout, conditions, problems)
    }
}
