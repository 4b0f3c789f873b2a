//! What a factorisation is asked beside a solution, the same for every backend: is the matrix
//! singular and where, and one step of iterative refinement.

use super::{Factorisation, LinearError, Solution};
use crate::assembly::Pattern;
use crate::tensor::norm;

/// Condition estimate above which a matrix counts as singular: at 1e14 a solution keeps no correct
/// digit that a displacement tolerance could use.
const SINGULAR: f64 = 1e14;

/// A matrix with the scaling in which it is judged.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Matrix<'a> {
    pub pattern: &'a Pattern,
    pub values: &'a [f64],
    /// s_i of [`scaling`](super::scaling::scaling).
    pub scale: Vec<f64>,
}

/// The factors of a [`Matrix`].
pub(super) trait Factors {
    /// What was factorised.
    fn matrix(&self) -> &Matrix<'_>;

    /// x ← A⁻¹·x, once, without refinement.
    ///
    /// # Errors
    /// Lack of memory.
    fn substitute(&self, x: &mut [f64]) -> Result<(), LinearError>;
}

/// One value per entry, and all of them numbers.
pub(super) fn check_values(pattern: &Pattern, values: &[f64]) -> Result<(), LinearError> {
    if values.len() != pattern.entry_count() || values.iter().any(|value| !value.is_finite()) {
        return Err(LinearError::NonFinite);
    }
    Ok(())
}

/// The motion that a matrix resists least.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct WeakestMotion {
    /// ‖A⁻¹‖·max|a_ij| as far as it was found, in scaled unknowns.
    pub amplification: f64,
    /// The equation that moves most, `None` where the factors hold no number any more.
    pub equation: Option<usize>,
}

impl WeakestMotion {
    /// Inverse iteration from a fixed, unstructured vector: it turns into the motion with the least
    /// stiffness.
    pub fn find(factors: &impl Factors) -> Result<Self, LinearError> {
        let Matrix { pattern, scale, .. } = factors.matrix();
        let largest = factors.matrix().largest();
        // Multiples of the golden ratio: no accidental orthogonality to smooth motions.
        let mut x: Vec<f64> = (1..=pattern.size)
            .map(|i| 0.5 + (i as f64 * 0.618_033_988_749_894_9).fract())
            .collect();
        let mut amplification: f64 = 0.0;
        for _ in 0..2 {
            let before = norm(&x);
            // (S·A·S)⁻¹ = S⁻¹·A⁻¹·S⁻¹.
            x.iter_mut().zip(scale).for_each(|(x, s)| *x /= s);
            factors.substitute(&mut x)?;
            x.iter_mut().zip(scale).for_each(|(x, s)| *x /= s);
            let after = norm(&x);
            let growth = largest * after / before;
            // A NaN too: no estimate is one.
            if !growth.is_finite() {
                return Ok(WeakestMotion {
                    amplification: f64::INFINITY,
                    equation: largest_entry(&x),
                });
            }
            amplification = amplification.max(growth);
            x.iter_mut().for_each(|x| *x /= after);
        }
        Ok(WeakestMotion {
            amplification,
            equation: largest_entry(&x),
        })
    }

    /// Whether no digit of a solution would be correct.
    pub fn is_free(&self) -> bool {
        self.amplification >= SINGULAR
    }
}

/// Position of the largest magnitude, `None` when an entry is not finite.
fn largest_entry(x: &[f64]) -> Option<usize> {
    if x.iter().any(|value| !value.is_finite()) {
        return None;
    }
    (0..x.len()).max_by(|&a, &b| x[a].abs().total_cmp(&x[b].abs()).then(b.cmp(&a)))
}

impl Matrix<'_> {
    /// max|s_i a_ij s_j|.
    pub fn largest(&self) -> f64 {
        let mut largest: f64 = 0.0;
        for column in 0..self.pattern.size {
            for entry in self.pattern.columns[column]..self.pattern.columns[column + 1] {
                let scale = self.scale[self.pattern.rows[entry]] * self.scale[column];
                largest = largest.max((self.values[entry] * scale).abs());
            }
        }
        largest
    }

    /// b − A·x.
    fn defect(&self, rhs: &[f64], x: &[f64]) -> Vec<f64> {
        let product = self.pattern.multiply(self.values, x);
        rhs.iter().zip(product).map(|(b, ax)| b - ax).collect()
    }
}

impl<F: Factors> Factorisation for F {
    fn solve(&self, rhs: &[f64]) -> Result<Solution, LinearError> {
        let matrix = self.matrix();
        let size = norm(rhs);
        if rhs.len() != matrix.pattern.size || !size.is_finite() {
            return Err(LinearError::NonFinite);
        }
        if size == 0.0 {
            return Ok(Solution {
                x: vec![0.0; rhs.len()],
                relative_residual: 0.0,
            });
        }
        let mut x = rhs.to_vec();
        self.substitute(&mut x)?;
        let mut correction = matrix.defect(rhs, &x);
        self.substitute(&mut correction)?;
        for (value, correction) in x.iter_mut().zip(&correction) {
            *value += correction;
        }
        if x.iter().any(|value| !value.is_finite()) {
            return Err(LinearError::NonFinite);
        }
        let relative_residual = norm(&matrix.defect(rhs, &x)) / size;
        Ok(Solution {
            x,
            relative_residual,
        })
    }
}
