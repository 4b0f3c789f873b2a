//! The mesh as small cells, each of one colour.

use std::sync::Arc;

use clap::ValueEnum;
use solver_fem::problem::Problem;

use super::quantity::Values;

/// The most cells of a picture: more would not be seen and take long to draw.
const MOST_CELLS: usize = 60_000;
/// Pieces a side of an element is divided into where Gauss points are told apart: a multiple of 2 and of 3, so that the
/// borders between points of a regular rule are borders of cells.
const BY_POINT: usize = 6;
/// The most pieces a side is divided into.
const FINEST: usize = 32;

/// How values that belong to Gauss points are spread over elements.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum Spread {
    /// Carried to the nodes, within the range of each element, and averaged there: smooth, peaks are lowered.
    #[default]
    Nodes,
    /// The mean of the element.
    Elements,
    /// The value of the nearest Gauss point, as computed.
    Points,
}

/// One cell: its corners where they are drawn, and its value.
pub struct Cell {
    /// Corners.
    pub corners: Vec<[f64; 2]>,
    /// Value; NaN where there is none.
    pub value: f64,
}

/// Cells of the whole mesh with its nodes at `positions` (node after node); `side` is the mean length of an element's
/// side over the length that one cell should have.
pub fn cells(
    problem: &Arc<Problem<2>>,
    positions: &[f64],
    values: &Values,
    spread: Spread,
    side: f64,
) -> Vec<Cell> {
    let elements = problem.mesh().element_count();
    let field = Field::new(problem, values, spread);
    let room = ((MOST_CELLS / elements.max(1)) as f64).sqrt() as usize;
    let wanted = match field {
        Field::ByPoint(_) => BY_POINT,
        // Curved sides still look it.
        Field::ByElement(_) => (side.ceil() as usize).clamp(1, 3),
        Field::Smooth(_) => (side.ceil() as usize).clamp(1, FINEST),
    };
    let divided = Divided::new(problem, wanted.min(room.max(1)));
    (0..elements)
        .flat_map(|element| {
            let nodes = problem.mesh().element(element);
            let (divided, field) = (&divided, &field);
            divided.cells.iter().map(move |cell| Cell {
                corners: cell
                    .corners
                    .iter()
                    .map(|shape| {
                        let along = |i: usize| {
                            let terms = shape.iter().zip(nodes);
                            terms.map(|(s, &n)| s * positions[2 * n + i]).sum::<f64>()
                        };
                        [along(0), along(1)]
                    })
                    .collect(),
                value: field.at(element, cell),
            })
        })
        .collect()
}

/// Values ready to be looked up.
enum Field {
    /// At the nodes of every element.
    Smooth(Vec<Vec<f64>>),
    /// One for every element.
    ByElement(Vec<f64>),
    /// At the Gauss points of every element.
    ByPoint(Vec<Vec<f64>>),
}

impl Field {
    fn new(problem: &Problem<2>, values: &Values, spread: Spread) -> Self {
        let mesh = problem.mesh();
        match (values, spread) {
            (Values::Elements(values), _) => Self::ByElement(values.clone()),
            (Values::Nodes(values), _) => {
                let of = |element| mesh.element(element).iter().map(|&n| values[n]).collect();
                Self::Smooth((0..mesh.element_count()).map(of).collect())
            }
            (Values::Points(values), Spread::Elements) => {
                let mean = |chunk: &[f64]| chunk.iter().sum::<f64>() / chunk.len() as f64;
                let chunks = values.chunks(problem.points_per_element());
                Self::ByElement(chunks.map(mean).collect())
            }
            (Values::Points(values), Spread::Points) => {
                let chunks = values.chunks(problem.points_per_element());
                Self::ByPoint(chunks.map(<[f64]>::to_vec).collect())
            }
            (Values::Points(values), Spread::Nodes) => Self::Smooth(smooth(problem, values)),
        }
    }

    fn at(&self, element: usize, cell: &ReferenceCell) -> f64 {
        match self {
            Self::Smooth(values) => {
                let own = &values[element];
                let terms = cell.shape.iter().zip(own);
                let sum: f64 = terms.map(|(shape, value)| shape * value).sum();
                within(sum, own)
            }
            Self::ByElement(values) => values[element],
            Self::ByPoint(values) => values[element][cell.nearest],
        }
    }
}

