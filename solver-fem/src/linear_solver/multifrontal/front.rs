//! A dense front: partial LU with row pivoting inside the summed block.
//!
//! Column j of the summed block is eliminated with the largest entry of its summed rows, if that is
//! at least [`THRESHOLD`] of the largest of the whole column. Else it waits for other columns, and
//! when none is left it is passed on to the parent with a row (a *delayed pivot*): at the root every
//! row is summed and each column finds its pivot.
//!
//! c_ij receives −l_ik·u_kj one by one in ascending k, each product and difference rounded: the same
//! bits for every width of panel, tile and register.

use pulp::{Arch, NullaryFnOnce};

/// Smallest pivot over the largest entry of its column.
const THRESHOLD: f64 = 0.1;

/// Columns that are eliminated before the rest of the front follows.
const PANEL: usize = 32;

/// Rows of a tile: two registers of four numbers.
const ROWS: usize = 8;

/// Columns of a tile.
const COLUMNS: usize = 4;

/// A square matrix, column by column, with the equation of every row and column.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Front {
    pub size: usize,
    /// Rows and columns 0..summed may be eliminated.
    pub summed: usize,
    /// Distance of two columns; at least [`ROWS`] − 1 rows more than there are, so that every tile is whole.
    pub stride: usize,
    pub values: Vec<f64>,
    pub rows: Vec<u32>,
    pub columns: Vec<u32>,
}

impl Front {
    /// Makes it a zero matrix without rows' and columns' names.
    pub fn reset(&mut self, size: usize, summed: usize) {
        // An odd multiple of a cache line: columns at a power of two would share few places in the cache.
        let lines = size.div_ceil(ROWS) + 1;
        self.stride = ROWS * (lines | 1);
        self.size = size;
        self.summed = summed;
        self.values.clear();
        self.values.resize(self.stride * size, 0.0);
        self.rows.clear();
        self.columns.clear();
    }

    /// Eliminates what can be eliminated, and brings it to the front; returns the number of pivots.
    ///
    /// Afterwards L (unit diagonal not stored) and U stand in the first rows and columns, what remains for
    /// the parent in the others.
    pub fn eliminate(&mut self) -> usize {
        Arch::new().dispatch(Eliminate(self))
    }

    #[inline(always)]
    fn eliminate_panels(&mut self) -> usize {
        let mut done = 0;
        // Columns done..open are still to be tried, open..summed found no pivot.
        let mut open = self.summed;
        let mut done_before = 0;
        loop {
            if done == open {
                if open == self.summed || done == done_before {
                    return done;
                }
                (open, done_before) = (self.summed, done);
            }
            let width = PANEL.min(open - done);
            let mut swaps = [0; PANEL];
            let found = self.eliminate_panel(done, width, &mut swaps);
            self.follow(done, width, &swaps[..found]);
            let failed = width - found;
            for i in 0..failed {
                self.swap_columns(done + found + i, open - 1 - i);
            }
            done += found;
            open -= failed;
        }
    }

    /// Eliminates within columns start..start + width; those without a pivot end up last. Row start + k was
    /// exchanged with row `swaps[k]`, in these columns only.
    #[inline(always)]
    fn eliminate_panel(&mut self, start: usize, width: usize, swaps: &mut [usize; PANEL]) -> usize {
        let mut k = start;
        let mut end = start + width;
        while k < end {
            let column = self.column(k);
            let (row, within) = largest(&column[k..self.summed]);
            let (_, outside) = largest(&column[self.summed..self.size]);
            // Written so that a NaN is no pivot.
            if !(within > 0.0 && within >= THRESHOLD * outside) {
                end -= 1;
                self.swap_columns(k, end);
                continue;
            }
            let row = k + row;
            swaps[k - start] = row;
            self.rows.swap(k, row);
            let (stride, size) = (self.stride, self.size);
            let panel = &mut self.values[start * stride..(start + width) * stride];
            for column in panel.chunks_exact_mut(stride) {
                column.swap(k, row);
            }
            let (left, right) = panel.split_at_mut((k - start + 1) * stride);
            let pivot_column = &mut left[(k - start) * stride..][..size];
            let reciprocal = 1.0 / pivot_column[k];
            for value in &mut pivot_column[k + 1..] {
                *value *= reciprocal;
            }
            let l = &pivot_column[k + 1..];
            for column in right.chunks_exact_mut(stride) {
                let u = column[k];
                for (value, l) in column[k + 1..size].iter_mut().zip(l) {
                    *value -= l * u;
                }
            }
            k += 1;
        }
        k - start
    }

    /// Carries a panel's exchanges and pivots to the columns beside it.
    #[inline(always)]
    fn follow(&mut self, start: usize, width: usize, swaps: &[usize]) {
        let (stride, size) = (self.stride, self.size);
        let (left, rest) = self.values.split_at_mut(start * stride);
        let (panel, right) = rest.split_at_mut(width * stride);
        for column in left.chunks_exact_mut(stride) {
            exchange(column, start, swaps);
        }
        let mut groups = right.chunks_exact_mut(COLUMNS * stride);
        for group in &mut groups {
            follow_group::<COLUMNS>(group, panel, stride, size, start, swaps);
        }
        for column in groups.into_remainder().chunks_exact_mut(stride) {
            follow_group::<1>(column, panel, stride, size, start, swaps);
        }
    }

    /// A whole column.
    pub fn column(&self, k: usize) -> &[f64] {
        &self.values[k * self.stride..][..self.size]
    }

