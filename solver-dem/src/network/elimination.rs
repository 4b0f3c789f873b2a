//! The symbolic part of the elimination of a contact network: what depends on who touches whom alone.

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
    let mut least = 0;
    for _ in 0..n {
        let mut node = 0;
        for candidate in 0..n {
            if degree[candidate] < degree[node] {
                node = candidate;
            }
            // Eliminating a node takes at most itself from a neighbour: nothing can be lower.
            if degree[node] <= least {
                break;
            }
        }
        least = degree[node].saturating_sub(1);
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
