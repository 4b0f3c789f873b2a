//! What lines and marks of the packing mean.

use super::{Subject, packing::GRAIN};
use crate::plot::{
    Paint, Scene, Text,
    palette::{BLUE, Colour, GREY, INK, VERMILION, WHITE, YELLOW},
};

/// Height of the letters, and the width of a letter on average.
const SIZE: f64 = 12.0;
const LETTER: f64 = 0.55 * SIZE;
/// Length of the lines that stand for forces.
const SAMPLE: f64 = 26.0;

/// Space on the left of a sample; round ends of lines up to twice as wide lie within it.
const MARGIN: f64 = 6.0;

/// One entry: how wide its sample is, how wide its line (as a multiple of that of a mean force), how it is drawn (from a
/// point on its left, with the width of the line of a mean force), and what is said.
struct Entry {
    width: f64,
    line: f64,
    draw: fn(&mut Scene, [f64; 2], f64),
    text: &'static str,
}

fn bar(scene: &mut Scene, [x, y]: [f64; 2], colour: Colour, width: f64) {
    scene.bar([x, y], [x + SAMPLE, y], colour, width);
}

/// Draws the legend on the line through `at`, only what the picture has; `mean` is the width of the line of a mean force.
pub fn draw(scene: &mut Scene, at: [f64; 2], mean: f64, subject: &Subject) {
    let s = &subject.statistics;
    let entries = [
        (
            s.contacts > 0,
            Entry {
                width: SAMPLE,
                line: 1.0,
                draw: |scene, at, mean| bar(scene, at, BLUE, mean),
                text: "mean force",
            },
        ),
        (
            s.contacts > 0,
            Entry {
                width: SAMPLE,
                line: 3.0,
                draw: |scene, at, mean| bar(scene, at, BLUE, 3.0 * mean),
                text: "3 × mean",
            },
        ),
        (
            s.tensile_fraction > 0.0,
            Entry {
                width: SAMPLE,
                line: 1.0,
                draw: |scene, at, mean| bar(scene, at, VERMILION, mean),
                text: "tension",
            },
        ),
        (
            s.sliding_fraction > 0.0,
            Entry {
                width: 8.0,
                line: 0.0,
                draw: |scene, [x, y], _| {
                    let paint = Paint::fill(YELLOW).outlined(INK, 0.7);
                    scene.circle([x + 4.0, y], 3.6, &paint);
                },
                text: "sliding",
            },
        ),
        (
            s.rattlers > 0,
            Entry {
                width: 14.0,
                line: 0.0,
                draw: |scene, [x, y], _| {
                    let paint = Paint::fill(WHITE).outlined(GREY, 0.9).dashed(2.0, 1.5);
                    scene.circle([x + 7.0, y], 7.0, &paint);
                },
                text: "rattler",
            },
        ),
        (
            true,
            Entry {
                width: 14.0,
                line: 0.0,
                draw: |scene, at, _| {
                    scene.group("sample", 0.45, |scene| {
                        let paint = Paint::fill(GRAIN.0).outlined(GRAIN.1, 0.7);
                        scene.circle([at[0] + 7.0, at[1]], 7.0, &paint);
                    });
                },
                text: "image",
            },
        ),
    ];
    let [mut x, y] = at;
    for (_, entry) in entries.iter().filter(|(shown, _)| *shown) {
        let round_end = (0.5 * entry.line * mean - MARGIN).max(0.0);
        (entry.draw)(scene, [x + MARGIN + round_end, y], mean);
        x += MARGIN + entry.width + 2.0 * round_end + 10.0;
        scene.text([x, y + 0.36 * SIZE], &Text::new(entry.text, SIZE));
        x += LETTER * entry.text.chars().count() as f64 + 12.0;
    }
}
