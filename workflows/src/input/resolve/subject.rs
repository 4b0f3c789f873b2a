//! What a programme loads, as far as its stages may name parts of it.

use std::cell::OnceCell;

use solver_fem::boundary::CavityProblem;
use solver_fem::problem::Problem;

use super::mesh::MOST_ELEMENTS;
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
    /// The problem of the body, once something asks for it; `None` where it makes none.
    problem: OnceCell<Option<Box<Problem<2>>>>,
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
                problem: OnceCell::new(),
            }),
            Model::ElementTest(_) => Subject::ElementTest,
        }
    }
}

impl Named<'_> {
    /// Why the volume behind a boundary cannot be measured. A mesh or conditions that make no body are told elsewhere.
    pub fn cavity_problem(&self, boundary: &str) -> Option<CavityProblem> {
        let problem = self.problem.get_or_init(|| {
            let is_too_large = self.body.mesh.element_count() > MOST_ELEMENTS;
            let built = (!is_too_large).then(|| body::problem(self.body, self.loads));
            built?.ok().map(|(problem, _)| Box::new(problem))
        });
        problem.as_ref()?.cavity(boundary).err()
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
