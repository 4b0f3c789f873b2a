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

/// A correction with the tangents of a list of points, viscous enough that no Gauss point strains by more than `reach`:
/// near a limit point or a bifurcation K alone is nearly singular, and its correction leads to where no REV can follow.
struct Bounded<'a, const D: usize> {
    equilibrium: Equilibrium<'a, D>,
    /// Initial elastic tangents E.
    elastic: &'a [f64],
    /// Elastic tangents of the points as they are.
    own: &'a [f64],
    reach: f64,
}

impl<const D: usize> Bounded<'_, D> {
    /// Viscosities c of K + c K_E that are tried in turn where K alone reaches too far.
    const VISCOSITIES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];

    /// The correction, the change of the load that adapts, and whether tangents were made viscous.
    fn solve(
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
enum Damping {
    None,
    Damped,
}

impl Damping {
    /// The number of points whose tangents were changed, `guarded` of them by the guard.
    fn touched(self, guarded: usize, points: usize) -> usize {
        match self {
            Damping::None => guarded,
            Damping::Damped => points,
        }
    }
}

/// The first positions of a step: right-hand side −r_n (with the new loads) plus the prescribed
/// increment, stiffness from the stored tangents. Returns also how far the corrections of the step may reach: see
/// [`TwoPhase::reach`](super::TwoPhase).
pub(super) fn predict<const D: usize>(
    problem: &Problem<D>,
    state: &super::MacroState<D>,
    (loads, control): (&[f64], Option<&Control>),
    prescribed: &[f64],
    settings: &StepSettings,
) -> Result<(Correction, f64), FailureReason> {
    let mut tangents = state.predictor_tangents.clone();
    let elastic = &state.elastic_tangents;
    let guarded = guard::<D>(&mut tangents, elastic, settings);
    let unknowns = state.unknowns();
    let equilibrium = Equilibrium {
        problem,
        at: state.configuration(&unknowns, loads),
        load: control.map(|control| control.load),
    };
    let change = |du: &[f64], slope: &[f64]| {
        control.map_or(Ok(0.0), |control| {
            control.first_change(problem, state, du, slope)
        })
    };
    let reach = match settings.strategy {
        Strategy::Plain { .. } => f64::INFINITY,
        Strategy::TwoPhase(two_phase) => {
            let mut solution = equilibrium.solve_first(&[elastic], prescribed)?;
            adapt(&mut solution, change)?;
            let strain = largest_strain(problem, &state.coordinates, &solution.du);
            two_phase.reach(strain)
        }
    };
    let bounded = Bounded {
        equilibrium,
        elastic,
        own: elastic,
        reach,
    };
    let (solution, change, damping) = bounded.solve(&[&tangents, elastic], prescribed, change)?;
    let mut loads = loads.to_vec();
    if let Some(control) = control {
        loads[control.load] += change;
    }
    let du = solution.du;
    let coordinates: Vec<f64> = unknowns.iter().zip(&du).map(|(x, d)| x + d).collect();
    if let Some(element) = inverted(problem, &coordinates) {
        return Err(element.into());
    }
    let length = norm(&du[..problem.dof_count()]);
    let size = judge(problem, length, f64::INFINITY, settings);
    let correction = Correction {
        coordinates,
        loads,
        ratio: 1.0,
        size,
        safeguarded: damping.touched(guarded, problem.gauss_point_count()),
        linear_residual: solution.relative_residual,
    };
    Ok((correction, reach))
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
    (control, reach): (Option<&Control>, f64),
    iterate: &Iterate,
    (phase, choice): (Phase, TangentChoice),
    settings: &StepSettings,
) -> Result<Correction, FailureReason> {
    /// Halvings of a correction that would fold an element, before giving up.
    const HALVINGS: usize = 4;

    let elastic = &committed.elastic_tangents;
    let mut tangents = chosen::<D>(iterate, phase, choice);
    let guarded = guard::<D>(&mut tangents, elastic, settings);
    let own = &iterate.elastic_tangents;
    if let TangentChoice::Damped(viscosity) = choice {
        add_viscosity::<D>(&mut tangents, own, elastic, viscosity);
    }
    let bounded = Bounded {
        equilibrium: Equilibrium {
            problem,
            at: iterate.configuration(committed),
            load: control.map(|control| control.load),
        },
        elastic,
        own,
        // The overdamped motion has its own viscosity, and follows its direction as far as it may.
        reach: match phase {
            Phase::Pure | Phase::Path => reach,
            Phase::Relaxation => f64::INFINITY,
        },
    };
    let held = vec![0.0; problem.layout().len()];
    // A correction is judged and capped by its displacements.
    let moving = problem.dof_count();
    let candidates = [&tangents[..], own, elastic];
    let (solution, mut change, damping) = bounded.solve(&candidates, &held, |du, slope| {
        let (from, at) = (&committed.coordinates, &iterate.coordinates);
        control.map_or(Ok(0.0), |control| {
            control.change(problem, from, at, du, slope)
        })
    })?;
    let Solution { mut du, .. } = solution;
    let mut scale = |du: &mut [f64], factor: f64| {
        du.iter_mut().for_each(|d| *d *= factor);
        change *= factor;
    };

    if let Strategy::TwoPhase(two_phase) = settings.strategy {
        if phase == Phase::Path {
            let so_far = norm(&difference(&iterate.coordinates, &committed.coordinates));
            let limit = two_phase.correction_cap * so_far;
            let length = norm(&du[..moving]);
            if length > limit && limit > 0.0 {
                scale(&mut du, limit / length);
            }
        }
        let most = match phase {
            Phase::Pure | Phase::Path => reach,
            Phase::Relaxation => two_phase.relaxation.largest_strain,
        };
        let strain = largest_strain(problem, &iterate.coordinates, &du);
        if strain > most {
            scale(&mut du, most / strain);
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
        safeguarded: damping.touched(guarded, problem.gauss_point_count()),
        linear_residual: solution.relative_residual,
    })
}
