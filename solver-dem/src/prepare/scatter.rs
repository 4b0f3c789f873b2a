//! Random grains that do not touch.

use rand_core::Rng;
use rand_pcg::Pcg64;

use crate::{Cell, Grains, tensor::Vector};

/// Solid fraction that is tried first. Where it does not come to lie the cell grows, so that narrow gradings start
/// looser. It decides how loose a packing with friction becomes, as grains that meet early build arches early:
/// e = 0.256, 0.244, 0.230, 0.228 from 0.45, 0.6, 0.65, 0.75 (docs/packings.md).
const SOLID_FRACTION: f64 = 0.75;
/// Draws for one grain before the cell grows.
const DRAWS: usize = 20_000;
/// How much.
const GROWTH: f64 = 1.02;

/// Random sequential placement without overlap, largest grains first, in a rectangular cell whose sides have the
/// ratio `aspect_ratio` = Lx/Ly.
pub(super) fn scatter(
    grains: &Grains,
    aspect_ratio: f64,
    rng: &mut Pcg64,
) -> (Cell<2>, Vec<Vector<2>>) {
    let side = (grains.solid_volume::<2>() / SOLID_FRACTION).sqrt();
    let stretch = aspect_ratio.sqrt();
    let mut sides = [side * stretch, side / stretch];
    loop {
        if let Some(positions) = place(grains, &sides, rng) {
            return (Cell::rectangular(sides), positions);
        }
        sides = sides.map(|side| GROWTH * side);
    }
}

fn place(grains: &Grains, sides: &Vector<2>, rng: &mut Pcg64) -> Option<Vec<Vector<2>>> {
    let mut placed: Vec<Vector<2>> = Vec::with_capacity(grains.radii.len());
    for (grain, radius) in grains.radii.iter().enumerate() {
        let free = |x: &Vector<2>| {
            placed.iter().zip(&grains.radii[..grain]).all(|(y, other)| {
                let d2: f64 = (0..2)
                    .map(|k| {
                        let d = x[k] - y[k];
                        d - sides[k] * (d / sides[k]).round()
                    })
                    .map(|d| d * d)
                    .sum();
                d2 > (radius + other) * (radius + other)
            })
        };
        let position = (0..DRAWS)
            .map(|_| sides.map(|side| side * uniform(rng)))
            .find(free)?;
        placed.push(position);
    }
    Some(placed)
}

/// Uniform in [0, 1) from the 53 high bits of a draw.
fn uniform(rng: &mut Pcg64) -> f64 {
    const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
    (rng.next_u64() >> 11) as f64 * UNIT
}
