//! Diagonal scaling by field: with A' = S·A·S a stiffness, a double-stress modulus and a multiplier
//! can be compared, whatever the units they are given in.
//!
//! s_f = ⟨|a_ii|⟩_f^-½ for a field with a diagonal, s_g = 1/max(s_f·|a_ij|, i in f, j in g) for one
//! without, f being the first field that couples to it. One factor a field and not one an equation:
//! under softening a single diagonal entry may pass through zero.

use crate::assembly::Pattern;
use crate::layout::Field;

/// Number of fields.
const COUNT: usize = 3;

fn index(field: Field) -> usize {
    match field {
        Field::Displacement => 0,
        Field::Gradient => 1,
        Field::Multiplier => 2,
    }
}

/// The factor of every equation; `fields[i]` is the field of equation i.
pub(super) fn scaling(pattern: &Pattern, fields: &[Field], values: &[f64]) -> Vec<f64> {
    let mut sums = [0.0; COUNT];
    let mut numbers = [0_u32; COUNT];
    // Largest coupling between two fields: how large a multiplier's row is.
    let mut coupling = [[0.0_f64; COUNT]; COUNT];
    for column in 0..pattern.size {
        let at = index(fields[column]);
        numbers[at] += 1;
        for entry in pattern.columns[column]..pattern.columns[column + 1] {
            let row = pattern.rows[entry];
            let value = values[entry].abs();
            if row == column {
                sums[at] += value;
            } else {
                let largest = &mut coupling[index(fields[row])][at];
                *largest = value.max(*largest);
            }
        }
    }
    let mut factors = [None; COUNT];
    for field in 0..COUNT {
        factors[field] = factor((sums[field] / f64::from(numbers[field])).sqrt());
    }
    for field in (0..COUNT).filter(|&field| sums[field] == 0.0) {
        let others = (0..COUNT).filter(|&other| sums[other] > 0.0);
        factors[field] = others
            .filter_map(|other| factor(factors[other]? * coupling[other][field]))
            .next();
    }
    let of = |&field: &Field| factors[index(field)].unwrap_or(1.0);
    fields.iter().map(of).collect()
}

/// 1/size, `None` where that says nothing.
fn factor(size: f64) -> Option<f64> {
    let factor = 1.0 / size;
    (factor > 0.0 && factor.is_finite()).then_some(factor)
}
