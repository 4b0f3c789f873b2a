//! PVD: the collection of the VTU files of a run, which ParaView opens as one film.

use std::path::Path;

use super::WriteError;
use super::file::write_whole;
use super::vtk::escape;

/// One file of the collection.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// ParaView's time; here the number of the load step, or a load parameter that grows.
    pub time: f64,
    /// The file, relative to the collection.
    pub file: String,
}

/// Writes the collection to `path`.
///
/// # Errors
/// The file system's refusal; then there is no file, or still the old one.
pub fn write(path: &Path, entries: &[Entry]) -> Result<(), WriteError> {
    write_whole(path, |out| {
        writeln!(out, r#"<?xml version="1.0"?>"#)?;
        writeln!(
            out,
            r#"<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">"#
        )?;
        writeln!(out, "<Collection>")?;
        for Entry { time, file } in entries {
            writeln!(
                out,
                r#"<DataSet timestep="{time}" part="0" file="{}"/>"#,
                escape(file)
            )?;
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}
