//! The numeric factorisation: front after front, children before parents.

use super::front::Front;
use super::symbolic::Plan;
use crate::linear_solver::checked::Matrix;

/// L and U of all fronts, one after another.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Store {
    pub fronts: Vec<Extent>,
    /// Equations of rows and columns of every front, in the order of its pivots.
    pub rows: Vec<u32>,
    pub columns: Vec<u32>,
    /// Of every front the pivots' columns over all rows, then the pivots' rows in the other columns.
    pub values: Vec<f64>,
}

/// One front in a [`Store`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Extent {
    pub size: usize,
    pub pivots: usize,
}

/// What is told of a factorisation beside its factors.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Outcome {
    /// Pivots that were eliminated above the front where they were summed.
    pub delayed: usize,
    /// An equation without a pivot, where there is one.
    pub deficient: Option<usize>,
}

/// What a front leaves to its parent: the delayed part, then the planned border.
struct Remainder {
    delayed: usize,
    rows: Vec<u32>,
    columns: Vec<u32>,
}

/// Stand-in for a pivot that is exactly zero: in scaled unknowns so small that the motion without stiffness
/// shows, and large enough to stay a number.
const NO_PIVOT: f64 = 1e-30;

impl Store {
    /// Replaces the content by the factors of a matrix.
    pub fn factorise(&mut self, plans: &[Plan], matrix: &Matrix<'_>) -> Outcome {
        self.fronts.clear();
        self.rows.clear();
        self.columns.clear();
        self.values.clear();
        let mut outcome = Outcome::default();
        let mut front = Front::default();
        // Remainders that no parent has taken yet, the last ones on top.
        let mut waiting: Vec<Remainder> = Vec::new();
        let mut stack: Vec<f64> = Vec::new();
        for plan in plans {
            let children = plan.children.map_or(0, |children| children.len());
            let children = waiting.split_off(waiting.len() - children);
            assemble(&mut front, plan, matrix, &children);
            take_over(&mut front, plans, plan, &children, &mut stack);
            let mut pivots = front.eliminate();
            if front.summed == front.size && pivots < front.size {
                outcome.deficient = Some(front.columns[pivots] as usize);
                stand_in(&mut front, pivots);
                pivots = front.size;
            }
            outcome.delayed += front.summed - pivots;
            self.keep(&front, pivots);
            for column in pivots..front.size {
                stack.extend_from_slice(&front.column(column)[pivots..]);
            }
            waiting.push(Remainder {
                delayed: front.summed - pivots,
                rows: front.rows[pivots..].to_vec(),
                columns: front.columns[pivots..].to_vec(),
            });
        }
        outcome
    }

    fn keep(&mut self, front: &Front, pivots: usize) {
        self.fronts.push(Extent {
            size: front.size,
            pivots,
        });
        self.rows.extend_from_slice(&front.rows);
        self.columns.extend_from_slice(&front.columns);
        for column in 0..front.size {
            let rows = if column < pivots { front.size } else { pivots };
            self.values.extend_from_slice(&front.column(column)[..rows]);
        }
    }
}

/// The entries of the matrix that belong to a front, scaled; delayed rows and columns come first.
fn assemble(front: &mut Front, plan: &Plan, matrix: &Matrix<'_>, children: &[Remainder]) {
    let delayed: usize = children.iter().map(|child| child.delayed).sum();
    front.reset(delayed + plan.equations.len(), delayed + plan.summed);
    for child in children {
        front.rows.extend_from_slice(&child.rows[..child.delayed]);
        front
            .columns
            .extend_from_slice(&child.columns[..child.delayed]);
    }
    front.rows.extend_from_slice(&plan.equations);
    front.columns.extend_from_slice(&plan.equations);
    let scale = |place: u32| matrix.scale[plan.equations[place as usize] as usize];
    for entry in &plan.entries {
        let (row, column) = (
            entry.row as usize + delayed,
            entry.column as usize + delayed,
        );
        front.values[column * front.stride + row] =
            matrix.values[entry.source as usize] * scale(entry.row) * scale(entry.column);
    }
}

/// Adds the remainders of the children, which lie on top of the stack.
fn take_over(
    front: &mut Front,
    plans: &[Plan],
    plan: &Plan,
    children: &[Remainder],
    stack: &mut Vec<f64>,
) {
    let delayed: usize = children.iter().map(|child| child.delayed).sum();
    let count: usize = children
        .iter()
        .map(|child| child.rows.len() * child.rows.len())
        .sum();
    let mut rest = &stack[stack.len() - count..];
    let mut first = 0;
    for (child, &number) in children.iter().zip(plan.children.iter().flatten()) {
        let size = child.rows.len();
        let places: Vec<usize> = (first..first + child.delayed)
            .chain(
                plans[number]
                    .in_parent
                    .iter()
                    .map(|&place| delayed + place as usize),
            )
            .collect();
        let (own, others) = rest.split_at(size * size);
        for (values, &column) in own.chunks_exact(size.max(1)).zip(&places) {
            let target = &mut front.values[column * front.stride..][..front.size];
            for (value, &row) in values.iter().zip(&places) {
                target[row] += value;
            }
        }
        first += child.delayed;
        rest = others;
    }
    stack.truncate(stack.len() - count);
}

/// Replaces what is left of a root without pivots, which is zero, by a trace of stiffness.
fn stand_in(front: &mut Front, pivots: usize) {
    for column in pivots..front.size {
        let values = &mut front.values[column * front.stride..][..front.size];
        values[pivots..].fill(0.0);
        values[column] = NO_PIVOT;
    }
}
