//! Forward and back substitution through the fronts.

use pulp::{Arch, NullaryFnOnce};

use super::factorise::{Extent, Store};

impl Store {
    /// x ← A⁻¹·x for the matrix as it was factorised.
    pub fn substitute(&self, x: &mut [f64]) {
        Arch::new().dispatch(Substitution(self, x));
    }

    #[inline(always)]
    fn through_fronts(&self, x: &mut [f64]) {
        let largest = self.fronts.iter().map(|front| front.size).max();
        let mut part = vec![0.0; largest.unwrap_or(0)];
        let (mut index, mut value) = (0, 0);
        for &Extent { size, pivots } in &self.fronts {
            let rows = &self.rows[index..index + size];
            let part = &mut part[..size];
            for (part, &row) in part.iter_mut().zip(rows) {
                *part = x[row as usize];
            }
            for k in 0..pivots {
                let y = part[k];
                let l = &self.values[value + k * size..][k + 1..size];
                for (part, l) in part[k + 1..].iter_mut().zip(l) {
                    *part -= l * y;
                }
            }
            for (part, &row) in part.iter().zip(rows) {
                x[row as usize] = *part;
            }
            index += size;
            value += pivots * (2 * size - pivots);
        }
        // By column from here on; rows hold what is left of the right-hand side.
        let mut solution = vec![0.0; x.len()];
        for &Extent { size, pivots } in self.fronts.iter().rev() {
            index -= size;
            value -= pivots * (2 * size - pivots);
            let rows = &self.rows[index..index + pivots];
            let columns = &self.columns[index..index + size];
            let (square, beside) =
                self.values[value..][..pivots * (2 * size - pivots)].split_at(pivots * size);
            let part = &mut part[..pivots];
            for (part, &row) in part.iter_mut().zip(rows) {
                *part = x[row as usize];
            }
            for (u, &column) in beside.chunks_exact(pivots.max(1)).zip(&columns[pivots..]) {
                let known = solution[column as usize];
                for (part, u) in part.iter_mut().zip(u) {
                    *part -= u * known;
                }
            }
            for k in (0..pivots).rev() {
                let u = &square[k * size..][..k + 1];
                let known = part[k] / u[k];
                solution[columns[k] as usize] = known;
                for (part, u) in part[..k].iter_mut().zip(u) {
                    *part -= u * known;
                }
            }
        }
        x.copy_from_slice(&solution);
    }
}

/// [`Store::through_fronts`] with wide registers.
struct Substitution<'a>(&'a Store, &'a mut [f64]);

impl NullaryFnOnce for Substitution<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.through_fronts(self.1);
    }
}
