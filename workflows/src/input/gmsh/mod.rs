//! Meshes of Gmsh: the bytes of a `.msh` file to a mesh, or all that is wrong with it.
//!
//! Formats 2.2 and 4.1, ASCII and binary of either byte order (*Gmsh reference manual*, "MSH file format"). No crate that
//! is looked after reads both: this reader does, and nothing else of the format.
//!
//! 1. `scan`: a position in the bytes; tokens, numbers, sections;
//! 2. `msh2`, `msh4`: the sections of a format to the `raw` contents, which are the same for both;
//! 3. `build`: the contents to an [`Imported`] mesh, with its groups, checked.
//!
//! Anything may stand in a file. Counts are believed only as far as the bytes reach, no index is used unchecked, and
//! what is left out (partitions, volumes, mixed elements) is refused in words.

mod build;
mod error;
mod imported;
mod kinds;
mod msh2;
mod msh4;
mod raw;
mod scan;

pub use self::error::{GmshError, GmshErrors};
pub use self::imported::Imported;

/// The mesh in the bytes of a `.msh` file. `file` is the name that the mesh keeps.
///
/// # Errors
/// The first thing that cannot be read, or all that is wrong with what was read.
pub fn read(bytes: &[u8], file: &str) -> Result<Imported, GmshErrors> {
    let raw = raw::read(bytes)?;
    build::build(raw, file)
}