/// Gauss point values at the nodes of every element, averaged over the elements of a node that have any: elements
/// without grains have none, and must not blot out their neighbours.
fn smooth(problem: &Problem<2>, values: &[f64]) -> Vec<Vec<f64>> {
    let mesh = problem.mesh();
    let points = problem.points_per_element();
    let matrix = problem.element().extrapolation();
    let mut sums = vec![(0.0, 0.0); mesh.nodes.len()];
    let own: Vec<Vec<f64>> = values
        .chunks(points)
        .map(|chunk| {
            let rows = matrix.chunks(points);
            rows.map(|row| within(row.iter().zip(chunk).map(|(m, v)| m * v).sum(), chunk))
                .collect()
        })
        .collect();
    for (element, at_nodes) in own.iter().enumerate() {
        for (&node, value) in mesh.element(element).iter().zip(at_nodes) {
            if value.is_finite() {
                sums[node].0 += value;
                sums[node].1 += 1.0;
            }
        }
    }
    own.into_iter()
        .enumerate()
        .map(|(element, at_nodes)| {
            let nodes = mesh.element(element).iter();
            let mean = |(&node, own): (&usize, f64)| match own.is_finite() {
                true => sums[node].0 / sums[node].1,
                false => f64::NAN,
            };
            nodes.zip(at_nodes).map(mean).collect()
        })
        .collect()
}

/// The number, or the end of the range of `values` that it lies beyond: no picture shows what nothing has.
fn within(number: f64, values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    // Where one of the values is no number, neither is this one.
    if number.is_nan() || low > high {
        return number;
    }
    number.clamp(low, high)
}

/// The reference element cut into cells.
struct Divided {
    cells: Vec<ReferenceCell>,
}

struct ReferenceCell {
    /// Shape functions at the corners.
    corners: Vec<Vec<f64>>,
    /// Shape functions in the middle.
    shape: Vec<f64>,
    /// The Gauss point that is nearest to the middle.
    nearest: usize,
}

impl Divided {
    fn new(problem: &Problem<2>, pieces: usize) -> Self {
        let element = problem.element();
        let shape = |xi: [f64; 2]| {
            let mut values = vec![0.0; element.node_count()];
            element.shape(&xi, &mut values);
            values
        };
        let points = element.quadrature();
        let outlines = match element.corner_count() {
            3 => triangles(pieces),
            _ => squares(pieces),
        };
        let cells = outlines
            .into_iter()
            .map(|outline| {
                let count = outline.len() as f64;
                let middle = [0, 1].map(|i| outline.iter().map(|xi| xi[i]).sum::<f64>() / count);
                let distance = |k: usize| {
                    let xi = points[k].xi;
                    (xi[0] - middle[0]).powi(2) + (xi[1] - middle[1]).powi(2)
                };
                ReferenceCell {
                    corners: outline.into_iter().map(shape).collect(),
                    shape: shape(middle),
                    nearest: (0..points.len())
                        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
                        .unwrap_or(0),
                }
            })
            .collect();
        Self { cells }
    }
}

/// [−1, 1]² in n × n squares.
fn squares(n: usize) -> Vec<Vec<[f64; 2]>> {
    let at = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
    let square = |(i, j): (usize, usize)| {
        [(0, 0), (1, 0), (1, 1), (0, 1)]
            .map(|(di, dj)| [at(i + di), at(j + dj)])
            .to_vec()
    };
    (0..n)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .map(square)
        .collect()
}

/// The triangle (0,0), (1,0), (0,1) in n² equal ones.
fn triangles(n: usize) -> Vec<Vec<[f64; 2]>> {
    let at = |i: usize, j: usize| [i as f64 / n as f64, j as f64 / n as f64];
    let mut all = Vec::with_capacity(n * n);
    for j in 0..n {
        for i in 0..n - j {
            all.push(vec![at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                all.push(vec![at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_drawn_that_no_point_has() {
        assert_eq!(
            [
                within(3.0, &[1.0, 2.0]),
                within(0.0, &[1.0, 2.0]),
                within(1.5, &[1.0, 2.0])
            ],
            [2.0, 1.0, 1.5]
        );
        assert!(within(f64::NAN, &[1.0, f64::NAN]).is_nan());
    }

    #[test]
    fn the_cells_of_an_element_cover_it_once() {
        for n in [1, 2, 5] {
            let area = |outline: &Vec<[f64; 2]>| -> f64 {
                let next = outline.iter().cycle().skip(1);
                let twice = outline
                    .iter()
                    .zip(next)
                    .map(|(a, b)| a[0] * b[1] - b[0] * a[1]);
                0.5 * twice.sum::<f64>()
            };
            assert!((squares(n).iter().map(area).sum::<f64>() - 4.0).abs() < 1e-14);
            assert!((triangles(n).iter().map(area).sum::<f64>() - 0.5).abs() < 1e-14);
            assert!(
                squares(n)
                    .iter()
                    .chain(&triangles(n))
                    .all(|cell| area(cell) > 0.0)
            );
        }
    }
}