    #[inline(always)]
    fn swap_columns(&mut self, a: usize, b: usize) {
        if a == b {
            return;
        }
        let (a, b) = (a.min(b), a.max(b));
        let (left, right) = self.values.split_at_mut(b * self.stride);
        left[a * self.stride..][..self.size].swap_with_slice(&mut right[..self.size]);
        self.columns.swap(a, b);
    }
}

/// [`Front::eliminate_panels`] with wide registers.
struct Eliminate<'a>(&'a mut Front);

impl NullaryFnOnce for Eliminate<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        self.0.eliminate_panels()
    }
}

/// Largest magnitude and the first place where it stands; 0 of an empty list.
#[inline(always)]
fn largest(values: &[f64]) -> (usize, f64) {
    let mut found = (0, 0.0);
    for (place, value) in values.iter().enumerate() {
        if value.abs() > found.1 {
            found = (place, value.abs());
        }
    }
    found
}

#[inline(always)]
fn exchange(column: &mut [f64], start: usize, swaps: &[usize]) {
    for (k, &row) in swaps.iter().enumerate() {
        column.swap(start + k, row);
    }
}

/// U ← L⁻¹·P·A in the rows of the pivots, then A ← A − L·U in the rows below, for J columns.
#[inline(always)]
fn follow_group<const J: usize>(
    columns: &mut [f64],
    panel: &[f64],
    stride: usize,
    size: usize,
    start: usize,
    swaps: &[usize],
) {
    let below = start + swaps.len();
    let mut u = [[0.0; J]; PANEL];
    for (j, column) in columns.chunks_exact_mut(stride).enumerate() {
        exchange(column, start, swaps);
        let pivots = &mut column[start..below];
        for k in 0..pivots.len() {
            let value = pivots[k];
            u[k][j] = value;
            let l = &panel[k * stride + start..][..pivots.len()];
            for (row, l) in pivots[k + 1..].iter_mut().zip(&l[k + 1..]) {
                *row -= l * value;
            }
        }
    }
    let mut row = below;
    while row < size {
        tile::<J>(columns, panel, stride, row, &u[..swaps.len()]);
        row += ROWS;
    }
}

/// c_ij ← c_ij − Σ_k l_ik·u_kj for [`ROWS`] rows.
#[inline(always)]
fn tile<const J: usize>(
    columns: &mut [f64],
    panel: &[f64],
    stride: usize,
    row: usize,
    u: &[[f64; J]],
) {
    let mut sums = [[0.0; ROWS]; J];
    for j in 0..J {
        sums[j].copy_from_slice(&columns[j * stride + row..][..ROWS]);
    }
    for (k, u) in u.iter().enumerate() {
        let l = &panel[k * stride + row..][..ROWS];
        for j in 0..J {
            for i in 0..ROWS {
                sums[j][i] -= l[i] * u[j];
            }
        }
    }
    for j in 0..J {
        columns[j * stride + row..][..ROWS].copy_from_slice(&sums[j]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A front with numbers that look like chance, most pivots of which pass the test.
    fn front(size: usize, summed: usize) -> Front {
        let mut front = Front::default();
        front.reset(size, summed);
        front.rows = (0..size as u32).collect();
        front.columns = front.rows.clone();
        let mut state = 7_u64;
        for column in 0..size {
            for row in 0..size {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let noise = (state >> 40) as f64 / f64::from(1 << 23) - 1.0;
                let outside = if row >= summed { 6.0 } else { 1.0 };
                front.values[column * front.stride + row] = noise * outside;
            }
        }
        front
    }

    /// The textbook's elimination with the exchanges that the front chose.
    fn plain(start: &Front, end: &Front, pivots: usize) -> Vec<Vec<f64>> {
        let size = start.size;
        let mut a: Vec<Vec<f64>> = end
            .columns
            .iter()
            .map(|&column| {
                let column = start.column(column as usize);
                end.rows.iter().map(|&row| column[row as usize]).collect()
            })
            .collect();
        for k in 0..pivots {
            let reciprocal = 1.0 / a[k][k];
            for row in k + 1..size {
                a[k][row] *= reciprocal;
            }
            for column in k + 1..size {
                for row in k + 1..size {
                    a[column][row] -= a[k][row] * a[column][k];
                }
            }
        }
        a
    }

    /// Panels, tiles and registers are for speed: with other bits a run would depend on the processor.
    #[test]
    fn blocks_and_registers_change_no_bit() {
        for (size, summed) in [(1, 1), (7, 3), (40, 40), (61, 35), (150, 101), (203, 96)] {
            let start = front(size, summed);
            let mut wide = start.clone();
            let pivots = wide.eliminate();
            let mut narrow = start.clone();
            assert_eq!(narrow.eliminate_panels(), pivots);
            assert_eq!(wide, narrow);
            assert!(2 * pivots >= summed, "{pivots} of {summed}");
            let plain = plain(&start, &wide, pivots);
            for column in 0..size {
                assert_eq!(
                    wide.column(column),
                    plain[column],
                    "column {column} of {size}"
                );
            }
        }
    }

    #[test]
    fn no_multiplier_of_a_row_exceeds_the_threshold() {
        let mut front = front(203, 96);
        let pivots = front.eliminate();
        assert!(pivots < 96, "some columns must have failed");
        for k in 0..pivots {
            assert!(
                front.column(k)[k + 1..]
                    .iter()
                    .all(|l| l.abs() <= 1.0 / THRESHOLD)
            );
        }
    }
}
