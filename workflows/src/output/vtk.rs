//! What the XML formats of VTK share: named arrays, inline, base 64, uncompressed, little endian, each behind a 64-bit
//! length. Vectors and tensors are padded with zeros to three dimensions, as ParaView expects.

use std::io::Write;

use super::WriteError;
use super::base64::encode;

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
    pub(super) fn len(&self) -> usize {
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

/// Refuses an array that does not have `expected` values.
pub(super) fn check_count(name: &str, expected: usize, found: usize) -> Result<(), WriteError> {
    if expected == found {
        return Ok(());
    }
    Err(WriteError::Count {
        name: name.to_owned(),
        expected,
        found,
    })
}

/// Writes what comes before the content of a file of this type.
pub(super) fn begin(out: &mut dyn Write, kind: &str) -> std::io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        out,
        r#"<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
    )?;
    writeln!(out, "<{kind}>")
}

/// Writes what comes after it.
pub(super) fn end(out: &mut dyn Write, kind: &str) -> std::io::Result<()> {
    writeln!(out, "</Piece>\n</{kind}>\n</VTKFile>")
}

/// Whole numbers as VTK's Int64.
pub(super) fn longs(values: impl Iterator<Item = i64>) -> Vec<u8> {
    values.flat_map(i64::to_le_bytes).collect()
}

pub(super) fn data<const D: usize>(
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

pub(super) fn array(
    out: &mut dyn Write,
    kind: &str,
    name: &str,
    components: usize,
    bytes: &[u8],
) -> std::io::Result<()> {
    let name = escape(name);
    // Length and content are two base-64 texts of their own.
    let (length, content) = (encode(&(bytes.len() as u64).to_le_bytes()), encode(bytes));
    // One component is the default; written out, meshio would make a column of the array.
    let components = match components {
        1 => String::new(),
        more => format!(r#" NumberOfComponents="{more}""#),
    };
    writeln!(
        out,
        r#"<DataArray type="{kind}" Name="{name}"{components} format="binary">{length}{content}</DataArray>"#
    )
}

pub(super) fn pad<const D: usize>(vector: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|i| vector.get(i).copied().unwrap_or(0.0))
}

pub(super) fn doubles(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

/// `text` inside an attribute of XML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
