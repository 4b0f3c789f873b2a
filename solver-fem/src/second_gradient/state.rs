//! What a step with second gradient leaves to the next one.

use serde::{Deserialize, Serialize};

use super::element::{double_stresses, mismatches};
use crate::assembly::Configuration;
use crate::kinematics::InvertedElement;
use crate::problem::Problem;

/// The fields of second gradient at the end of a step, flat arrays.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug, Default)]
pub struct SecondGradientState {
    /// χ at every Gauss point (D³ each, last index fastest; zero in plain elements); stress × length.
    pub double_stress: Vec<f64>,
    /// λ of every second-gradient element (D² each); stress.
    pub multipliers: Vec<f64>,
    /// v at every corner that carries it, the increment over the step (D² each). No step reads it: output.
    pub increment: Vec<f64>,
    /// The sum of all increments so far. Output likewise.
    pub gradient: Vec<f64>,
    /// ‖grad u − v‖/‖grad u‖ of the step over every second-gradient element, root mean squares over its Gauss
    /// points: λ is constant in an element and ties the means, this is what it leaves. Output likewise.
    pub mismatch: Vec<f64>,
}

impl SecondGradientState {
    /// Nothing has happened yet; `None` in a plain problem.
    pub(crate) fn zero<const D: usize>(problem: &Problem<D>) -> Option<Self> {
        let layout = problem.layout();
        let (gradient, multipliers) = (layout.gradient_count(), layout.multiplier_count());
        (multipliers > 0).then(|| SecondGradientState {
            double_stress: vec![0.0; problem.gauss_point_count() * D * D * D],
            multipliers: vec![0.0; multipliers],
            increment: vec![0.0; gradient],
            gradient: vec![0.0; gradient],
            mismatch: vec![0.0; multipliers / (D * D)],
        })
    }

    /// The fields at the end of a step that began with these ones.
    ///
    /// # Errors
    /// An element that is inverted, or turned half round by the step.
    pub(crate) fn after<const D: usize>(
        &self,
        problem: &Problem<D>,
        at: &Configuration<'_>,
    ) -> Result<Self, InvertedElement> {
        let layout = problem.layout();
        let (motion, v) = (layout.displacement_count(), layout.gradient_count());
        let increment = at.unknowns[motion..motion + v].to_vec();
        let sum = self.gradient.iter().zip(&increment);
        Ok(SecondGradientState {
            double_stress: double_stresses(problem, at)?,
            multipliers: at.unknowns[motion + v..].to_vec(),
            mismatch: mismatches(problem, at)?,
            gradient: sum.map(|(before, increment)| before + increment).collect(),
            increment,
        })
    }
}
