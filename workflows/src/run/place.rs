//! Which Gauss point an address means.

use solver_fem::GaussPointId;

use super::view::RunView;
use crate::{address::RevPlace, input::problem::Model};

/// Gauss points of an element of the run; an element test is one element with one point.
pub fn points_per_element(run: &RunView) -> usize {
    match &run.manifest.problem.model {
        Model::Body(body) => body.mesh.points_per_element(),
        Model::ElementTest(_) => 1,
    }
}

/// The Gauss point at `place`, of `count` in all.
///
/// # Errors
/// It is not in the mesh; the text says which are.
pub fn gauss_point(run: &RunView, place: RevPlace, count: usize) -> Result<GaussPointId, String> {
    let per_element = points_per_element(run);
    let (element, local) = (place.element as usize, place.point as usize);
    let point = element
        .checked_mul(per_element)
        .map(|first| first + local)
        .filter(|point| local < per_element && *point < count);
    match point.and_then(|point| u32::try_from(point).ok()) {
        Some(point) => Ok(GaussPointId(point)),
        None => {
            let last = (count / per_element).saturating_sub(1);
            Err(format!("its REVs are e0.0 to e{last}.{}", per_element - 1))
        }
    }
}

/// The place of a Gauss point.
pub fn place_of(run: &RunView, point: GaussPointId) -> RevPlace {
    let per_element = points_per_element(run) as u32;
    RevPlace {
        element: point.0 / per_element,
        point: point.0 % per_element,
    }
}
