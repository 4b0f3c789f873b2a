//! faer's sparse LU: sequential, column ordering and symbolic part computed once.
//!
//! Sequential on purpose: the same bits for any thread count, and two threads were measured to
//! gain nothing at these sizes.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use super::{Factorisation, LinearError, LinearSolver, Solution};
use crate::assembly::Pattern;
use crate::tensor::norm;

/// The library with its version: with the processor's features it decides the last bits of a macro solve.
pub const BACKEND: &str = "faer 0.24.4";

/// Condition estimate above which a matrix counts as singular: at 1e14 a solution keeps no correct
/// digit that a displacement tolerance could use.
const SINGULAR: f64 = 1e14;

/// Sparse LU with partial pivoting on a fixed pattern.
#[derive(Debug)]
pub struct FaerLu {
    pattern: Arc<Pattern>,
    symbolic: SymbolicLu<usize>,
}

fn structure(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let Pattern {
        size,
        columns,
        rows,
        ..
    } = pattern;
    SymbolicSparseColMatRef::new_checked(*size, *size, columns, None, rows)
}

impl FaerLu {
    /// Orders the columns and finds the fill of the factors.
    ///
    /// # Errors
    /// Lack of memory.
    pub fn analyse(pattern: Arc<Pattern>) -> Result<Self, LinearError> {
        let symbolic = factorize_symbolic_lu(structure(&pattern), LuSymbolicParams::default())
            .map_err(|error| LinearError::Backend(format!("{error:?}")))?;
        Ok(FaerLu { pattern, symbolic })
    }

    /// The equation behind an exact zero pivot, whose factors hold no number any more: the same
    /// matrix with a trace of stiffness everywhere shows the motion that has no other.
    fn name_zero_pivot(&self, values: &[f64]) -> Result<usize, LinearError> {
        let mut shifted = values.to_vec();
        // A matrix of zeros has no scale of its own.
        let scale = largest(values);
        let trace = if scale > 0.0 { 1e-12 * scale } else { 1.0 };
        for column in 0..self.pattern.size {
            for entry in self.pattern.columns[column]..self.pattern.columns[column + 1] {
                if self.pattern.rows[entry] == column {
                    shifted[entry] += trace;
                }
            }
        }
        let (_, motion) = self.numeric(&shifted)?.weakest_motion()?;
        Ok(largest_entry(&motion).unwrap_or(0))
    }

    fn numeric<'a>(&'a self, values: &'a [f64]) -> Result<Factors<'a>, LinearError> {
        let matrix = SparseColMatRef::new(structure(&self.pattern), values);
        let mut numeric = NumericLu::new();
        let need = self
            .symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory())?;
        self.symbolic
            .factorize_numeric_lu(
                &mut numeric,
                matrix,
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|error| match error {
                faer::sparse::linalg::LuError::SymbolicSingular { index } => {
                    // The backend counts in its own column order.
                    let (forward, _) = self.symbolic.col_perm().arrays();
                    let equation = forward.get(index).copied().unwrap_or(index);
                    LinearError::Singular {
                        equation,
                        amplification: f64::INFINITY,
                    }
                }
                other => LinearError::Backend(format!("{other:?}")),
            })?;
        Ok(Factors {
            solver: self,
            numeric,
            values,
        })
    }
}

/// Largest magnitude.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, value| max.max(value.abs()))
}

/// Position of the largest magnitude, `None` when an entry is not finite.
fn largest_entry(x: &[f64]) -> Option<usize> {
    if x.iter().any(|value| !value.is_finite()) {
        return None;
    }
    (0..x.len()).max_by(|&a, &b| x[a].abs().total_cmp(&x[b].abs()).then(b.cmp(&a)))
}

fn out_of_memory() -> LinearError {
    LinearError::Backend("out of memory".into())
}

impl LinearSolver for FaerLu {
    fn factorise<'a>(
        &'a self,
        values: &'a [f64],
    ) -> Result<Box<dyn Factorisation + 'a>, LinearError> {
        if values.len() != self.pattern.entry_count() || values.iter().any(|v| !v.is_finite()) {
            return Err(LinearError::NonFinite);
        }
        let factors = self.numeric(values)?;
        let (amplification, motion) = factors.weakest_motion()?;
        if amplification < SINGULAR {
            return Ok(Box::new(factors));
        }
        let equation = match largest_entry(&motion) {
            Some(equation) => equation,
            None => self.name_zero_pivot(values)?,
        };
        Err(LinearError::Singular {
            equation,
            amplification,
        })
    }
}

struct Factors<'a> {
    solver: &'a FaerLu,
    numeric: NumericLu<usize, f64>,
    values: &'a [f64],
}

