//! Sparse LU of matrices of small dense blocks, one block row per grain.
//!
//! The contact network of a REV is a planar graph on a torus with about four neighbours a grain.
//! Eliminated by minimum degree, its factors hold a few thousand blocks; pivoting inside the diagonal
//! blocks suffices for networks near equilibrium. A general sparse LU spends several times the work
//! in its symbolic part (measured figures: docs/design/rev-solver.md).

/// A dense block.
pub(super) type Block<const B: usize> = [[f64; B]; B];

/// A matrix with a structurally symmetric pattern.
pub(super) struct BlockMatrix<const B: usize> {
    pub diagonal: Vec<Block<B>>,
    /// Edge e = (i, j): block (i, j).
    pub upper: Vec<Block<B>>,
    /// Edge e = (i, j): block (j, i).
    pub lower: Vec<Block<B>>,
    edges: Vec<(usize, usize)>,
}

impl<const B: usize> BlockMatrix<B> {
    /// A zero matrix of `n` block rows with the given off-diagonal blocks, each pair at most once.
    pub fn new(n: usize, edges: impl Iterator<Item = (usize, usize)>) -> Self {
        let edges: Vec<_> = edges.collect();
        let zero = [[0.0; B]; B];
        Self {
            diagonal: vec![zero; n],
            upper: vec![zero; edges.len()],
            lower: vec![zero; edges.len()],
            edges,
        }
    }
}

/// L·U = P·A·Pᵀ by blocks.
pub(super) struct BlockLu<const B: usize> {
    /// Grain eliminated at each place.
    order: Vec<usize>,
    /// Later places coupled to each place, ascending; `start` delimits them.
    start: Vec<usize>,
    later: Vec<usize>,
    pivots: Vec<Block<B>>,
    /// U blocks (place, later) and L blocks (later, place), the latter already times the pivot.
    upper: Vec<Block<B>>,
    lower: Vec<Block<B>>,
}

impl<const B: usize> BlockLu<B> {
    /// `None` when a pivot block is singular.
    pub fn factorise(matrix: BlockMatrix<B>) -> Option<Self> {
        let n = matrix.diagonal.len();
        let (order, fill) = minimum_degree(n, &matrix.edges);
        let mut place = vec![0; n];
        for (k, &grain) in order.iter().enumerate() {
            place[grain] = k;
        }
        let mut start = Vec::with_capacity(n + 1);
        let mut later = Vec::new();
        start.push(0);
        for neighbours in fill {
            let from = later.len();
            later.extend(neighbours.into_iter().map(|grain| place[grain]));
            later[from..].sort_unstable();
            start.push(later.len());
        }

        let zero = [[0.0; B]; B];
        let mut pivots: Vec<Block<B>> = order.iter().map(|&grain| matrix.diagonal[grain]).collect();
        let mut upper = vec![zero; later.len()];
        let mut lower = vec![zero; later.len()];
        for (edge, &(i, j)) in matrix.edges.iter().enumerate() {
            let (a, b) = (place[i].min(place[j]), place[i].max(place[j]));
            let row = &later[start[a]..start[a + 1]];
            let at = start[a] + row.binary_search(&b).expect("the fill contains every edge");
            let flipped = place[i] > place[j];
            let (u, l) = if flipped {
                (&matrix.lower[edge], &matrix.upper[edge])
            } else {
                (&matrix.upper[edge], &matrix.lower[edge])
            };
            add(&mut upper[at], u);
            add(&mut lower[at], l);
        }

        for k in 0..n {
            pivots[k] = inverse(&pivots[k])?;
            let own = start[k]..start[k + 1];
            for p in own.clone() {
                lower[p] = times(&lower[p], &pivots[k]);
            }
            for p in own.clone() {
                let a = later[p];
                let (lp, up) = (lower[p], upper[p]);
                subtract_product(&mut pivots[a], &lp, &up);
                let mut slot = start[a];
                for q in p + 1..own.end {
                    while later[slot] < later[q] {
                        slot += 1;
                    }
                    let (lq, uq) = (lower[q], upper[q]);
                    subtract_product(&mut upper[slot], &lp, &uq);
                    subtract_product(&mut lower[slot], &lq, &up);
                }
            }
        }
        Some(Self {
            order,
            start,
            later,
            pivots,
            upper,
            lower,
        })
    }

    /// Solves A·x = b in place for `R` right-hand sides; `b[grain][row][case]`.
    pub fn solve<const R: usize>(&self, b: &mut [[[f64; R]; B]]) {
        let n = self.order.len();
        let mut x: Vec<[[f64; R]; B]> = self.order.iter().map(|&grain| b[grain]).collect();
        for k in 0..n {
            let xk = x[k];
            for p in self.start[k]..self.start[k + 1] {
                subtract_applied(&mut x[self.later[p]], &self.lower[p], &xk);
            }
        }
        for k in (0..n).rev() {
            let mut rest = x[k];
            for p in self.start[k]..self.start[k + 1] {
                subtract_applied(&mut rest, &self.upper[p], &x[self.later[p]]);
            }
            x[k] = [[0.0; R]; B];
            for i in 0..B {
                for j in 0..B {
                    for r in 0..R {
                        x[k][i][r] += self.pivots[k][i][j] * rest[j][r];
                    }
                }
            }
        }
        for (k, &grain) in self.order.iter().enumerate() {
            b[grain] = x[k];
        }
    }
}

