//! Diagonal scaling: with A' = S·A·S a stiffness, a double-stress modulus and a multiplier can be
//! compared, whatever their units, and so can a stiff region and a soft one.
//!
//! All factors look at the equations of the same field in the elements of i, never at i alone: under softening a
//! single diagonal entry may pass through zero, and in a tied strip a multiplier's couplings cancel but for rounding.
//! s_i = ⟨|a_jj|⟩^-½ over these equations j. Where that mean is zero, s_i = 1/max(s_k·|a_kj|) over them and over the
//! equations k of the first field that couples to them.

use crate::assembly::Pattern;
use crate::layout::Field;

const FIELDS: [Field; 3] = [Field::Displacement, Field::Gradient, Field::Multiplier];

/// The factor of every equation; `fields[i]` is the field of equation i.
pub(super) fn scaling(pattern: &Pattern, fields: &[Field], values: &[f64]) -> Vec<f64> {
    let means = diagonal_means(pattern, fields, values);
    let mut scale: Vec<Option<f64>> = means.iter().map(|mean| factor(mean.sqrt())).collect();
    let bare: Vec<usize> = (0..pattern.size).filter(|&i| scale[i].is_none()).collect();
    for field in FIELDS {
        let mut largest = vec![0.0_f64; pattern.size];
        for &column in &bare {
            for entry in pattern.columns[column]..pattern.columns[column + 1] {
                let row = pattern.rows[entry];
                if fields[row] == field && means[row] > 0.0 {
                    let s = scale[row].unwrap_or(0.0);
                    largest[column] = largest[column].max(s * values[entry].abs());
                }
            }
        }
        let largest = around(pattern, fields, &largest, |values| {
            values.iter().fold(0.0, |max, &value| value.max(max))
        });
        for &equation in bare.iter().filter(|&&equation| means[equation] == 0.0) {
            scale[equation] = scale[equation].or(factor(largest[equation]));
        }
    }
    scale.into_iter().map(|s| s.unwrap_or(1.0)).collect()
}

/// The mean of |a_jj| around every equation.
fn diagonal_means(pattern: &Pattern, fields: &[Field], values: &[f64]) -> Vec<f64> {
    let diagonal: Vec<f64> = (0..pattern.size)
        .map(|column| {
            let first = pattern.columns[column];
            let rows = &pattern.rows[first..pattern.columns[column + 1]];
            let place = rows.binary_search(&column);
            place.map_or(0.0, |place| values[first + place].abs())
        })
        .collect();
    around(pattern, fields, &diagonal, |values| {
        values.iter().sum::<f64>() / values.len() as f64
    })
}

/// What `gather` makes of a quantity over a field's equations in an element, averaged over the elements of every
/// equation.
fn around(
    pattern: &Pattern,
    fields: &[Field],
    quantity: &[f64],
    gather: impl Fn(&[f64]) -> f64,
) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_u32); pattern.size];
    let mut own = Vec::new();
    for element in 0..pattern.element_count() {
        let equations = pattern.element_equations(element).iter().flatten();
        for field in FIELDS {
            let equations = equations.clone().map(|&equation| equation as usize);
            let equations = equations.filter(|&equation| fields[equation] == field);
            own.clear();
            own.extend(equations.clone().map(|equation| quantity[equation]));
            if own.is_empty() {
                continue;
            }
            let gathered = gather(&own);
            for equation in equations {
                let (sum, count) = &mut sums[equation];
                *sum += gathered;
                *count += 1;
            }
        }
    }
    let mean = |&(sum, count): &(f64, u32)| sum / f64::from(count.max(1));
    sums.iter().map(mean).collect()
}

/// 1/size, `None` where that says nothing.
fn factor(size: f64) -> Option<f64> {
    let factor = 1.0 / size;
    (factor > 0.0 && factor.is_finite()).then_some(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One element: two displacements, a multiplier that couples to them, one that does so by rounding alone.
    #[test]
    fn a_coupling_that_cancels_does_not_blow_up_its_multiplier() {
        let equations = vec![(0..4).map(Some).collect()];
        let pattern = Pattern::of_elements(4, &equations);
        let fields = [
            Field::Displacement,
            Field::Displacement,
            Field::Multiplier,
            Field::Multiplier,
        ];
        let matrix = [
            [9.0, 1.0, 0.5, 1e-17],
            [1.0, 7.0, -0.5, 0.0],
            [0.5, -0.5, 0.0, 0.0],
            [1e-17, 0.0, 0.0, 0.0],
        ];
        let mut values = vec![0.0; 16];
        pattern.scatter(0, &matrix.concat(), &mut values);
        let u = 1.0 / 8.0_f64.sqrt();
        let lambda = 1.0 / (0.5 * u);
        assert_eq!(scaling(&pattern, &fields, &values), [u, u, lambda, lambda]);
        assert_eq!(scaling(&pattern, &fields, &[0.0; 16]), [1.0; 4]);
    }
}
