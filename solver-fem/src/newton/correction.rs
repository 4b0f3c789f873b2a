//! From an iterate to the next one: choice of tangents, linear solve, cap, geometric check.

use super::control::{driven, force_slope};
use super::relaxation::{add_viscosity, largest_strain};
use super::state::{Iterate, Size};
use super::{Control, FailureReason, Phase, Safeguarded, StepSettings, Strategy, safeguard};
use crate::assembly::{Configuration, residual, tangent};
use crate::kinematics::{InvertedElement, point_geometry};
use crate::layout::Field;
use crate::linear_solver::LinearError;
use crate::problem::Problem;
use crate::tensor::{flatten4, load4, norm};

/// Which tangent of an answer is used.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum TangentChoice {
    Algorithmic,
    ElasticEnd,
    /// The algorithmic one with this viscosity added.
    Damped(f64),
}

/// New positions and how they were found.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Correction {
    pub coordinates: Vec<f64>,
    pub loads: Vec<f64>,
    pub ratio: f64,
    pub size: Size,
    pub safeguarded: usize,
    pub linear_residual: f64,
}

impl From<InvertedElement> for FailureReason {
    fn from(InvertedElement { element, point }: InvertedElement) -> Self {
        FailureReason::ElementInverted { element, point }
    }
}

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

/// Blends every tangent of a flat list as far as the bounds ask; plain Newton takes them as they
/// are. Returns the number of points touched.
pub(super) fn guard<const D: usize>(
    tangents: &mut [f64],
    elastic: &[f64],
    settings: &StepSettings,
) -> usize {
    if matches!(settings.strategy, Strategy::Plain { .. }) {
        return 0;
    }
    let size = D * D * D * D;
    let mut touched = 0;
    for point in 0..tangents.len() / size {
        let mut c = load4::<D>(tangents, point);
        let e = load4::<D>(elastic, point);
        if let Safeguarded::Blended(_) = safeguard(&mut c, &e, &settings.safeguard) {
            touched += 1;
            tangents[point * size..(point + 1) * size].copy_from_slice(&flatten4([&c]));
        }
    }
    touched
}

/// The tangents of an iterate, before the guard.
fn chosen<const D: usize>(iterate: &Iterate, phase: Phase, choice: TangentChoice) -> Vec<f64> {
    if choice == TangentChoice::ElasticEnd {
        return iterate.elastic_tangents.clone();
    }
    let mut tangents = iterate.tangents.clone();
    // In the pure phase a re-based algorithmic tangent still beats the elastic one (3 against 7
    // sweeps); over the small increment of the path phase it says nothing.
    if phase != Phase::Pure {
        let size = D * D * D * D;
        for (point, rebased) in iterate.rebased.iter().enumerate() {
            if *rebased {
                let range = point * size..(point + 1) * size;
                tangents[range.clone()].copy_from_slice(&iterate.elastic_tangents[range]);
            }
        }
    }
    tangents
}

struct Equilibrium<'a, const D: usize> {
    problem: &'a Problem<D>,
    at: Configuration<'a>,
    /// The load that adapts, where one does.
    load: Option<usize>,
}

