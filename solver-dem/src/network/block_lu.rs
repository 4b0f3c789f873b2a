//! Sparse LU of matrices of small dense blocks, one block row per grain.
//!
//! The contact network of a REV is a planar graph on a torus with about four neighbours a grain.
//! Eliminated by minimum degree, its factors hold a few thousand blocks; pivoting inside the diagonal
//! blocks suffices for networks near equilibrium. A general sparse LU spends several times the work
//! in its symbolic part (measured figures: docs/design/rev-solver.md).
//!
//! Blocks have `B` rows of `W` ≥ `B` numbers, the rest zero, so that a row fills vector registers.

use pulp::NullaryFnOnce;

use super::elimination::Elimination;
use crate::simd::Simd;

/// A dense block; columns from `B` on are zero.
pub(super) type Block<const B: usize, const W: usize> = [[f64; W]; B];

/// A matrix with the pattern of an [`Elimination`], then its factors in the same place: L·U = P·A·Pᵀ by
/// blocks.
pub(super) struct BlockLu<'a, const B: usize, const W: usize> {
    elimination: &'a Elimination,
    /// By place; after the elimination, the inverses.
    pivots: Vec<Block<B, W>>,
    /// Blocks (place, later) and (later, place), the latter times the pivot after the elimination.
    upper: Vec<Block<B, W>>,
    lower: Vec<Block<B, W>>,
}

impl<'a, const B: usize, const W: usize> BlockLu<'a, B, W> {
    /// A zero matrix.
    pub fn new(elimination: &'a Elimination) -> Self {
        let zero = [[0.0; W]; B];
        Self {
            elimination,
            pivots: vec![zero; elimination.len()],
            upper: vec![zero; elimination.later.len()],
            lower: vec![zero; elimination.later.len()],
        }
    }

    /// Makes it the zero matrix again. Its memory is most of what a tangent needs.
    pub fn clear(&mut self) {
        let zero = [[0.0; W]; B];
        self.pivots.fill(zero);
        self.upper.fill(zero);
        self.lower.fill(zero);
    }

    /// The diagonal block of a grain.
    pub fn diagonal(&mut self, grain: usize) -> &mut Block<B, W> {
        &mut self.pivots[self.elimination.place[grain]]
    }

    /// Of edge e = (i, j): the blocks (i, j) and (j, i).
    pub fn coupling(&mut self, edge: usize) -> [&mut Block<B, W>; 2] {
        let (at, flipped) = self.elimination.slots[edge];
        let (upper, lower) = (&mut self.upper[at], &mut self.lower[at]);
        if flipped {
            [lower, upper]
        } else {
            [upper, lower]
        }
    }

    /// Replaces the matrix by its factors; `false` when a pivot block is singular.
    #[must_use]
    pub fn factorise(&mut self) -> bool {
        Simd::run(Factors(self))
    }

    #[inline(always)]
    fn eliminate(&mut self) -> bool {
        let Elimination {
            start,
            later,
            targets,
            ..
        } = self.elimination;
        let mut targets = targets.iter();
        for k in 0..self.pivots.len() {
            let Some(pivot) = inverse(&self.pivots[k]) else {
                return false;
            };
            self.pivots[k] = pivot;
            let own = start[k]..start[k + 1];
            for p in own.clone() {
                self.lower[p] = times(&self.lower[p], &pivot);
            }
            for p in own.clone() {
                let (lp, up) = (self.lower[p], self.upper[p]);
                subtract_product(&mut self.pivots[later[p]], &lp, &up);
                for (q, &slot) in (p + 1..own.end).zip(&mut targets) {
                    let (lq, uq) = (self.lower[q], self.upper[q]);
                    subtract_product(&mut self.upper[slot as usize], &lp, &uq);
                    subtract_product(&mut self.lower[slot as usize], &lq, &up);
                }
            }
        }
        true
    }

    /// Solves A·x = b in place for `R` right-hand sides; `b[grain][row][case]`.
    pub fn solve<const R: usize>(&self, b: &mut [[[f64; R]; B]]) {
        Simd::run(Substitution(self, b));
    }

    #[inline(always)]
    fn substitute<const R: usize>(&self, b: &mut [[[f64; R]; B]]) {
        let Elimination {
            order,
            start,
            later,
            ..
        } = self.elimination;
        let n = order.len();
        let mut x: Vec<[[f64; R]; B]> = order.iter().map(|&grain| b[grain]).collect();
        for k in 0..n {
            let xk = x[k];
            for p in start[k]..start[k + 1] {
                subtract_product(&mut x[later[p]], &self.lower[p], &xk);
            }
        }
        for k in (0..n).rev() {
            let mut rest = x[k];
            for p in start[k]..start[k + 1] {
                subtract_product(&mut rest, &self.upper[p], &x[later[p]]);
            }
            x[k] = times(&self.pivots[k], &rest);
        }
        for (k, &grain) in order.iter().enumerate() {
            b[grain] = x[k];
        }
    }
}

