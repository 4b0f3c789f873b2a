//! Going on from an earlier answer instead of starting again from the base.
//!
//! Where return mapping from the base finds no equilibrium, the answer takes re-basing or a path, and then depends on its
//! way: asked again from the base at a slightly other F it is found again at the full price and with another error, and
//! a Newton iteration sees noise. From the earlier end state only the small change of F is left, over which return
//! mapping settles at once and smoothly. What it costs is that friction mobilised by the earlier F stays: an earlier F
//! that is a mere guess is not to be gone on from, see [`Trust`].

use std::sync::Arc;

use crate::{
    Rev,
    respond::{check, respond, stretched_by},
    response::{EquilibriumError, Method, Response, Start, Trust},
    settings::Settings,
    tensor::{Tensor2, product},
};

/// The rest of the way from an earlier end state.
pub(crate) struct Onward<'a> {
    reference: Rev<2, 1>,
    /// Rotations of the grains from the base to the reference.
    before: &'a [f64],
    /// F from the reference.
    rest: Tensor2<2>,
}

impl<'a> Onward<'a> {
    /// The rest of the way to `gradient`, counted from `base`. `None` when the start is no reference or does not fit.
    pub fn from(base: &Rev<2, 1>, start: Start<'a>, gradient: &Tensor2<2>) -> Option<Self> {
        if start.trust == Trust::Guess || start.rotations.len() != base.state.positions.len() {
            return None;
        }
        let reference = Rev {
            grains: Arc::clone(&base.grains),
            law: base.law,
            state: start.state.clone(),
        };
        let target = base.state.cell.deformed(gradient);
        let rest = product(&target.h, &start.state.cell.inverse()?);
        let sound = check(&reference, &rest).is_ok()
            && start.rotations.iter().all(|theta| theta.is_finite());
        // Another choice of cell vectors would look like a large deformation.
        let near = stretched_by(&rest) < 0.2;
        (near && sound).then_some(Self {
            reference,
            before: start.rotations,
            rest,
        })
    }

    /// The answer, rotations counted from the base.
    pub fn respond(
        &self,
        gradient: &Tensor2<2>,
        settings: &Settings,
    ) -> Result<Response, EquilibriumError> {
        let mut response = respond(&self.reference, None, &self.rest, settings)?;
        for (rotation, before) in response.rotations.iter_mut().zip(self.before) {
            *rotation += before;
        }
        response.gradient = *gradient;
        if response.report.method == Method::ReturnMapping {
            response.report.method = Method::Rebased;
        }
        Ok(response)
    }
}
