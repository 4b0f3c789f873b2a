//! Nested dissection of the elements: the order in which fronts are formed.

use std::cmp::Ordering;

/// Elements that are assembled into one front without dissection. 2, 4 and 8 were measured.
pub(super) const LEAF: usize = 4;

/// The tree of dissection, children before parents, the root last.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Dissection {
    /// Elements, leaf after leaf.
    pub order: Vec<usize>,
    pub nodes: Vec<Node>,
}

/// Elements `start..end` of the order, a leaf or two halves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Node {
    pub start: usize,
    pub end: usize,
    pub halves: Option<[usize; 2]>,
}

impl Dissection {
    /// Halves the elements along the longer side of the box around their centres, and again, down to
    /// [`LEAF`] elements.
    pub fn new<const D: usize>(centres: &[[f64; D]]) -> Self {
        let mut dissection = Dissection {
            order: (0..centres.len()).collect(),
            nodes: Vec::new(),
        };
        dissection.halve(centres, 0, centres.len());
        dissection
    }

    /// Appends the subtree of these elements and returns its root.
    fn halve<const D: usize>(&mut self, centres: &[[f64; D]], start: usize, end: usize) -> usize {
        let mut halves = None;
        if end - start > LEAF {
            let elements = &mut self.order[start..end];
            let axis = longest_side(centres, elements);
            // Equal coordinates are told apart by the others, so that a half stays in one piece.
            elements.sort_unstable_by(|&a, &b| {
                (0..D)
                    .map(|i| (axis + i) % D)
                    .map(|i| centres[a][i].total_cmp(&centres[b][i]))
                    .fold(Ordering::Equal, Ordering::then)
                    .then(a.cmp(&b))
            });
            let middle = start + (end - start) / 2;
            halves = Some([
                self.halve(centres, start, middle),
                self.halve(centres, middle, end),
            ]);
        }
        self.nodes.push(Node { start, end, halves });
        self.nodes.len() - 1
    }
}

fn longest_side<const D: usize>(centres: &[[f64; D]], elements: &[usize]) -> usize {
    let mut sides = [0.0; D];
    for i in 0..D {
        let all = elements.iter().map(|&element| centres[element][i]);
        let low = all.clone().fold(f64::INFINITY, f64::min);
        let high = all.fold(f64::NEG_INFINITY, f64::max);
        sides[i] = high - low;
    }
    (0..D)
        .max_by(|&a, &b| sides[a].total_cmp(&sides[b]).then(b.cmp(&a)))
        .unwrap_or(0)
}