/// What a linear solve gives, on all degrees of freedom.
struct Solution {
    /// Correction at fixed loads.
    du: Vec<f64>,
    /// Its change with the load that adapts.
    slope: Option<Vec<f64>>,
    /// Relative residual of the linear solve.
    relative_residual: f64,
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
    fn solve_first(
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

/// Positions are acceptable when no Gauss point is inverted.
fn inverted<const D: usize>(problem: &Problem<D>, coordinates: &[f64]) -> Option<InvertedElement> {
    for element in 0..problem.mesh().element_count() {
        for (point, data) in problem.reference_points().iter().enumerate() {
            if point_geometry(data, problem.mesh().element(element), coordinates).is_none() {
                return Some(InvertedElement { element, point });
            }
        }
    }
    None
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Follows the change of the load that adapts, where one does; returns that change.
fn adapt(
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

/// The first positions of a step: right-hand side −r_n (with the new loads) plus the prescribed
/// increment, stiffness from the stored tangents.
pub(super) fn predict<const D: usize>(
    problem: &Problem<D>,
    state: &super::MacroState<D>,
    (loads, control): (&[f64], Option<&Control>),
    prescribed: &[f64],
    settings: &StepSettings,
) -> Result<Correction, FailureReason> {
    let mut tangents = state.predictor_tangents.clone();
    let safeguarded = guard::<D>(&mut tangents, &state.elastic_tangents, settings);
    let unknowns = state.unknowns();
    let equilibrium = Equilibrium {
        problem,
        at: state.configuration(&unknowns, loads),
        load: control.map(|control| control.load),
    };
    let mut solution =
        equilibrium.solve_first(&[&tangents, &state.elastic_tangents], prescribed)?;
    let mut loads = loads.to_vec();
    if let Some(control) = control {
        loads[control.load] += adapt(&mut solution, |du, slope| {
            control.first_change(problem, state, du, slope)
        })?;
    }
    let du = solution.du;
    let coordinates: Vec<f64> = unknowns.iter().zip(&du).map(|(x, d)| x + d).collect();
    if let Some(element) = inverted(problem, &coordinates) {
        return Err(element.into());
    }
    let length = norm(&du[..problem.dof_count()]);
    let size = judge(problem, length, f64::INFINITY, settings);
    Ok(Correction {
        coordinates,
        loads,
        ratio: 1.0,
        size,
        safeguarded,
        linear_residual: solution.relative_residual,
    })
}

fn judge<const D: usize>(
    problem: &Problem<D>,
    correction: f64,
    ratio: f64,
    settings: &StepSettings,
) -> Size {
    let mean = correction / (problem.dof_count() as f64).sqrt();
    if ratio <= settings.displacement_tolerance
        || mean <= settings.displacement_floor * problem.mesh().diameter()
    {
        Size::Negligible
    } else {
        Size::Significant
    }
}

/// A Newton correction of `iterate` for a sweep of the given phase.
pub(super) fn correct<const D: usize>(
    problem: &Problem<D>,
    committed: &super::MacroState<D>,
    control: Option<&Control>,
    iterate: &Iterate,
    (phase, choice): (Phase, TangentChoice),
    settings: &StepSettings,
) -> Result<Correction, FailureReason> {
    /// Halvings of a correction that would fold an element, before giving up.
    const HALVINGS: usize = 4;

    let elastic = &committed.elastic_tangents;
    let mut tangents = chosen::<D>(iterate, phase, choice);
    let safeguarded = guard::<D>(&mut tangents, elastic, settings);
    if let TangentChoice::Damped(viscosity) = choice {
        add_viscosity::<D>(&mut tangents, iterate, elastic, viscosity);
    }
    let equilibrium = Equilibrium {
        problem,
        at: iterate.configuration(committed),
        load: control.map(|control| control.load),
    };
    let held = vec![0.0; problem.layout().len()];
    // A correction is judged and capped by its displacements.
    let moving = problem.dof_count();
    let candidates = [&tangents[..], &iterate.elastic_tangents, elastic];
    let mut solution = equilibrium.solve_first(&candidates, &held)?;
    let mut change = 0.0;
    if let Some(control) = control {
        let (from, at) = (&committed.coordinates, &iterate.coordinates);
        change = adapt(&mut solution, |du, slope| {
            control.change(problem, from, at, du, slope)
        })?;
    }
    let Solution { mut du, .. } = solution;
    let mut scale = |du: &mut [f64], factor: f64| {
        du.iter_mut().for_each(|d| *d *= factor);
        change *= factor;
    };

    if let Strategy::TwoPhase(two_phase) = settings.strategy {
        let (length, limit) = match phase {
            Phase::Pure => (0.0, 0.0),
            Phase::Path => {
                let so_far = norm(&difference(&iterate.coordinates, &committed.coordinates));
                (norm(&du[..moving]), two_phase.correction_cap * so_far)
            }
            Phase::Relaxation => (
                largest_strain(problem, &iterate.coordinates, &du),
                two_phase.relaxation.largest_strain,
            ),
        };
        if length > limit && limit > 0.0 {
            scale(&mut du, limit / length);
        }
    }
    // No line search on the residual: each trial would be a full sweep, and it cured nothing. A
    // folded element is seen without any constitutive evaluation.
    let mut halvings = 0;
    let coordinates = loop {
        let moved: Vec<f64> = iterate
            .coordinates
            .iter()
            .zip(&du)
            .map(|(x, d)| x + d)
            .collect();
        match inverted(problem, &moved) {
            None => break moved,
            Some(element) if halvings == HALVINGS => return Err(element.into()),
            Some(_) => scale(&mut du, 0.5),
        }
        halvings += 1;
    };
    let length = norm(&du[..moving]);
    let step = norm(&difference(&coordinates, &committed.coordinates));
    let ratio = if length == 0.0 { 0.0 } else { length / step };
    let size = judge(problem, length, ratio, settings);
    let mut loads = iterate.loads.clone();
    if let Some(control) = control {
        loads[control.load] += change;
    }
    Ok(Correction {
        coordinates,
        loads,
        ratio,
        size,
        safeguarded,
        linear_residual: solution.relative_residual,
    })
}
