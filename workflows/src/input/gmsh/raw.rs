//! The contents of a mesh file, the same for both formats.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::error::{GmshError, GmshErrors};
use super::kinds::Kind;
use super::scan::{Encoding, Scanner};
use super::{msh2, msh4};

/// What a mesh file holds.
#[derive(Debug, Default)]
pub struct Raw {
    /// Nodes in the order of the file: number and position.
    pub nodes: Vec<(u64, [f64; 3])>,
    /// Elements in the order of the file.
    pub elements: Vec<RawElement>,
    /// Names of the physical groups, by dimension and number.
    pub names: BTreeMap<(u8, u32), String>,
}

/// One element of the file.
#[derive(Debug)]
pub struct RawElement {
    /// Its number.
    pub tag: u64,
    /// What it is.
    pub kind: Kind,
    /// The physical groups it is in, at most [`MOST_GROUPS`]; elements of one entity share the list.
    pub groups: Arc<[u32]>,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
}

/// The most physical groups that one entity may be in; more are a file that lies.
pub const MOST_GROUPS: usize = 64;

/// Reads the file, whatever its format.
pub fn read(bytes: &[u8]) -> Result<Raw, GmshErrors> {
    let mut scanner = Scanner::new(bytes);
    if scanner.next_section()?.as_deref() != Some("MeshFormat") {
        return Err(GmshError::NotGmsh.into());
    }
    let version = scanner.word()?.to_owned();
    let binary = scanner.unsigned()?;
    let size = scanner.unsigned()?;
    scanner.end_line();
    let read_rest = match version.as_str() {
        "2.2" => msh2::read,
        "4.1" => msh4::read,
        _ => return Err(GmshError::Version { found: version }.into()),
    };
    let encoding = match binary {
        0 => Encoding::Ascii,
        1 if size == 8 => scanner.byte_order()?,
        1 => {
            return Err(scanner
                .wrong(format!("numbers of {size} bytes, not 8"))
                .into());
        }
        _ => {
            return Err(scanner
                .wrong(format!("file type {binary}, not 0 or 1"))
                .into());
        }
    };
    scanner.close("MeshFormat")?;
    scanner.encoding = encoding;
    Ok(read_rest(&mut scanner)?)
}

/// `$PhysicalNames`, which is text in every encoding: number of names, then `dimension number "name"`.
pub fn names(scanner: &mut Scanner<'_>, into: &mut Raw) -> Result<(), GmshError> {
    let count = scanner.word_count()?;
    for _ in 0..count {
        let dimension = scanner.word_number::<u8>()?;
        let number = scanner.word_number::<i64>()?;
        let name = scanner.quoted()?;
        into.names.insert((dimension, group(number)), name);
    }
    Ok(())
}

/// The number of a group; its sign only says which way round the entity is meant.
pub fn group(number: i64) -> u32 {
    u32::try_from(number.unsigned_abs()).unwrap_or(u32::MAX)
}
