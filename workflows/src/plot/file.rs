//! Where a picture goes, and in which format.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;

use super::raster::{RasterError, png};
use super::scene::Scene;
use crate::output::{WriteError, write_bytes};

/// Why a path is no place for a picture. Reads after "failed to understand the path".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PictureFileError {
    /// Its extension says nothing, or something else.
    #[error("`{path}` says no picture format; let it end in `.png` or `.svg`")]
    Extension {
        /// The path as it was given.
        path: String,
    },
}

/// The formats of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Svg,
}

/// A file for a picture; its extension says the format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFile {
    path: PathBuf,
    format: Format,
}

impl PictureFile {
    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Draws `scene` into the file. Missing folders are made.
    ///
    /// # Errors
    /// A scene that cannot be drawn, or the file system's refusal; then there is no file, or still the old one.
    pub fn write(&self, scene: &Scene) -> Result<(), PictureError> {
        let svg = scene.to_svg();
        match self.format {
            Format::Svg => write_bytes(&self.path, svg.as_bytes())?,
            Format::Png => write_bytes(&self.path, &png(&svg)?)?,
        }
        Ok(())
    }
}

impl FromStr for PictureFile {
    type Err = PictureFileError;

    fn from_str(text: &str) -> Result<Self, PictureFileError> {
        let path = PathBuf::from(text);
        let extension = path
            .extension()
            .map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("png") => Format::Png,
            Some("svg") => Format::Svg,
            _ => {
                return Err(PictureFileError::Extension {
                    path: text.to_owned(),
                });
            }
        };
        Ok(Self { path, format })
    }
}

impl fmt::Display for PictureFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path.display().fmt(f)
    }
}

/// Why there is no picture. Reads after "failed to draw the picture".
#[derive(Debug, Error)]
pub enum PictureError {
    /// The scene cannot be drawn.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_an_unknown_format_is_refused_before_anything_is_computed() {
        assert!("a/b.png".parse::<PictureFile>().is_ok() && "b.SVG".parse::<PictureFile>().is_ok());
        for text in ["b", "b.pdf", ".png", "png", ""] {
            assert!(text.parse::<PictureFile>().is_err(), "{text}");
        }
    }
}
