//! Element multifrontal LU: dense fronts along a dissection of the elements.
//!
//! Each front gathers the equations of the elements below it, eliminates those that no other element
//! knows, and passes the rest on to its parent. Pivots that are too small wait ([`front`]), so that a
//! saddle point with a zero diagonal block needs no care of its own. Sequential, plain arithmetic in one
//! order: the same bits on every processor. A change after which the same matrix gives other bits raises the
//! number in [`VERSIONS`](super::VERSIONS).

mod factorise;
mod front;
mod ordering;
mod substitute;
mod symbolic;

use std::sync::{Arc, Mutex};

use self::factorise::Store;
use self::symbolic::Plan;
use super::checked::{Factors, Matrix, WeakestMotion, check_values};
use super::scaling::scaling;
use super::{Factorisation, LinearError, LinearSolver};
use crate::assembly::Pattern;
use crate::layout::Field;

/// LU over the elements of a mesh, with row pivoting by threshold.
#[derive(Debug)]
pub struct Multifrontal {
    pattern: Arc<Pattern>,
    fields: Vec<Field>,
    plans: Vec<Plan>,
    /// Memory of factors that are no longer needed, for the next ones.
    spare: Mutex<Store>,
}

impl Multifrontal {
    /// Dissects the elements and plans the fronts. `fields` holds the field of every equation, `centres` the centre of
    /// every element of the pattern, for a good order.
    ///
    /// # Panics
    /// When there is not one field per equation and one centre per element.
    pub fn analyse<const D: usize>(
        pattern: Arc<Pattern>,
        fields: Vec<Field>,
        centres: &[[f64; D]],
    ) -> Self {
        assert_eq!(fields.len(), pattern.size, "one field per equation");
        assert_eq!(
            centres.len(),
            pattern.element_count(),
            "one centre per element"
        );
        Multifrontal {
            plans: symbolic::plan(&pattern, &fields, centres),
            fields,
            spare: Mutex::default(),
            pattern,
        }
    }
}

impl LinearSolver for Multifrontal {
    fn factorise<'a>(
        &'a self,
        values: &'a [f64],
    ) -> Result<Box<dyn Factorisation + 'a>, LinearError> {
        check_values(&self.pattern, values)?;
        let matrix = Matrix {
            pattern: &self.pattern,
            values,
            scale: scaling(&self.pattern, &self.fields, values),
        };
        let mut store = self
            .spare
            .lock()
            .map(|mut spare| std::mem::take(&mut *spare))
            .unwrap_or_default();
        let outcome = store.factorise(&self.plans, &matrix);
        let factors = FrontFactors {
            solver: self,
            matrix,
            store,
        };
        let weakest = WeakestMotion::find(&factors)?;
        match outcome.deficient {
            Some(equation) => Err(LinearError::Singular {
                equation: weakest.equation.unwrap_or(equation),
                amplification: f64::INFINITY,
            }),
            None if weakest.is_free() => Err(LinearError::Singular {
                equation: weakest.equation.unwrap_or(0),
                amplification: weakest.amplification,
            }),
            None => Ok(Box::new(factors)),
        }
    }
}

struct FrontFactors<'a> {
    solver: &'a Multifrontal,
    matrix: Matrix<'a>,
    store: Store,
}

impl Drop for FrontFactors<'_> {
    fn drop(&mut self) {
        if let Ok(mut spare) = self.solver.spare.lock() {
            *spare = std::mem::take(&mut self.store);
        }
    }
}

impl Factors for FrontFactors<'_> {
    fn matrix(&self) -> &Matrix<'_> {
        &self.matrix
    }

    fn substitute(&self, x: &mut [f64]) -> Result<(), LinearError> {
        let scale = &self.matrix.scale;
        x.iter_mut().zip(scale).for_each(|(x, s)| *x *= s);
        self.store.substitute(x);
        x.iter_mut().zip(scale).for_each(|(x, s)| *x *= s);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
