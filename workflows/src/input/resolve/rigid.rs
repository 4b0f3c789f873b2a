//! Whether the prescribed displacements hold the body in place.

use super::read::Reader;
use crate::input::boundaries::Place;
use crate::input::path::Path;
use crate::input::problem::ConditionKind;

/// A direction shorter than this, after the known ones are taken out, counts as none.
const NEGLIGIBLE: f64 = 1e-9;

/// Reports the rigid motions that `conditions` leave free: with one of them the equations have no single solution.
///
/// A plane rigid motion moves the point (X, Y) by u = (t_x − ω Y, t_y + ω X). A displacement prescribed along x at a
/// point is one equation (1, 0, −Y) for (t_x, t_y, ω), along y it is (0, 1, X); rank 3 of all of them holds the body.
pub fn check<'p>(
    reader: &mut Reader<'_, '_>,
    section: &Path,
    places: &[Place],
    conditions: impl Iterator<Item = (&'p Place, &'p ConditionKind)>,
) {
    let size = places
        .iter()
        .flat_map(|place| &place.points)
        .flatten()
        .fold(0.0_f64, |size, x| size.max(x.abs()));
    let mut held: Vec<[f64; 3]> = Vec::new();
    for (place, kind) in conditions {
        let ConditionKind::Displacement { component, .. } = kind else {
            continue;
        };
        for [x, y] in &place.points {
            let row = if *component == 0 {
                [1.0, 0.0, -y / size]
            } else {
                [0.0, 1.0, x / size]
            };
            if let Some(direction) = orthogonal(row, &held) {
                held.push(direction);
            }
        }
    }
    let free = 3 - held.len().min(3);
    if free == 0 {
        return;
    }
    let is_free = |axis: usize| {
        held.iter()
            .all(|direction| direction[axis].abs() < NEGLIGIBLE)
    };
    let mut motions = Vec::new();
    if is_free(0) {
        motions.push("move along x");
    }
    if is_free(1) {
        motions.push("move along y");
    }
    if motions.len() < free {
        motions.push("turn");
    }
    let message = format!("the body is free to {}", motions.join(" and to "));
    let help = "prescribe displacements that hold it, on a boundary or a node, as in `{ on: …, displacement: { x: 0 } }`";
    reader.report.at(section, message, help.to_owned());
}

/// The part of `row` that is orthogonal to all of `held`, of length 1; `None` where nothing is left of it.
fn orthogonal(mut row: [f64; 3], held: &[[f64; 3]]) -> Option<[f64; 3]> {
    for direction in held {
        let along: f64 = row.iter().zip(direction).map(|(a, b)| a * b).sum();
        row.iter_mut()
            .zip(direction)
            .for_each(|(a, b)| *a -= along * b);
    }
    let length = row.iter().map(|a| a * a).sum::<f64>().sqrt();
    (length > NEGLIGIBLE).then(|| row.map(|a| a / length))
}
