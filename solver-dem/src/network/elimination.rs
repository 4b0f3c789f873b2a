//! The symbolic part of the elimination of a contact network: what depends on who touches whom alone.

use pulp::NullaryFnOnce;

use crate::simd::Simd;

/// An elimination order and where every block of the factors lies.
#[derive(Clone, Debug)]
pub(crate) struct Elimination {
    /// Grain eliminated at each place, and the place of each grain.
    pub(super) order: Vec<usize>,
    pub(super) place: Vec<usize>,
    /// Later places coupled to each place, ascending; `start` delimits them.
    pub(super) start: Vec<usize>,
    pub(super) later: Vec<usize>,
    /// Of every edge: its index in `later`, and whether its first grain goes later.
    pub(super) slots: Vec<(usize, bool)>,
    /// For each place and each pair p < q of its later places, in this order: the index of (p, q).
    pub(super) targets: Vec<u32>,
}

impl Elimination {
    /// The elimination of a network of `n` grains with the given contacts, each pair at most once.
    pub fn new(n: usize, edges: &[(usize, usize)]) -> Self {
        Simd::run(Symbolic { n, edges })
    }

    #[inline(always)]
    fn of(n: usize, edges: &[(usize, usize)]) -> Self {
        let (order, fill) = minimum_degree(n, edges);
        let mut place = vec![0; n];
        for (k, &grain) in order.iter().enumerate() {
            place[grain] = k;
        }
        let mut start = Vec::with_capacity(n + 1);
        let mut later: Vec<usize> = Vec::new();
        start.push(0);
        for neighbours in fill {
            let from = later.len();
            later.extend(neighbours.into_iter().map(|grain| place[grain]));
            later[from..].sort_unstable();
            start.push(later.len());
        }
        let slots = edges
            .iter()
            .map(|&(i, j)| {
                let (a, b) = (place[i].min(place[j]), place[i].max(place[j]));
                let row = &later[start[a]..start[a + 1]];
                let at = row.binary_search(&b).expect("the fill contains every edge");
                (start[a] + at, place[i] > place[j])
            })
            .collect();
        let mut targets = Vec::new();
        for k in 0..n {
            let own = &later[start[k]..start[k + 1]];
            for (p, &a) in own.iter().enumerate() {
                let mut slot = start[a];
                for &b in &own[p + 1..] {
                    // The neighbours of an eliminated node are neighbours of each other from then on.
                    while later[slot] < b {
                        slot += 1;
                    }
                    targets.push(slot as u32);
                }
            }
        }
        Self {
            order,
            place,
            start,
            later,
            slots,
            targets,
        }
    }

    /// Number of grains.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Number of contacts.
    pub fn edges(&self) -> usize {
        self.slots.len()
    }
}

struct Symbolic<'a> {
    n: usize,
    edges: &'a [(usize, usize)],
}

impl NullaryFnOnce for Symbolic<'_> {
    type Output = Elimination;

    #[inline(always)]
    fn call(self) -> Elimination {
        Elimination::of(self.n, self.edges)
    }
}

/// The elimination order by minimum degree (ties: lowest number) and, for each eliminated node, its
/// neighbours at that moment. Sets are bit sets: a REV has few hundred to few thousand grains.
#[inline(always)]
fn minimum_degree(n: usize, edges: &[(usize, usize)]) -> (Vec<usize>, Vec<Vec<usize>>) {
    let words = n.div_ceil(64);
    let mut adjacent = vec![0u64; n * words];
    for &(i, j) in edges {
        insert(&mut adjacent[i * words..(i + 1) * words], j);
        insert(&mut adjacent[j * words..(j + 1) * words], i);
    }
    let mut degree: Vec<usize> = (0..n)
        .map(|i| count(&adjacent[i * words..(i + 1) * words]))
        .collect();
    // The nodes of each degree.
    let mut alike = vec![0u64; n * words];
    for (node, &d) in degree.iter().enumerate() {
        insert(&mut alike[d * words..(d + 1) * words], node);
    }
    let mut order = Vec::with_capacity(n);
    let mut fill = Vec::with_capacity(n);
    let mut clique = vec![0u64; words];
    let mut least = 0;
    for _ in 0..n {
        let node = loop {
            match members(&alike[least * words..(least + 1) * words]).next() {
                Some(node) => break node,
                None => least += 1,
            }
        };
        remove(&mut alike[least * words..(least + 1) * words], node);
        clique.copy_from_slice(&adjacent[node * words..(node + 1) * words]);
        let neighbours: Vec<usize> = members(&clique).collect();
        for &a in &neighbours {
            let set = &mut adjacent[a * words..(a + 1) * words];
            for (mine, theirs) in set.iter_mut().zip(&clique) {
                *mine |= theirs;
            }
            remove(set, a);
            remove(set, node);
            let now = count(set);
            remove(&mut alike[degree[a] * words..(degree[a] + 1) * words], a);
            insert(&mut alike[now * words..(now + 1) * words], a);
            degree[a] = now;
        }
        // Eliminating a node takes at most itself from a neighbour: no degree falls by more than one.
        least = least.saturating_sub(1);
        order.push(node);
        fill.push(neighbours);
    }
    (order, fill)
}

#[inline(always)]
fn insert(set: &mut [u64], node: usize) {
    set[node / 64] |= 1 << (node % 64);
}

#[inline(always)]
fn remove(set: &mut [u64], node: usize) {
    set[node / 64] &= !(1 << (node % 64));
}

#[inline(always)]
fn count(set: &[u64]) -> usize {
    set.iter().map(|word| word.count_ones() as usize).sum()
}

/// The members of a set, ascending.
#[inline(always)]
fn members(set: &[u64]) -> impl Iterator<Item = usize> {
    set.iter().enumerate().flat_map(|(w, &word)| {
        std::iter::successors((word != 0).then_some(word), |&rest| {
            let rest = rest & (rest - 1);
            (rest != 0).then_some(rest)
        })
        .map(move |rest| w * 64 + rest.trailing_zeros() as usize)
    })
}
