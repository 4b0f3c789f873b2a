//! Forces, energies and distances of an iterate.

use super::StepSolver;
use crate::assembly::{Configuration, Residual, internal_forces, residual};
use crate::kinematics::InvertedElement;
use crate::layout::Field;
use crate::newton::FailureReason;
use crate::newton::state::Iterate;
use crate::tensor;

impl<const D: usize> StepSolver<D> {
    pub(super) fn balance(&self, iterate: &Iterate) -> Result<Residual, InvertedElement> {
        residual(&self.problem, &self.configuration(iterate))
    }

    pub(super) fn configuration<'a>(&'a self, iterate: &'a Iterate) -> Configuration<'a> {
        iterate.configuration(&self.state.committed)
    }

    /// The least force that a residual is compared with. At the force tolerance it is what the rounding of positions alone
    /// comes to, ½ε max|E| max|x| L^(D−2) √N, L being the diameter of the mesh and N its number of nodes: a position that is
    /// off by ½ε |x| strains an element of size h by ½ε |x|/h, the stress acts on h^(D−1), and nodes are off independently.
    pub(super) fn least_force(&self) -> f64 {
        let committed = &self.state.committed;
        let greatest = |values: &[f64]| values.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let width = libm::pow(self.problem.mesh().diameter(), D as f64 - 2.0);
        let nodes = self.problem.mesh().nodes.len() as f64;
        let rounding = 0.5 * f64::EPSILON * greatest(&committed.coordinates) * nodes.sqrt();
        rounding * greatest(&committed.elastic_tangents) * width
            / self.state.settings.force_tolerance
    }

    /// How far off what controls the step is, in parts of the step; 0 where loads alone do.
    pub(super) fn miss(&self, iterate: &Iterate) -> f64 {
        self.state.control.as_ref().map_or(0.0, |control| {
            let moving = self.problem.dof_count();
            control.miss(
                &self.problem,
                &self.state.committed.coordinates,
                &iterate.coordinates[..moving],
            )
        })
    }

    /// Whether the step moved by no more than what counts as none.
    pub(super) fn is_still(&self, iterate: &Iterate) -> bool {
        let before = self.state.committed.coordinates.iter();
        let moved: f64 = before
            .zip(&iterate.coordinates)
            .map(|(a, b)| (b - a) * (b - a))
            .sum();
        let mean = (moved / self.problem.dof_count() as f64).sqrt();
        mean <= self.state.settings.displacement_floor * self.problem.mesh().diameter()
    }

    /// ½(R_k + R_{k+1})·(x_k − x_{k+1}), k being the base of the pending wave and R_{k+1} the forces out of balance with
    /// its answers; nothing from the committed state, as a pure sweep is no motion of the body.
    pub(super) fn released(&self, balance: &[f64]) -> f64 {
        let trial = &self.state.trial;
        let free = |dof: &usize| {
            self.problem.constraints().equation[*dof].is_some()
                && self.problem.layout().field(*dof) != Field::Multiplier
        };
        let forces = trial.unbalanced.iter().zip(balance);
        let moved = trial.from.iter().zip(&trial.coordinates);
        let terms = (0..).zip(forces.zip(moved));
        terms
            .filter(|(dof, _)| free(dof))
            .map(|(_, ((before, after), (from, to)))| 0.5 * (before + after) * (from - to))
            .sum()
    }

    /// ∫σ:dε from the committed state to `iterate`: ½(f_n + f_{n+1})·(x_{n+1} − x_n), f being the forces of the stresses.
    pub(super) fn work(&self, iterate: &Iterate) -> Result<f64, FailureReason> {
        let forces = |positions: &[f64], stress: &[f64]| {
            internal_forces(&self.problem, positions, |_, index| {
                tensor::load2::<D>(stress, index)
            })
        };
        let committed = &self.state.committed;
        let (before, _) = forces(&committed.coordinates, &committed.stress)?;
        let (after, _) = forces(&iterate.coordinates, &iterate.stress)?;
        let moved = iterate.coordinates.iter().zip(&committed.coordinates);
        let pairs = before.iter().zip(&after).zip(moved);
        Ok(pairs
            .map(|((f, g), (x, from))| 0.5 * (f + g) * (x - from))
            .sum())
    }
}
