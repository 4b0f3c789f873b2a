//! VTP: the grains of a REV as points with their radii, and the contacts as lines with their forces, for ParaView.
//!
//! In ParaView the grains are drawn by the filter Glyph (sphere, scaled by `radius`, factor 2).

use std::path::Path;

use super::WriteError;
use super::file::write_whole;
use super::vtk::{Array, array, begin, check_count, data, doubles, end, longs, pad};

/// Points, and lines between pairs of them.
#[derive(Debug, Clone, Copy)]
pub struct Points<'a, const D: usize> {
    /// Coordinates: the centres of the grains.
    pub points: &'a [[f64; D]],
    /// Pairs of points, from 0: the grains in contact. A contact across a side of the periodic cell would be a line
    /// through the whole cell and is better left out.
    pub lines: &'a [[u32; 2]],
}

/// Writes `points`; `point_data` has a value for each point, `line_data` one for each line.
///
/// # Errors
/// An array of the wrong length, a line to a point that does not exist, or the file system's refusal; then there is no
/// file, or still the old one.
pub fn write<const D: usize>(
    path: &Path,
    points: &Points<'_, D>,
    point_data: &[Array<'_, D>],
    line_data: &[Array<'_, D>],
) -> Result<(), WriteError> {
    let (count, lines) = (points.points.len(), points.lines.len());
    for (cell, line) in points.lines.iter().enumerate() {
        if let Some(&point) = line.iter().find(|&&point| point as usize >= count) {
            return Err(WriteError::Connectivity {
                cell,
                point,
                points: count,
            });
        }
    }
    point_data
        .iter()
        .try_for_each(|array| check_count(array.name, count, array.values.len()))?;
    line_data
        .iter()
        .try_for_each(|array| check_count(array.name, lines, array.values.len()))?;
    write_whole(path, |out| {
        begin(out, "PolyData")?;
        // Vertices would count as cells and so want values of the contacts: ParaView's Glyph needs points only.
        writeln!(
            out,
            r#"<Piece NumberOfPoints="{count}" NumberOfVerts="0" NumberOfLines="{lines}">"#
        )?;
        data(out, "PointData", point_data)?;
        data(out, "CellData", line_data)?;
        writeln!(out, "<Points>")?;
        array(
            out,
            "Float64",
            "Points",
            3,
            &doubles(points.points.iter().flat_map(pad)),
        )?;
        writeln!(out, "</Points>\n<Lines>")?;
        let connectivity = longs(points.lines.iter().flatten().map(|&point| i64::from(point)));
        array(out, "Int64", "connectivity", 1, &connectivity)?;
        array(
            out,
            "Int64",
            "offsets",
            1,
            &longs((1..=lines).map(|line| (line * 2) as i64)),
        )?;
        writeln!(out, "</Lines>")?;
        end(out, "PolyData")
    })
}
