//! Hand-made systems whose pivots must wait, and what becomes of matrices without one.

use std::sync::Arc;

use super::factorise::{Outcome, Store};
use super::*;

/// Elements in a row, one unit apart, with the dense matrices that are added up.
struct Row {
    elements: Vec<(Vec<usize>, Vec<Vec<f64>>)>,
    fields: Vec<Field>,
}

impl Row {
    fn solver(&self) -> (Multifrontal, Vec<f64>) {
        let equations: Vec<Vec<Option<usize>>> = self
            .elements
            .iter()
            .map(|(e, _)| e.iter().copied().map(Some).collect())
            .collect();
        let pattern = Pattern::of_elements(self.fields.len(), &equations);
        let mut values = vec![0.0; pattern.entry_count()];
        for (number, (_, matrix)) in self.elements.iter().enumerate() {
            for (row, numbers) in matrix.iter().enumerate() {
                for (column, number_there) in numbers.iter().enumerate() {
                    let entry = pattern.entry(number, row, column).expect("free");
                    values[entry] += number_there;
                }
            }
        }
        let centres: Vec<[f64; 1]> = (0..self.elements.len()).map(|i| [i as f64]).collect();
        (
            Multifrontal::analyse(Arc::new(pattern), self.fields.clone(), &centres),
            values,
        )
    }
}

/// A bar of springs fixed at one end, whose elements each prescribe their elongation by a multiplier. Equations: 0..n
/// displacements of the right ends, n..2n multipliers.
fn bar(count: usize) -> Row {
    let elements = (0..count)
        .map(|e| {
            let s = 1.0 + 0.1 * e as f64;
            if e == 0 {
                (vec![0, count], vec![vec![s, 1.0], vec![1.0, 0.0]])
            } else {
                (
                    vec![e - 1, e, count + e],
                    vec![vec![s, -s, -1.0], vec![-s, s, 1.0], vec![-1.0, 1.0, 0.0]],
                )
            }
        })
        .collect();
    Row {
        elements,
        fields: [Field::Displacement, Field::Multiplier]
            .iter()
            .flat_map(|&field| vec![field; count])
            .collect(),
    }
}

fn outcome(solver: &Multifrontal, values: &[f64]) -> Outcome {
    let matrix = Matrix {
        pattern: &solver.pattern,
        values,
        scale: scaling(&solver.pattern, &solver.fields, values),
    };
    Store::default().factorise(&solver.plans, &matrix)
}

fn assert_solves(solver: &Multifrontal, values: &[f64]) {
    let exact: Vec<f64> = (0..solver.pattern.size)
        .map(|i| 1.0 + (i as f64).sin())
        .collect();
    let rhs = solver.pattern.multiply(values, &exact);
    let factors = solver.factorise(values).expect("regular");
    let solution = factors.solve(&rhs).expect("finite");
    assert!(
        solution.relative_residual < 1e-14,
        "{}",
        solution.relative_residual
    );
    for (x, exact) in solution.x.iter().zip(&exact) {
        assert!((x - exact).abs() < 1e-11, "{x} against {exact}");
    }
}

/// Each leaf of four elements holds four multipliers and the three displacements between them: one multiplier finds no
/// pivot below the front that sums the displacement at the leaf's end.
#[test]
fn multipliers_without_a_pivot_in_their_front_wait_for_their_parent() {
    for count in [5, 8, 64, 100] {
        let (solver, values) = bar(count).solver();
        assert!(outcome(&solver, &values).delayed > 0, "of {count}");
        assert_solves(&solver, &values);
    }
}

/// Unknowns of the first element that couple to nothing but unknowns which all elements share: they pass every front
/// unpivoted and are eliminated at the root, all by exchanges, as no diagonal holds anything.
#[test]
fn pivots_wait_as_far_as_the_root() {
    let (count, shared) = (32, 3);
    let mut elements = Vec::new();
    for e in 0..count {
        let mut own = vec![0, 1, 2];
        let mut matrix = vec![vec![0.0; 6]; 6];
        if e > 0 {
            // Chains of their own, so that there are fronts to pass.
            own = vec![2 * shared + e - 1];
            matrix = vec![vec![0.0; 4]; 4];
            matrix[0][0] = 2.0 + e as f64;
        } else {
            for i in 0..shared {
                matrix[i][shared + (i + 1) % shared] = 1.0 + i as f64;
                matrix[shared + (i + 2) % shared][i] = 3.0 - 0.5 * i as f64;
            }
        }
        own.extend(shared..2 * shared);
        elements.push((own, matrix));
    }
    let row = Row {
        elements,
        fields: vec![Field::Displacement; 2 * shared + count - 1],
    };
    let (solver, values) = row.solver();
    let depth = solver
        .plans
        .iter()
        .filter(|plan| plan.border().len() >= shared)
        .count();
    assert!(depth > 4, "a tree of some depth: {depth}");
    // Three unknowns, once more in every front on the way up: 32 elements in leaves of 4 make three of them.
    assert_eq!(outcome(&solver, &values).delayed, 3 * shared);
    assert_solves(&solver, &values);
}

/// A pivot that is there but small beside the border's entries would multiply them by its inverse.
#[test]
fn a_small_pivot_waits_too() {
    let mut row = bar(16);
    row.fields = vec![Field::Displacement; 32];
    for (_, matrix) in &mut row.elements {
        let last = matrix.len() - 1;
        matrix[last][last] = -1e-13;
    }
    let (solver, values) = row.solver();
    assert!(outcome(&solver, &values).delayed > 0);
    assert_solves(&solver, &values);
}

#[test]
fn an_equation_without_any_entry_is_named() {
    let mut row = bar(20);
    let lost = 33;
    for (equations, matrix) in &mut row.elements {
        for (i, &row) in equations.iter().enumerate() {
            for (j, &column) in equations.iter().enumerate() {
                if row == lost || column == lost {
                    matrix[i][j] = 0.0;
                }
            }
        }
    }
    let (solver, values) = row.solver();
    assert_eq!(
        solver.factorise(&values).err(),
        Some(LinearError::Singular {
            equation: lost,
            amplification: f64::INFINITY
        })
    );
    // Two motions without stiffness are no worse than one, nor is a matrix of zeros.
    for values in [
        values.iter().map(|v| v * 0.0).collect::<Vec<_>>(),
        vec![0.0; values.len()],
    ] {
        assert!(matches!(
            solver.factorise(&values).err(),
            Some(LinearError::Singular { .. })
        ));
    }
}

/// The factorisation takes the memory of the one before: nothing of it may show.
#[test]
fn factors_do_not_depend_on_those_before() {
    let (solver, values) = bar(50).solver();
    let rhs: Vec<f64> = (0..100).map(|i| (i as f64).cos()).collect();
    let first = solver.factorise(&values).expect("regular").solve(&rhs);
    let other: Vec<f64> = values.iter().map(|v| 1e3 * v).collect();
    let both = (
        solver.factorise(&other).expect("regular"),
        solver.factorise(&values).expect("regular"),
    );
    assert_eq!(both.1.solve(&rhs), first);
    drop(both);
    assert_eq!(
        solver.factorise(&values).expect("regular").solve(&rhs),
        first
    );
}
