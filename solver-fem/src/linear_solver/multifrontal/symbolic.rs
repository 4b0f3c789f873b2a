//! Which unknowns each front holds and eliminates, and where the entries of the matrix and of its
//! children go.

use super::ordering::Dissection;
use crate::assembly::Pattern;
use crate::layout::Field;

/// A front as planned: no unknown was passed on by a child for want of a pivot.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Plan {
    /// Equations in the front: the summed ones, whose elements all lie below, then the border.
    pub equations: Vec<u32>,
    /// Number of summed equations.
    pub summed: usize,
    /// Fronts whose remainders are added.
    pub children: Option<[usize; 2]>,
    /// Place in the parent of every border equation.
    pub in_parent: Vec<u32>,
    /// Entries of the matrix that belong here: the unknown of their row or their column is summed here.
    pub entries: Vec<Entry>,
}

/// An entry of the matrix and its place in the planned front.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Entry {
    pub source: u32,
    pub row: u32,
    pub column: u32,
}

/// One plan per front, children before parents.
pub(super) fn plan<const D: usize>(
    pattern: &Pattern,
    fields: &[Field],
    centres: &[[f64; D]],
) -> Vec<Plan> {
    let Dissection { order, nodes } = Dissection::new(centres);
    let equations = |element: usize| pattern.element_equations(element).iter().flatten().copied();
    // First and last place in the order of the elements of an equation: it is summed in the smallest
    // subtree that holds both, in the root if there is none.
    let mut span = vec![None; pattern.size];
    for (place, &element) in order.iter().enumerate() {
        for equation in equations(element) {
            let (_, last) = span[equation as usize].get_or_insert((place, place));
            *last = place;
        }
    }
    let mut plans: Vec<Plan> = Vec::with_capacity(nodes.len());
    // Front in which an equation is summed.
    let mut home = vec![usize::MAX; pattern.size];
    for (number, node) in nodes.iter().enumerate() {
        let mut open: Vec<u32> = match node.halves {
            None => order[node.start..node.end]
                .iter()
                .copied()
                .flat_map(equations)
                .collect(),
            Some(halves) => halves
                .iter()
                .flat_map(|&half| plans[half].border())
                .copied()
                .collect(),
        };
        if number + 1 == nodes.len() {
            open.extend(
                (0..pattern.size as u32).filter(|&equation| span[equation as usize].is_none()),
            );
        }
        open.sort_unstable();
        open.dedup();
        let (mut summed, border): (Vec<u32>, Vec<u32>) = open.into_iter().partition(|&equation| {
            span[equation as usize]
                .is_none_or(|(first, last)| node.start <= first && last < node.end)
        });
        // Multipliers last: their pivots are what eliminating the fields before leaves on the diagonal.
        summed.sort_by_key(|&equation| fields[equation as usize]);
        for &equation in &summed {
            home[equation as usize] = number;
        }
        plans.push(Plan {
            summed: summed.len(),
            equations: [summed, border].concat(),
            children: node.halves,
            ..Plan::default()
        });
    }
    place_entries(pattern, &mut plans, &home);
    plans
}

fn place_entries(pattern: &Pattern, plans: &mut [Plan], home: &[usize]) {
    // Entries by the front they belong to, the earlier home of row and column: as both lie in one
    // element, that front holds both.
    let mut sources: Vec<Vec<(u32, u32)>> = vec![Vec::new(); plans.len()];
    for column in 0..pattern.size {
        for entry in pattern.columns[column]..pattern.columns[column + 1] {
            let front = home[column].min(home[pattern.rows[entry]]);
            sources[front].push((entry as u32, column as u32));
        }
    }
    // Place of every equation in the front at hand.
    let mut place = vec![0_u32; pattern.size];
    for (front, sources) in sources.into_iter().enumerate() {
        for (position, &equation) in plans[front].equations.iter().enumerate() {
            place[equation as usize] = position as u32;
        }
        let entry = |(source, column): (u32, u32)| Entry {
            source,
            row: place[pattern.rows[source as usize]],
            column: place[column as usize],
        };
        plans[front].entries = sources.into_iter().map(entry).collect();
        for child in plans[front].children.into_iter().flatten() {
            let border = plans[child].border().iter();
            plans[child].in_parent = border.map(|&equation| place[equation as usize]).collect();
        }
    }
}

impl Plan {
    /// Equations that the parent takes over.
    pub fn border(&self) -> &[u32] {
        &self.equations[self.summed..]
    }
}
