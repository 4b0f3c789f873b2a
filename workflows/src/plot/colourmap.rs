//! Colours for numbers: tables from the lowest to the highest.

use super::palette::Colour;

/// Light to dark, in steps that the eye takes for equal, in grey, too: `inferno` of van der Walt and Smith (CC0), turned
/// round and cut short of black.
pub const SEQUENTIAL: [Colour; 64] = [
    "#fcffa4", "#f8fb9a", "#f3f68a", "#f1f179", "#f2ea69", "#f3e35a", "#f5db4c", "#f7d340",
    "#f9cb35", "#fac42a", "#fbbc21", "#fcb418", "#fcac11", "#fca50a", "#fb9d07", "#fb9606",
    "#f98e09", "#f8870e", "#f78212", "#f57b17", "#f2741c", "#ef6e21", "#ec6726", "#e9612b",
    "#e55c30", "#e15635", "#dd513a", "#d84c3e", "#d34743", "#ce4347", "#c83f4b", "#c33b4f",
    "#bd3853", "#b73557", "#b1325a", "#ad305d", "#a62d60", "#a02a63", "#9a2865", "#932667",
    "#8d2369", "#87216b", "#801f6c", "#7a1d6d", "#741a6e", "#6d186e", "#67166e", "#61136e",
    "#5a116e", "#540f6d", "#4d0d6c", "#470b6a", "#420a68", "#3b0964", "#340a5f", "#2d0b59",
    "#260c51", "#1f0c48", "#190c3e", "#140b34", "#0e092b", "#0a0722", "#060419", "#030210",
];

/// Blue over white to vermilion, for numbers whose sign matters; the middle is zero.
pub const DIVERGING: [Colour; 64] = [
    "#004468", "#00486f", "#004c76", "#00517c", "#005583", "#00598a", "#005e91", "#006299",
    "#0067a0", "#006ba7", "#0070ae", "#1876b4", "#2f7db9", "#4085bd", "#4e8dc2", "#5a95c7",
    "#669dcb", "#72a5d0", "#7caed4", "#87b6d9", "#92bedd", "#9cc7e2", "#a5cbe4", "#aed0e5",
    "#b7d5e7", "#c0d9e9", "#c9deeb", "#d1e2ec", "#dae7ee", "#e2ebf0", "#eaf0f1", "#f3f5f3",
    "#f7f4ef", "#f7ede4", "#f7e7da", "#f7e0d0", "#f7dac6", "#f6d4bc", "#f5cdb2", "#f4c7a8",
    "#f3c19e", "#f2ba94", "#f0b48a", "#efac7e", "#eda473", "#eb9c67", "#e9945c", "#e68c50",
    "#e48344", "#e17b38", "#de732c", "#da6b1e", "#d7620c", "#d05c00", "#c75700", "#bf5200",
    "#b64d00", "#ad4901", "#a44401", "#9c4001", "#933b01", "#8b3701", "#823201", "#7a2e00",
];

/// The colour at `part` of the way from the lowest number (0) to the highest (1); beyond it stays that of the end.
pub fn colour(table: &'static [Colour; 64], part: f64) -> Colour {
    table[level(part)]
}

/// The place in a table of 64 colours.
pub fn level(part: f64) -> usize {
    // A NaN is no number to colour; it comes out as the lowest, and callers leave it out before.
    (part.clamp(0.0, 1.0) * 64.0).min(63.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_and_what_lies_beyond_have_the_colours_of_the_ends() {
        for (part, expected) in [
            (-1.0, 0),
            (0.0, 0),
            (0.999, 63),
            (1.0, 63),
            (7.0, 63),
            (0.5, 32),
        ] {
            assert_eq!(level(part), expected, "{part}");
        }
    }

    /// A map that is not monotonous in lightness shows edges that are not in the field.
    #[test]
    fn light_turns_dark_without_a_step_back() {
        let luma = |colour: Colour| -> f64 {
            let channel = |k: usize| f64::from(u8::from_str_radix(&colour[k..k + 2], 16).unwrap());
            0.299 * channel(1) + 0.587 * channel(3) + 0.114 * channel(5)
        };
        for pair in SEQUENTIAL.windows(2) {
            assert!(luma(pair[1]) < luma(pair[0]), "{pair:?}");
        }
        for pair in DIVERGING[..31].windows(2) {
            assert!(luma(pair[1]) > luma(pair[0]), "{pair:?}");
        }
        for pair in DIVERGING[33..].windows(2) {
            assert!(luma(pair[1]) < luma(pair[0]), "{pair:?}");
        }
    }
}
