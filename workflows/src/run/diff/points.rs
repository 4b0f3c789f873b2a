//! How far apart the Gauss points of two runs are at one step.

use std::collections::BTreeSet;

use solver_fem::GaussPointId;
use store::StepReader;

use crate::run::{
    error::RunError,
    load,
    point::PointState,
    view::{RunView, View},
};

/// How far apart a Gauss point is in two runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Which.
    pub point: GaussPointId,
    /// Largest difference of a stress component.
    pub stress: f64,
    /// Largest distance of a grain from where it is in the other, over the mean diameter; infinite where the grains are others.
    pub positions: f64,
    /// Largest difference of a component of the cell, over the cell's largest.
    pub cell: f64,
    /// Contacts that one has and the other has not.
    pub contacts: usize,
}

impl Apart {
    /// The order of those furthest apart first: by the stress, which is what the body feels; then by the grains.
    pub fn furthest_first(&self, other: &Self) -> std::cmp::Ordering {
        let by_stress = other.stress.total_cmp(&self.stress);
        let by_grains = other.positions.total_cmp(&self.positions);
        by_stress.then(by_grains).then(self.point.cmp(&other.point))
    }
}

/// The points that differ at a step, in order, and how many were compared.
///
/// # Errors
/// A step that cannot be read, or runs of different numbers of points.
pub fn apart(
    view: &View,
    runs: &[RunView; 2],
    readers: &[StepReader; 2],
) -> Result<(Vec<Apart>, usize), RunError> {
    let side = |k: usize| -> Result<_, RunError> {
        let dealt = load::dealt(&view.store, runs[k].id())?;
        let states = load::points(&readers[k], &dealt)?;
        let stress = load::stresses(&runs[k].manifest.problem, &readers[k])?;
        Ok((states, stress))
    };
    let ((states, stress), (other_states, other_stress)) = (side(0)?, side(1)?);
    let (count, other) = (states.len(), other_states.len());
    if count != other {
        return Err(RunError::State(format!(
            "one has {count} Gauss points and the other {other}, so no point can be compared"
        )));
    }
    let mut apart = Vec::new();
    for k in 0..count {
        // The initial state of a body holds no stresses.
        let stress_difference = match (stress.get(k), other_stress.get(k)) {
            (Some(a), Some(b)) => {
                let components = a.iter().flatten().zip(b.iter().flatten());
                components.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
            }
            _ => 0.0,
        };
        let mut one = Apart {
            point: GaussPointId(k as u32),
            stress: stress_difference,
            positions: 0.0,
            cell: 0.0,
            contacts: 0,
        };
        let unequal = states[k] != other_states[k];
        match (&*states[k], &*other_states[k]) {
            (PointState::Rev(a), PointState::Rev(b)) if unequal => grains_apart(a, b, &mut one),
            (PointState::Rev(_), PointState::Elastic { .. })
            | (PointState::Elastic { .. }, PointState::Rev(_)) => one.positions = f64::INFINITY,
            _ => {}
        }
        if unequal || one.stress > 0.0 {
            apart.push(one);
        }
    }
    Ok((apart, count))
}

fn grains_apart(a: &crate::run::point::PlaneRev, b: &crate::run::point::PlaneRev, one: &mut Apart) {
    if a.grains != b.grains {
        one.positions = f64::INFINITY;
        return;
    }
    let pairs = a.state.positions.iter().zip(&b.state.positions);
    let distances = pairs.map(|(x, y)| {
        let d = [x[0] - y[0], x[1] - y[1]];
        (d[0] * d[0] + d[1] * d[1]).sqrt()
    });
    one.positions = distances.fold(0.0, f64::max) / a.grains.mean_diameter();
    let (h, other) = (a.state.cell.h, b.state.cell.h);
    let size = h.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let cells = h.iter().flatten().zip(other.iter().flatten());
    one.cell = cells.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size;
    let contacts = |rev: &crate::run::point::PlaneRev| -> BTreeSet<(u32, u32)> {
        rev.state.contacts.iter().map(|c| (c.i, c.j)).collect()
    };
    one.contacts = contacts(a).symmetric_difference(&contacts(b)).count();
}