impl Factors<'_> {
    fn back_substitute(&self, x: &mut [f64]) -> Result<(), LinearError> {
        let symbolic = &self.solver.symbolic;
        let need = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory())?;
        let size = x.len();
        LuRef::new_unchecked(symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, size, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        Ok(())
    }

    /// Inverse iteration from a fixed, unstructured vector: the amplification ‖A⁻¹‖·max|a_ij| it
    /// finds, and the vector, which turns into the motion with the least stiffness.
    fn weakest_motion(&self) -> Result<(f64, Vec<f64>), LinearError> {
        let size = self.solver.pattern.size;
        // Multiples of the golden ratio: no accidental orthogonality to smooth motions.
        let mut x: Vec<f64> = (1..=size)
            .map(|i| 0.5 + (i as f64 * 0.618_033_988_749_894_9).fract())
            .collect();
        let mut amplification: f64 = 0.0;
        for _ in 0..2 {
            let before = norm(&x);
            self.back_substitute(&mut x)?;
            let after = norm(&x);
            let growth = largest(self.values) * after / before;
            if !growth.is_finite() {
                return Ok((f64::INFINITY, x));
            }
            amplification = amplification.max(growth);
            for value in &mut x {
                *value /= after;
            }
        }
        Ok((amplification, x))
    }

    /// b − A·x.
    fn defect(&self, rhs: &[f64], x: &[f64]) -> Vec<f64> {
        let product = self.solver.pattern.multiply(self.values, x);
        rhs.iter().zip(product).map(|(b, ax)| b - ax).collect()
    }
}

impl Factorisation for Factors<'_> {
    fn solve(&self, rhs: &[f64]) -> Result<Solution, LinearError> {
        let size = norm(rhs);
        if rhs.len() != self.solver.pattern.size || !size.is_finite() {
            return Err(LinearError::NonFinite);
        }
        if size == 0.0 {
            return Ok(Solution {
                x: vec![0.0; rhs.len()],
                relative_residual: 0.0,
            });
        }
        let mut x = rhs.to_vec();
        self.back_substitute(&mut x)?;
        let mut correction = self.defect(rhs, &x);
        self.back_substitute(&mut correction)?;
        for (value, correction) in x.iter_mut().zip(&correction) {
            *value += correction;
        }
        if x.iter().any(|value| !value.is_finite()) {
            return Err(LinearError::NonFinite);
        }
        let relative_residual = norm(&self.defect(rhs, &x)) / size;
        Ok(Solution {
            x,
            relative_residual,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::{Condition, Target, Value};
    use crate::mesh::{Mesh, Rectangle};
    use crate::problem::Problem;

    fn pattern() -> Arc<Pattern> {
        let mesh = Mesh::rectangle(&Rectangle {
            size: [1.0, 1.0],
            elements: [3, 4],
        });
        let conditions = (0..2)
            .map(|i| Condition::displacement(Target::boundary("left"), i, Value::Constant(0.0)))
            .collect();
        let problem = Problem::plane_strain(mesh.expect("sound"), conditions, 0).expect("sound");
        Arc::clone(problem.pattern())
    }

    /// Unsymmetric values, diagonally dominant.
    fn values(pattern: &Pattern) -> Vec<f64> {
        let mut values = Vec::new();
        for column in 0..pattern.size {
            for entry in pattern.columns[column]..pattern.columns[column + 1] {
                let noise = ((entry * 37 % 101) as f64 / 50.0) - 1.0;
                values.push(if pattern.rows[entry] == column {
                    90.0
                } else {
                    noise
                });
            }
        }
        values
    }

    /// Runs record the version; a stale one would send a search for a difference the wrong way.
    #[test]
    fn the_recorded_version_is_the_locked_one() {
        let lock = include_str!("../../../Cargo.lock");
        let entry = lock
            .split("[[package]]")
            .find(|entry| entry.contains("name = \"faer\"\n"));
        let version = BACKEND
            .strip_prefix("faer ")
            .expect("the library comes first");
        let line = format!("version = \"{version}\"\n");
        assert!(entry.expect("faer is locked").contains(&line), "{BACKEND}");
    }

    #[test]
    fn an_unsymmetric_system_is_solved_to_roundoff() {
        let pattern = pattern();
        let values = values(&pattern);
        let exact: Vec<f64> = (0..pattern.size).map(|i| (i as f64).sin()).collect();
        let rhs = pattern.multiply(&values, &exact);
        let solver = FaerLu::analyse(Arc::clone(&pattern)).expect("analysed");
        let solution = solver
            .factorise(&values)
            .expect("regular")
            .solve(&rhs)
            .expect("finite");
        assert!(solution.relative_residual < 1e-14);
        for (x, exact) in solution.x.iter().zip(&exact) {
            assert!((x - exact).abs() < 1e-13);
        }
    }

    #[test]
    fn an_equation_without_stiffness_is_named() {
        let pattern = pattern();
        for tiny in [0.0, 1e-16] {
            let mut values = values(&pattern);
            let lost = 17;
            for column in 0..pattern.size {
                for entry in pattern.columns[column]..pattern.columns[column + 1] {
                    if column == lost || pattern.rows[entry] == lost {
                        let diagonal = column == lost && pattern.rows[entry] == lost;
                        values[entry] = if diagonal { tiny } else { 0.0 };
                    }
                }
            }
            let solver = FaerLu::analyse(Arc::clone(&pattern)).expect("analysed");
            match solver.factorise(&values).err() {
                Some(LinearError::Singular { equation, .. }) => assert_eq!(equation, lost),
                other => panic!("not seen as singular: {other:?}"),
            }
        }
    }

    #[test]
    fn a_nan_is_refused_before_it_reaches_the_backend() {
        let pattern = pattern();
        let mut values = values(&pattern);
        values[3] = f64::NAN;
        let solver = FaerLu::analyse(Arc::clone(&pattern)).expect("analysed");
        assert_eq!(
            solver.factorise(&values).err(),
            Some(LinearError::NonFinite)
        );
    }
}
