//! The linear equations of a correction, and how far their solution may reach.

use super::FailureReason;
use super::control::{driven, force_slope};
use super::relaxation::{add_viscosity, largest_strain};
use crate::assembly::{Configuration, residual, tangent};
use crate::layout::Field;
use crate::linear_solver::LinearError;
use crate::problem::Problem;

fn linear_failure<const D: usize>(problem: &Problem<D>, error: LinearError) -> FailureReason {
    match error {
        LinearError::Singular {
            equation,
            amplification,
        } => {
            let free = &problem.constraints().free;
            let dof = free.get(equation).copied().unwrap_or(0);
            match problem.layout().field(dof) {
                Field::Displacement => FailureReason::Singular {
                    node: dof / D,
                    component: dof % D,
                    amplification,
                },
                Field::Gradient | Field::Multiplier => FailureReason::SingularField {
                    unknown: problem.layout().describe(dof),
                    amplification,
                },
            }
        }
        other => FailureReason::LinearSolver {
            message: other.to_string(),
        },
    }
}

/// The equations at a configuration.
pub(super) struct Equilibrium<'a, const D: usize> {
    pub problem: &'a Problem<D>,
    pub at: Configuration<'a>,
    /// The load that adapts, where one does.
    pub load: Option<usize>,
}

/// What a linear solve gives, on all degrees of freedom.
pub(super) struct Solution {
    /// Correction: at fixed loads as solved, with the change of the load that adapts once [`adapt`] was through it.
    pub du: Vec<f64>,
    /// Its change with the load that adapts.
    pub slope: Option<Vec<f64>>,
    /// Relative residual of the linear solve.
    pub relative_residual: f64,
}

impl<const D: usize> Equilibrium<'_, D> {
    /// K·du = −R − K·du_prescribed, and K·slope = ∂f/∂λ − K·∂u_prescribed/∂λ.
    fn solve(
        &self,
        tangents: &[f64],
        prescribed: &[f64],
    ) -> Result<Result<Solution, LinearError>, FailureReason> {
        let Equilibrium { problem, at, load } = self;
        let out_of_balance = residual(problem, at)?;
        let system = tangent(problem, at, tangents, prescribed)?;
        let free = &problem.constraints().free;
        let rhs = |forces: &[f64], moved: &[f64]| -> Vec<f64> {
            let pairs = free.iter().zip(moved);
            pairs.map(|(&dof, moved)| forces[dof] - moved).collect()
        };
        let unbalanced: Vec<f64> = out_of_balance.vector.iter().map(|r| -r).collect();
        let rhs_slope = match load {
            None => None,
            Some(load) => {
                let driven = driven(problem, *load);
                let moved = tangent(problem, at, tangents, &driven)?.prescribed;
                let forces = force_slope(problem, at.unknowns, at.loads, *load);
                Some((rhs(&forces, &moved), driven))
            }
        };
        let on_all = |x: &[f64], prescribed: &[f64]| {
            let mut du = prescribed.to_vec();
            for (&dof, x) in free.iter().zip(x) {
                du[dof] = *x;
            }
            problem.constraints().spread(&mut du);
            du
        };
        let solved = problem
            .solver()
            .factorise(&system.values)
            .and_then(|factors| {
                let solution = factors.solve(&rhs(&unbalanced, &system.prescribed))?;
                let slope = rhs_slope.map(|(rhs, driven)| {
                    let slope = factors.solve(&rhs)?;
                    Ok(on_all(&slope.x, &driven))
                });
                Ok(Solution {
                    du: on_all(&solution.x, prescribed),
                    slope: slope.transpose()?,
                    relative_residual: solution.relative_residual,
                })
            });
        Ok(solved)
    }

    /// The first of several lists of tangents that gives a regular system.
    pub fn solve_first(
        &self,
        candidates: &[&[f64]],
        prescribed: &[f64],
    ) -> Result<Solution, FailureReason> {
        let mut failure = None;
        for tangents in candidates {
            match self.solve(tangents, prescribed)? {
                Ok(solved) => return Ok(solved),
                Err(error) => failure = Some(error),
            }
        }
        let error = failure.unwrap_or(LinearError::NonFinite);
        Err(linear_failure(self.problem, error))
    }
}

/// Follows the change of the load that adapts, where one does; returns that change.
pub(super) fn adapt(
    Solution { du, slope, .. }: &mut Solution,
    change: impl FnOnce(&[f64], &[f64]) -> Result<f64, FailureReason>,
) -> Result<f64, FailureReason> {
    let Some(slope) = slope else {
        return Ok(0.0);
    };
    let change = change(du, slope)?;
    for (du, slope) in du.iter_mut().zip(slope) {
        *du += change * *slope;
    }
    Ok(change)
}

/// A correction with the tangents of a list of points, viscous enough that no Gauss point strains by more than `reach`:
/// near a limit point or a bifurcation K alone is nearly singular, and its correction leads to where no REV can follow.
pub(super) struct Bounded<'a, const D: usize> {
    pub equilibrium: Equilibrium<'a, D>,
    /// Initial elastic tangents E.
    pub elastic: &'a [f64],
    /// Elastic tangents of the points as they are.
    pub own: &'a [f64],
    /// Largest component of the strain of a Gauss point.
    pub reach: f64,
}

impl<const D: usize> Bounded<'_, D> {
    /// Viscosities c of K + c K_E that are tried in turn where K alone reaches too far.
    const VISCOSITIES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];

    /// The correction, the change of the load that adapts, and whether tangents were made viscous.
    pub fn solve(
        &self,
        candidates: &[&[f64]],
        prescribed: &[f64],
        change: impl Fn(&[f64], &[f64]) -> Result<f64, FailureReason>,
    ) -> Result<(Solution, f64, Damping), FailureReason> {
        let Equilibrium { problem, at, .. } = &self.equilibrium;
        let positions = &at.unknowns[..problem.dof_count()];
        let attempt = |candidates: &[&[f64]]| {
            let mut solution = self.equilibrium.solve_first(candidates, prescribed)?;
            let change = adapt(&mut solution, &change)?;
            let strain = largest_strain(problem, positions, &solution.du);
            Ok::<_, FailureReason>((solution, change, strain <= self.reach))
        };
        let (solution, moved, within) = attempt(candidates)?;
        if within {
            return Ok((solution, moved, Damping::None));
        }
        for viscosity in Self::VISCOSITIES {
            let mut damped = candidates
                .first()
                .map_or(Vec::new(), |first| first.to_vec());
            add_viscosity::<D>(&mut damped, self.own, self.elastic, viscosity);
            if let Ok((solution, moved, true)) = attempt(&[&damped]) {
                return Ok((solution, moved, Damping::Damped));
            }
        }
        let (solution, moved, _) = attempt(&[self.elastic])?;
        Ok((solution, moved, Damping::Damped))
    }
}

/// Whether all tangents of a correction were made viscous.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Damping {
    None,
    Damped,
}

impl Damping {
    /// The number of points whose tangents were changed, `guarded` of them by the guard.
    pub fn touched(self, guarded: usize, points: usize) -> usize {
        match self {
            Damping::None => guarded,
            Damping::Damped => points,
        }
    }
}
