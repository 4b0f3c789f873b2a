//! VTU: an unstructured grid with its fields, in VTK's XML format, for ParaView, PyVista and meshio.
//!
//! Format: "VTK XML Formats" of the VTK documentation.

use std::path::Path;

use super::WriteError;
use super::file::write_whole;
use super::vtk::{array, begin, check_count, data, doubles, end, longs, pad};

pub use super::vtk::{Array, Values};

/// Shape of the cells, with the number that VTK has for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// Eight nodes: corners counter-clockwise, then the middles of the sides 01, 12, 23, 30.
    QuadraticQuad,
    /// Four corners, counter-clockwise.
    Quad,
    /// Six nodes: corners counter-clockwise, then the middles of the sides 01, 12, 20.
    QuadraticTriangle,
    /// A single point, so that values known at points only are drawn without a filter.
    Vertex,
}

impl CellKind {
    /// Number of nodes of a cell.
    pub fn node_count(self) -> usize {
        match self {
            Self::QuadraticQuad => 8,
            Self::Quad => 4,
            Self::QuadraticTriangle => 6,
            Self::Vertex => 1,
        }
    }

    fn vtk_number(self) -> u8 {
        match self {
            Self::QuadraticQuad => 23,
            Self::Quad => 9,
            Self::QuadraticTriangle => 22,
            Self::Vertex => 1,
        }
    }
}

/// Points and cells, all of one kind.
#[derive(Debug, Clone, Copy)]
pub struct Grid<'a, const D: usize> {
    /// Coordinates of the points.
    pub points: &'a [[f64; D]],
    /// Shape of the cells.
    pub kind: CellKind,
    /// Points of each cell, from 0, in VTK's order; one row of [`CellKind::node_count`] after the other.
    pub connectivity: &'a [u32],
}

/// Writes `grid` with its fields to `path`.
///
/// # Errors
/// An array of another length than the grid, a cell with a point that does not exist, or the file system's refusal; then
/// there is no file, or still the old one.
pub fn write<const D: usize>(
    path: &Path,
    grid: &Grid<'_, D>,
    point_data: &[Array<'_, D>],
    cell_data: &[Array<'_, D>],
) -> Result<(), WriteError> {
    let cells = check(grid, point_data, cell_data)?;
    write_whole(path, |out| {
        let (points, nodes) = (grid.points.len(), grid.kind.node_count());
        begin(out, "UnstructuredGrid")?;
        writeln!(
            out,
            r#"<Piece NumberOfPoints="{points}" NumberOfCells="{cells}">"#
        )?;
        data(out, "PointData", point_data)?;
        data(out, "CellData", cell_data)?;
        writeln!(out, "<Points>")?;
        array(
            out,
            "Float64",
            "Points",
            3,
            &doubles(grid.points.iter().flat_map(pad)),
        )?;
        writeln!(out, "</Points>\n<Cells>")?;
        let connectivity = longs(grid.connectivity.iter().map(|&point| i64::from(point)));
        array(out, "Int64", "connectivity", 1, &connectivity)?;
        array(
            out,
            "Int64",
            "offsets",
            1,
            &longs((1..=cells).map(|cell| (cell * nodes) as i64)),
        )?;
        array(
            out,
            "UInt8",
            "types",
            1,
            &vec![grid.kind.vtk_number(); cells],
        )?;
        writeln!(out, "</Cells>")?;
        end(out, "UnstructuredGrid")
    })
}

/// The number of cells, if everything fits together.
fn check<const D: usize>(
    grid: &Grid<'_, D>,
    point_data: &[Array<'_, D>],
    cell_data: &[Array<'_, D>],
) -> Result<usize, WriteError> {
    let (points, nodes) = (grid.points.len(), grid.kind.node_count());
    let cells = grid.connectivity.len() / nodes;
    check_count("connectivity", cells * nodes, grid.connectivity.len())?;
    if let Some(at) = grid
        .connectivity
        .iter()
        .position(|&point| point as usize >= points)
    {
        return Err(WriteError::Connectivity {
            cell: at / nodes,
            point: grid.connectivity[at],
            points,
        });
    }
    point_data
        .iter()
        .try_for_each(|array| check_count(array.name, points, array.values.len()))?;
    cell_data
        .iter()
        .try_for_each(|array| check_count(array.name, cells, array.values.len()))?;
    Ok(cells)
}
