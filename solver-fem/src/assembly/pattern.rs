//! The sparsity pattern of the free equations, with a precomputed scatter map.

use crate::boundary::Constraints;
use crate::mesh::Mesh;

/// Compressed-column pattern of the free equations; fixed for a problem, structural zeros kept.
#[derive(Clone, PartialEq, Debug)]
pub struct Pattern {
    /// Number of equations.
    pub size: usize,
    /// Start of every column in [`rows`](Self::rows); `size + 1` entries.
    pub columns: Vec<usize>,
    /// Row of every entry, ascending within a column.
    pub rows: Vec<usize>,
    /// Entry of every local (row, column) of every element; [`Pattern::SKIP`] where prescribed.
    scatter: Vec<u32>,
    local_size: usize,
}

impl Pattern {
    const SKIP: u32 = u32::MAX;

    pub(crate) fn new<const D: usize>(mesh: &Mesh<D>, constraints: &Constraints) -> Self {
        let size = constraints.free.len();
        let local_size = mesh.nodes_per_element * D;
        let equations = |element: usize| -> Vec<Option<usize>> {
            let nodes = mesh.element(element).iter();
            nodes
                .flat_map(|&n| (0..D).map(move |i| n * D + i))
                .map(|d| constraints.equation[d])
                .collect()
        };
        let mut lists: Vec<Vec<usize>> = vec![Vec::new(); size];
        for element in 0..mesh.element_count() {
            let equations = equations(element);
            for &column in equations.iter().flatten() {
                lists[column].extend(equations.iter().flatten());
            }
        }
        let mut columns = vec![0];
        let mut rows = Vec::new();
        for mut list in lists {
            list.sort_unstable();
            list.dedup();
            rows.extend(list);
            columns.push(rows.len());
        }
        let mut scatter = Vec::with_capacity(mesh.element_count() * local_size * local_size);
        for element in 0..mesh.element_count() {
            let equations = equations(element);
            for &row in &equations {
                for &column in &equations {
                    scatter.push(match (row, column) {
                        (Some(row), Some(column)) => {
                            let range = &rows[columns[column]..columns[column + 1]];
                            let place = range.binary_search(&row);
                            (columns[column] + place.expect("the pattern was built from it")) as u32
                        }
                        _ => Self::SKIP,
                    });
                }
            }
        }
        Pattern {
            size,
            columns,
            rows,
            scatter,
            local_size,
        }
    }

    /// Number of stored entries.
    pub fn entry_count(&self) -> usize {
        self.rows.len()
    }

    /// Entry of a local (row, column) of an element, `None` where one of them is prescribed.
    pub(crate) fn entry(&self, element: usize, row: usize, column: usize) -> Option<usize> {
        let place = self.scatter[(element * self.local_size + row) * self.local_size + column];
        (place != Self::SKIP).then_some(place as usize)
    }

    /// y = A·x for values on this pattern.
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.size];
        for column in 0..self.size {
            for entry in self.columns[column]..self.columns[column + 1] {
                y[self.rows[entry]] += values[entry] * x[column];
            }
        }
        y
    }
}
