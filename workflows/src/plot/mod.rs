//! Pictures: a scene of shapes and labels, written as SVG, or as PNG drawn from the very same SVG.
//!
//! Nothing here knows what is drawn. [`Scene`] takes shapes in picture coordinates, [`Axes`] maps numbers to them and
//! draws ticks and curves, [`palette`] has the colours. Fonts are built in: a picture looks the same on every machine.

mod axes;
pub mod colourmap;
mod file;
mod label;
pub mod palette;
mod raster;
mod scene;
mod ticks;

pub use self::axes::{Axes, Curve, Range, Secondary};
pub use self::file::{PictureError, PictureFile, PictureFileError};
pub use self::palette::Colour;
pub use self::raster::RasterError;
pub use self::scene::{Anchor, Paint, Scene, Text};
pub use self::ticks::{labels, minus, ticks};
