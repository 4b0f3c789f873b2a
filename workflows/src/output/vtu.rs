//! VTU: an unstructured grid with its fields, in VTK's XML format, for ParaView, PyVista and meshio.
//!
//! Format: "VTK XML Formats" of the VTK documentation. Arrays are inline, base 64, uncompressed, little endian, each behind a
//! 64-bit length. Vectors and tensors are padded with zeros to three dimensions, as ParaView expects.

use std::io::Write;
use std::path::Path;

use super::WriteError;
use super::base64::encode;
use super::file::write_whole;

/// Shape of the cells, with the number that VTK has for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// Eight nodes: corners counter-clockwise, then the middles of the sides 01, 12, 23, 30.
    QuadraticQuad,
}

impl CellKind {
    /// Number of nodes of a cell.
    pub fn node_count(self) -> usize {
        match self {
            Self::QuadraticQuad => 8,
        }
    }

    fn vtk_number(self) -> u8 {
        match self {
            Self::QuadraticQuad => 23,
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

/// A named array with one value for each point or cell.
#[derive(Debug, Clone, Copy)]
pub struct Array<'a, const D: usize> {
    /// Its name in ParaView.
    pub name: &'a str,
    /// Its values.
    pub values: Values<'a, D>,
}

/// The values of an array.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a, const D: usize> {
    /// One number each.
    Scalar(&'a [f64]),
    /// One vector each.
    Vector(&'a [[f64; D]]),
    /// One second-order tensor each, `t[i][j]` in row i, column j.
    Tensor(&'a [[[f64; D]; D]]),
}

impl<const D: usize> Values<'_, D> {
    fn len(&self) -> usize {
        match self {
            Self::Scalar(values) => values.len(),
            Self::Vector(values) => values.len(),
            Self::Tensor(values) => values.len(),
        }
    }

    fn components(&self) -> usize {
        match self {
            Self::Scalar(_) => 1,
            Self::Vector(_) => 3,
            Self::Tensor(_) => 9,
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Scalar(values) => doubles(values.iter().copied()),
            Self::Vector(values) => doubles(values.iter().flat_map(pad)),
            Self::Tensor(values) => {
                doubles(values.iter().flat_map(|tensor| {
                    (0..3).flat_map(move |i| tensor.get(i).map_or([0.0; 3], pad))
                }))
            }
        }
    }
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
        writeln!(out, r#"<?xml version="1.0"?>"#)?;
        writeln!(
            out,
            r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
        )?;
        writeln!(out, "<UnstructuredGrid>")?;
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
        let longs = |values: &mut dyn Iterator<Item = i64>| {
            values.flat_map(i64::to_le_bytes).collect::<Vec<u8>>()
        };
        array(
            out,
            "Int64",
            "connectivity",
            1,
            &longs(&mut grid.connectivity.iter().map(|&point| i64::from(point))),
        )?;
        array(
            out,
            "Int64",
            "offsets",
            1,
            &longs(&mut (1..=cells).map(|cell| (cell * nodes) as i64)),
        )?;
        array(
            out,
            "UInt8",
            "types",
            1,
            &vec![grid.kind.vtk_number(); cells],
        )?;
        writeln!(out, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
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
    let count = |name: &str, expected, found| match expected == found {
        true => Ok(()),
        false => Err(WriteError::Count {
            name: name.to_owned(),
            expected,
            found,
        }),
    };
    count("connectivity", cells * nodes, grid.connectivity.len())?;
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
        .try_for_each(|array| count(array.name, points, array.values.len()))?;
    cell_data
        .iter()
        .try_for_each(|array| count(array.name, cells, array.values.len()))?;
    Ok(cells)
}

fn data<const D: usize>(
    out: &mut dyn Write,
    section: &str,
    arrays: &[Array<'_, D>],
) -> std::io::Result<()> {
    writeln!(out, "<{section}>")?;
    for one in arrays {
        array(
            out,
            "Float64",
            one.name,
            one.values.components(),
            &one.values.bytes(),
        )?;
    }
    writeln!(out, "</{section}>")
}

fn array(
    out: &mut dyn Write,
    kind: &str,
    name: &str,
    components: usize,
    bytes: &[u8],
) -> std::io::Result<()> {
    let name = escape(name);
    // Length and content are two base-64 texts of their own.
    let (length, content) = (encode(&(bytes.len() as u64).to_le_bytes()), encode(bytes));
    writeln!(
        out,
        r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">{length}{content}</DataArray>"#
    )
}

fn pad<const D: usize>(vector: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|i| vector.get(i).copied().unwrap_or(0.0))
}

fn doubles(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

/// `text` inside an attribute of XML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
