//! Colours that stay apart for every kind of colour vision and in grey: those of Okabe and Ito (2008) for what is told
//! apart by colour, greys for the rest.

/// A colour as SVG writes it.
pub type Colour = &'static str;

/// Paper.
pub const WHITE: Colour = "#ffffff";
/// Text and axes.
pub const INK: Colour = "#1a1a1a";
/// What stands back: ticks, secondary text.
pub const GREY: Colour = "#6b6b6b";
/// Thin lines behind the data.
pub const HAIRLINE: Colour = "#d9d9d9";
/// The first of what is compared; compression.
pub const BLUE: Colour = "#0072b2";
/// The second; tension.
pub const VERMILION: Colour = "#d55e00";
/// The third.
pub const GREEN: Colour = "#009e73";
/// What is picked out: sliding contacts.
pub const YELLOW: Colour = "#f0e442";
/// The fourth.
pub const PURPLE: Colour = "#cc79a7";
/// The fifth.
pub const ORANGE: Colour = "#e69f00";
/// The sixth.
pub const SKY: Colour = "#56b4e9";