/// [`BlockLu::eliminate`] with wide registers.
struct Factors<'m, 'e, const B: usize, const W: usize>(&'m mut BlockLu<'e, B, W>);

impl<const B: usize, const W: usize> NullaryFnOnce for Factors<'_, '_, B, W> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.0.eliminate()
    }
}

/// [`BlockLu::substitute`] with wide registers.
struct Substitution<'m, 'e, const B: usize, const W: usize, const R: usize>(
    &'m BlockLu<'e, B, W>,
    &'m mut [[[f64; R]; B]],
);

impl<const B: usize, const W: usize, const R: usize> NullaryFnOnce
    for Substitution<'_, '_, B, W, R>
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.substitute(self.1);
    }
}

/// A·C for the square part of A.
#[inline(always)]
fn times<const B: usize, const W: usize, const R: usize>(
    a: &Block<B, W>,
    c: &Block<B, R>,
) -> Block<B, R> {
    let mut product = [[0.0; R]; B];
    for i in 0..B {
        for k in 0..B {
            for r in 0..R {
                product[i][r] += a[i][k] * c[k][r];
            }
        }
    }
    product
}

/// y − A·x.
#[inline(always)]
fn subtract_product<const B: usize, const W: usize, const R: usize>(
    y: &mut Block<B, R>,
    a: &Block<B, W>,
    x: &Block<B, R>,
) {
    for i in 0..B {
        for k in 0..B {
            for r in 0..R {
                y[i][r] -= a[i][k] * x[k][r];
            }
        }
    }
}

/// The inverse of the square part.
#[inline(always)]
fn inverse<const B: usize, const W: usize>(a: &Block<B, W>) -> Option<Block<B, W>> {
    let mut square = [[0.0; B]; B];
    for i in 0..B {
        square[i].copy_from_slice(&a[i][..B]);
    }
    let inverse = crate::tensor::invert(&square).1?;
    let mut padded = [[0.0; W]; B];
    for i in 0..B {
        padded[i][..B].copy_from_slice(&inverse[i]);
    }
    Some(padded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsymmetric_system_on_a_periodic_grid_is_solved_to_round_off() {
        let side = 7;
        let n = side * side;
        let mut edges = Vec::new();
        for k in 0..n {
            let (x, y) = (k % side, k / side);
            edges.push((k, y * side + (x + 1) % side));
            edges.push((k, (y + 1) % side * side + x));
        }
        let elimination = Elimination::new(n, &edges);
        let mut matrix = BlockLu::<3, 4>::new(&elimination);
        let (mut diagonal, mut couplings) = (Vec::new(), Vec::new());
        let value = |seed: usize| ((seed * 7919 + 13) % 101) as f64 / 101.0 - 0.5;
        for grain in 0..n {
            let block = matrix.diagonal(grain);
            for a in 0..3 {
                for b in 0..3 {
                    block[a][b] = value(grain * 9 + a * 3 + b) + if a == b { 6.0 } else { 0.0 };
                }
            }
            diagonal.push(*block);
        }
        for edge in 0..edges.len() {
            let [upper, lower] = matrix.coupling(edge);
            for a in 0..3 {
                for b in 0..3 {
                    upper[a][b] = value(edge * 31 + a * 5 + b);
                    lower[a][b] = value(edge * 17 + a * 11 + b);
                }
            }
            couplings.push((*upper, *lower));
        }
        let exact: Vec<[[f64; 2]; 3]> = (0..n)
            .map(|g| {
                [
                    [value(g), value(g + 5)],
                    [value(g + 9), 1.0],
                    [2.0, value(3 * g)],
                ]
            })
            .collect();
        let mut b = vec![[[0.0; 2]; 3]; n];
        let apply = |target: &mut [[f64; 2]; 3], block: &Block<3, 4>, x: &[[f64; 2]; 3]| {
            for i in 0..3 {
                for j in 0..3 {
                    for r in 0..2 {
                        target[i][r] += block[i][j] * x[j][r];
                    }
                }
            }
        };
        for g in 0..n {
            apply(&mut b[g], &diagonal[g], &exact[g]);
        }
        for (e, &(i, j)) in edges.iter().enumerate() {
            apply(&mut b[i], &couplings[e].0, &exact[j]);
            apply(&mut b[j], &couplings[e].1, &exact[i]);
        }
        assert!(matrix.factorise());
        matrix.solve(&mut b);
        for (x, y) in b
            .iter()
            .flatten()
            .flatten()
            .zip(exact.iter().flatten().flatten())
        {
            assert!((x - y).abs() < 1e-12);
        }
    }
}
