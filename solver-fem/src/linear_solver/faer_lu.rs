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

use super::checked::{Factors, Matrix, WeakestMotion, check_values};
use super::scaling::scaling;
use super::{Factorisation, LinearError, LinearSolver};
use crate::assembly::Pattern;
use crate::layout::Field;

/// Sparse LU with partial pivoting on a fixed pattern.
#[derive(Debug)]
pub struct FaerLu {
    pattern: Arc<Pattern>,
    fields: Vec<Field>,
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
    /// Orders the columns and finds the fill of the factors. `fields` holds the field of every equation: they
    /// decide what counts as singular, not the factors.
    ///
    /// # Errors
    /// Lack of memory.
    ///
    /// # Panics
    /// When there is not one field per equation.
    pub fn analyse(pattern: Arc<Pattern>, fields: Vec<Field>) -> Result<Self, LinearError> {
        assert_eq!(fields.len(), pattern.size, "one field per equation");
        let symbolic = factorize_symbolic_lu(structure(&pattern), LuSymbolicParams::default())
            .map_err(|error| LinearError::Backend(format!("{error:?}")))?;
        Ok(FaerLu {
            pattern,
            fields,
            symbolic,
        })
    }

    /// The equation behind an exact zero pivot, whose factors hold no number any more: the same
    /// matrix with a trace of stiffness everywhere shows the motion that has no other.
    fn name_zero_pivot(&self, matrix: &Matrix<'_>) -> Result<usize, LinearError> {
        let mut shifted = matrix.values.to_vec();
        // A matrix of zeros has no scale of its own.
        let scale = matrix.largest();
        let trace = if scale > 0.0 { 1e-12 * scale } else { 1.0 };
        for column in 0..self.pattern.size {
            let s = matrix.scale[column];
            for entry in self.pattern.columns[column]..self.pattern.columns[column + 1] {
                if self.pattern.rows[entry] == column {
                    shifted[entry] += trace / (s * s);
                }
            }
        }
        let shifted = Matrix {
            values: &shifted,
            ..matrix.clone()
        };
        let weakest = WeakestMotion::find(&self.numeric(shifted)?)?;
        Ok(weakest.equation.unwrap_or(0))
    }

    fn numeric<'a>(&'a self, matrix: Matrix<'a>) -> Result<SparseFactors<'a>, LinearError> {
        let values = SparseColMatRef::new(structure(&self.pattern), matrix.values);
        let mut numeric = NumericLu::new();
        let need = self
            .symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory())?;
        self.symbolic
            .factorize_numeric_lu(
                &mut numeric,
                values,
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
        Ok(SparseFactors {
            solver: self,
            matrix,
            numeric,
        })
    }
}

fn out_of_memory() -> LinearError {
    LinearError::Backend("out of memory".into())
}

impl LinearSolver for FaerLu {
    fn factorise<'a>(
        &'a self,
        values: &'a [f64],
    ) -> Result<Box<dyn Factorisation + 'a>, LinearError> {
        check_values(&self.pattern, values)?;
        let factors = self.numeric(Matrix {
            pattern: &self.pattern,
            values,
            scale: scaling(&self.pattern, &self.fields, values),
        })?;
        let weakest = WeakestMotion::find(&factors)?;
        if !weakest.is_free() {
            return Ok(Box::new(factors));
        }
        let equation = match weakest.equation {
            Some(equation) => equation,
            None => self.name_zero_pivot(&factors.matrix)?,
        };
        Err(LinearError::Singular {
            equation,
            amplification: weakest.amplification,
        })
    }
}

struct SparseFactors<'a> {
    solver: &'a FaerLu,
    matrix: Matrix<'a>,
    numeric: NumericLu<usize, f64>,
}

impl Factors for SparseFactors<'_> {
    fn matrix(&self) -> &Matrix<'_> {
        &self.matrix
    }

    fn substitute(&self, x: &mut [f64]) -> Result<(), LinearError> {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::{Condition, Target, Value};
    use crate::linear_solver::VERSIONS;
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
        let (_, version) = VERSIONS.split_once("faer ").expect("the library is named");
        let line = format!("version = \"{version}\"\n");
        assert!(entry.expect("faer is locked").contains(&line), "{VERSIONS}");
    }

    #[test]
    fn an_unsymmetric_system_is_solved_to_roundoff() {
        let pattern = pattern();
        let values = values(&pattern);
        let exact: Vec<f64> = (0..pattern.size).map(|i| (i as f64).sin()).collect();
        let rhs = pattern.multiply(&values, &exact);
        let solver = FaerLu::analyse(
            Arc::clone(&pattern),
            vec![Field::Displacement; pattern.size],
        )
        .expect("analysed");
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
            let solver = FaerLu::analyse(
                Arc::clone(&pattern),
                vec![Field::Displacement; pattern.size],
            )
            .expect("analysed");
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
        let solver = FaerLu::analyse(
            Arc::clone(&pattern),
            vec![Field::Displacement; pattern.size],
        )
        .expect("analysed");
        assert_eq!(
            solver.factorise(&values).err(),
            Some(LinearError::NonFinite)
        );
    }
}
