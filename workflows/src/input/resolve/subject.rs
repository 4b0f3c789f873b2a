//! What a programme loads, as far as its stages may name parts of it.

use solver_fem::boundary::CavityProblem;

use crate::input::body;
use crate::input::boundaries::{Place, places};
use crate::input::problem::{Body, ConditionKind, Model};

/// What a programme loads.
pub enum Subject<'a> {
    /// A body.
    Body(Named<'a>),
    /// One point of a material.
    ElementTest,
}

/// What a body has names for.
pub struct Named<'a> {
    /// Its boundaries and nodes.
    pub places: Vec<Place>,
    /// Where its displacement is prescribed: name and component.
    pub supports: Vec<(String, usize)>,
    body: &'a Body,
    loads: usize,
}

impl<'a> Subject<'a> {
    /// That of a model under this number of loads.
    pub fn of(model: &'a Model, loads: usize) -> Self {
        match model {
            Model::Body(body) => Subject::Body(Named {
                places: places(&body.mesh),
                supports: supports(body),
                body,
                loads,
            }),
            Model::ElementTest(_) => Subject::ElementTest,
        }
    }
}

impl Named<'_> {
    /// Why the volume behind a boundary cannot be measured. A mesh or conditions that make no body are told where that
    /// is set up.
    pub fn cavity_problem(&self, boundary: &str) -> Option<CavityProblem> {
        let (problem, _) = body::problem(self.body, self.loads).ok()?;
        problem.cavity(boundary).err()
    }
}

fn supports(body: &Body) -> Vec<(String, usize)> {
    let prescribed = body.conditions.iter().filter_map(|condition| {
        let ConditionKind::Displacement { component, .. } = condition.kind else {
            return None;
        };
        Some((condition.on.clone(), component))
    });
    prescribed.collect()
}