/// The elimination order by minimum degree (ties: lowest number) and, for each eliminated node, its
/// neighbours at that moment. Sets are bit sets: a REV has few hundred to few thousand grains.
fn minimum_degree(n: usize, edges: &[(usize, usize)]) -> (Vec<usize>, Vec<Vec<usize>>) {
    let words = n.div_ceil(64);
    let mut adjacent = vec![0u64; n * words];
    for &(i, j) in edges {
        adjacent[i * words + j / 64] |= 1 << (j % 64);
        adjacent[j * words + i / 64] |= 1 << (i % 64);
    }
    let count = |set: &[u64]| set.iter().map(|w| w.count_ones()).sum::<u32>();
    let mut degree: Vec<u32> = (0..n)
        .map(|i| count(&adjacent[i * words..(i + 1) * words]))
        .collect();
    let mut order = Vec::with_capacity(n);
    let mut fill = Vec::with_capacity(n);
    let mut clique = vec![0u64; words];
    for _ in 0..n {
        let mut node = 0;
        for candidate in 1..n {
            if degree[candidate] < degree[node] {
                node = candidate;
            }
        }
        clique.copy_from_slice(&adjacent[node * words..(node + 1) * words]);
        let mut neighbours = Vec::with_capacity(degree[node] as usize);
        for (w, &word) in clique.iter().enumerate() {
            let mut bits = word;
            while bits != 0 {
                neighbours.push(w * 64 + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        }
        for &a in &neighbours {
            let set = &mut adjacent[a * words..(a + 1) * words];
            for (mine, theirs) in set.iter_mut().zip(&clique) {
                *mine |= theirs;
            }
            set[a / 64] &= !(1 << (a % 64));
            set[node / 64] &= !(1 << (node % 64));
            degree[a] = count(set);
        }
        degree[node] = u32::MAX;
        order.push(node);
        fill.push(neighbours);
    }
    (order, fill)
}

fn add<const B: usize>(a: &mut Block<B>, b: &Block<B>) {
    for i in 0..B {
        for j in 0..B {
            a[i][j] += b[i][j];
        }
    }
}

fn times<const B: usize>(a: &Block<B>, b: &Block<B>) -> Block<B> {
    let mut c = [[0.0; B]; B];
    for i in 0..B {
        for j in 0..B {
            for k in 0..B {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    c
}

#[inline]
fn subtract_product<const B: usize>(c: &mut Block<B>, a: &Block<B>, b: &Block<B>) {
    for i in 0..B {
        for j in 0..B {
            let mut sum = 0.0;
            for k in 0..B {
                sum += a[i][k] * b[k][j];
            }
            c[i][j] -= sum;
        }
    }
}

#[inline]
fn subtract_applied<const B: usize, const R: usize>(
    y: &mut [[f64; R]; B],
    a: &Block<B>,
    x: &[[f64; R]; B],
) {
    for i in 0..B {
        for j in 0..B {
            for r in 0..R {
                y[i][r] -= a[i][j] * x[j][r];
            }
        }
    }
}

fn inverse<const B: usize>(a: &Block<B>) -> Option<Block<B>> {
    crate::tensor::invert(a).1
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
        let mut matrix = BlockMatrix::<3>::new(n, edges.iter().copied());
        let value = |seed: usize| ((seed * 7919 + 13) % 101) as f64 / 101.0 - 0.5;
        for grain in 0..n {
            for a in 0..3 {
                for b in 0..3 {
                    matrix.diagonal[grain][a][b] =
                        value(grain * 9 + a * 3 + b) + if a == b { 6.0 } else { 0.0 };
                }
            }
        }
        for edge in 0..edges.len() {
            for a in 0..3 {
                for b in 0..3 {
                    matrix.upper[edge][a][b] = value(edge * 31 + a * 5 + b);
                    matrix.lower[edge][a][b] = value(edge * 17 + a * 11 + b);
                }
            }
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
        let apply = |target: &mut [[f64; 2]; 3], block: &Block<3>, x: &[[f64; 2]; 3]| {
            for i in 0..3 {
                for j in 0..3 {
                    for r in 0..2 {
                        target[i][r] += block[i][j] * x[j][r];
                    }
                }
            }
        };
        for g in 0..n {
            apply(&mut b[g], &matrix.diagonal[g], &exact[g]);
        }
        for (e, &(i, j)) in edges.iter().enumerate() {
            apply(&mut b[i], &matrix.upper[e], &exact[j]);
            apply(&mut b[j], &matrix.lower[e], &exact[i]);
        }
        BlockLu::factorise(matrix).unwrap().solve(&mut b);
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
