//! The sparsity pattern of the free equations, with a precomputed scatter map.

use crate::boundary::Constraints;
use crate::layout::Layout;
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
    /// Equations of every element, one after the other, in the order of its local unknowns.
    equations: Vec<Option<u32>>,
    /// Where the equations of every element begin, and the end.
    starts: Vec<usize>,
    /// Entry of every local (row, column) of every element; [`Pattern::SKIP`] where prescribed.
    scatter: Vec<u32>,
    /// Where the entries of every element begin.
    scatter_starts: Vec<usize>,
}

impl Pattern {
    const SKIP: u32 = u32::MAX;

    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        layout: &Layout<D>,
        constraints: &Constraints,
    ) -> Self {
        let elements: Vec<Vec<Option<usize>>> = (0..mesh.element_count())
            .map(|element| {
                let dofs = layout.element_dofs(mesh, element).into_iter();
                dofs.map(|dof| constraints.equation[dof]).collect()
            })
            .collect();
        Self::of_elements(constraints.free.len(), &elements)
    }

    /// The pattern of `size` equations over elements given by the equation of each of their unknowns,
    /// `None` where a value is prescribed. An equation may stand twice in an element that is tied to
    /// itself.
    ///
    /// # Panics
    /// When an equation is not below `size`.
    pub fn of_elements(size: usize, elements: &[Vec<Option<usize>>]) -> Self {
        let mut lists: Vec<Vec<usize>> = vec![Vec::new(); size];
        for equations in elements {
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
        let squares = elements.iter().map(|equations| equations.len().pow(2));
        let mut scatter = Vec::with_capacity(squares.sum());
        let (mut starts, mut scatter_starts) = (vec![0], Vec::with_capacity(elements.len()));
        for equations in elements {
            scatter_starts.push(scatter.len());
            starts.push(starts[starts.len() - 1] + equations.len());
            for &row in equations {
                for &column in equations {
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
        let equations = elements.iter().flatten();
        Pattern {
            size,
            columns,
            rows,
            equations: equations.map(|e| e.map(|e| e as u32)).collect(),
            starts,
            scatter,
            scatter_starts,
        }
    }

    /// Number of stored entries.
    pub fn entry_count(&self) -> usize {
        self.rows.len()
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.scatter_starts.len()
    }

    /// The equation of every local unknown of an element, `None` where prescribed.
    pub fn element_equations(&self, element: usize) -> &[Option<u32>] {
        &self.equations[self.starts[element]..self.starts[element + 1]]
    }

    /// Entry of a local (row, column) of an element, `None` where one of them is prescribed.
    pub fn entry(&self, element: usize, row: usize, column: usize) -> Option<usize> {
        let size = self.starts[element + 1] - self.starts[element];
        let place = self.scatter[self.scatter_starts[element] + row * size + column];
        (place != Self::SKIP).then_some(place as usize)
    }

    /// Adds a dense element matrix, row by row, to values on this pattern; prescribed rows and columns are
    /// left out.
    pub(crate) fn scatter(&self, element: usize, matrix: &[f64], values: &mut [f64]) {
        let places = &self.scatter[self.scatter_starts[element]..][..matrix.len()];
        for (&place, value) in places.iter().zip(matrix) {
            if place != Self::SKIP {
                values[place as usize] += value;
            }
        }
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
