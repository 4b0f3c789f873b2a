//! PNG from SVG, with the fonts that are built in.

use std::sync::Arc;

use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};
use thiserror::Error;

/// Latin, Greek and mathematical characters of DejaVu Sans; its licence lies beside it.
const FONTS: [&[u8]; 2] = [
    include_bytes!("fonts/DejaVuSans.ttf"),
    include_bytes!("fonts/DejaVuSans-Oblique.ttf"),
];

/// Pixels per unit of a scene: 216 dots per inch.
pub const PIXELS_PER_UNIT: f32 = 2.25;

/// Why a scene could not be drawn. Reads after "failed to draw the picture".
#[derive(Debug, Error)]
pub enum RasterError {
    /// The scene is no valid SVG.
    #[error("the scene cannot be read: {0}")]
    Scene(#[from] resvg::usvg::Error),
    /// There is no room for its pixels.
    #[error("{width} × {height} pixels are none or too many")]
    Size {
        /// Pixels along x.
        width: u32,
        /// Pixels along y.
        height: u32,
    },
    /// The encoder refused.
    #[error("PNG: {0}")]
    Encode(String),
}

/// The SVG as a PNG file.
///
/// # Errors
/// A document that is no SVG, or one too large to draw.
pub fn png(svg: &str) -> Result<Vec<u8>, RasterError> {
    let mut fonts = Database::new();
    for font in FONTS {
        fonts.load_font_data(font.to_vec());
    }
    fonts.set_sans_serif_family("DejaVu Sans");
    let options = Options {
        fontdb: Arc::new(fonts),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options)?;
    let pixels = |length: f32| (length * PIXELS_PER_UNIT).ceil() as u32;
    let (width, height) = (pixels(tree.size().width()), pixels(tree.size().height()));
    let mut pixmap = Pixmap::new(width, height).ok_or(RasterError::Size { width, height })?;
    let scale = Transform::from_scale(PIXELS_PER_UNIT, PIXELS_PER_UNIT);
    resvg::render(&tree, scale, &mut pixmap.as_mut());
    pixmap
        .encode_png()
        .map_err(|error| RasterError::Encode(error.to_string()))
}
