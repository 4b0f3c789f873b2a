//! From an iterate to the next one: choice of tangents, linear solve, cap, geometric check.

use super::linearised::{Bounded, Equilibrium, Solution, adapt};
use super::relaxation::{add_viscosity, largest_strain};
use super::state::{Iterate, Size};
use super::{Control, FailureReason, Phase, Safeguarded, StepSettings, Strategy, safeguard};
use crate::kinematics::{InvertedElement, point_geometry};
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
