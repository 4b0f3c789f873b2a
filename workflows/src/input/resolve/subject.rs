//! What a programme loads, as far as its stages may name parts of it.

use std::cell::OnceCell;

use solver_fem::boundary::CavityProblem;
use solver_fem::post::boundary_force;
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
    /// What the conditions that prescribe its displacement name: name and component.
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
        self.problem()?.cavity(boundary).err()
    }

    /// Whether some node of a boundary or node set has this component of its displacement prescribed, by whatever name the
    /// condition calls it: elsewhere no support exerts a force. A mesh or conditions that make no body are told elsewhere.
    pub fn is_supported(&self, on: &str, component: usize) -> bool {
        let is_here = |support: &(String, usize)| support.0 == on && support.1 == component;
        if self.supports.iter().any(is_here) {
            return true;
        }
        let Some(problem) = self.problem() else {
            return true;
        };
        // The force if every prescribed component bore one of 1: the number of those that are there.
        let dofs = &problem.constraints().equation[..problem.dof_count()];
        let prescribed = dofs.iter().map(|equation| f64::from(equation.is_none()));
        let forces: Vec<f64> = prescribed.collect();
        let target = body::target(problem.mesh(), on);
        boundary_force(problem, &target, &forces)[component] > 0.0
    }

    fn problem(&self) -> Option<&Problem<2>> {
        let problem = self.problem.get_or_init(|| {
            let is_too_large = self.body.mesh.element_count() > MOST_ELEMENTS;
            let built = (!is_too_large).then(|| body::problem(self.body, self.loads));
            built?.ok().map(|(problem, _)| Box::new(problem))
        });
        problem.as_deref()
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
