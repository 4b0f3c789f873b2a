//! Denser by cycles of shear or compression.

use super::{
    Batch, PreparationError, Prepared, Target,
    recipe::isotropic,
    settle::{sheared, under_pressure},
    target::Means,
};
use crate::Rev;

/// Cycles after which a target is given up.
const CYCLES: u32 = 100;
/// Part of the wished amplitude below which cycles move nothing any more.
const SMALLEST_SCALE: f64 = 1e-3;

/// Cycles of the packing with its preparation friction until it has what `target` asks for. Where a cycle leads past the
/// target, it is taken back and done again by halves: half the amplitude, and half the way from the preparation friction to
/// that of the cycles, since letting friction go is by itself enough to make a loose packing collapse.
pub(super) fn by_cycles(
    target: &Target,
    friction: f64,
    batch: &Batch<'_>,
) -> Result<Prepared, PreparationError> {
    let recipe = batch.recipe;
    let (start, compressed) = batch.compressed(recipe.preparation_friction)?;
    let mut now = start.clone();
    let mut best = batch.finished(&start)?;
    let from = target.of(&best);
    let mut cycles = compressed + best.quality.cycles;
    if target.looseness(&best) < -1.0 {
        return Err(PreparationError::OutOfReach {
            quantity: target.quantity,
            wanted: target.value,
            means: format!(
                "cycles only densify, and the packing with preparation friction {} is denser already;",
                recipe.preparation_friction
            ),
            from,
            to: from,
        });
    }
    let (mut scale, mut done, mut tried) = (1.0, 0, 0);
    while target.looseness(&best).abs() > 1.0 {
        if tried == CYCLES || scale < SMALLEST_SCALE {
            return Err(if scale < SMALLEST_SCALE {
                target.missed(tried, &best)
            } else {
                PreparationError::OutOfReach {
                    quantity: target.quantity,
                    wanted: target.value,
                    means: format!("by {CYCLES} cycles at friction {friction}"),
                    from,
                    to: target.of(&best),
                }
            });
        }
        tried += 1;
        now.law.friction =
            recipe.preparation_friction + scale * (friction - recipe.preparation_friction);
        let (next, relaxed) = cycle(target, scale, &now, recipe.confining_stress)?;
        let finished = batch.finished(&next)?;
        cycles += relaxed + finished.quality.cycles;
        if target.looseness(&finished) < -1.0 {
            scale *= 0.5;
            continue;
        }
        done += 1;
        scale = (2.0 * scale).min(1.0);
        now = next;
        best = finished;
    }
    best.quality.cycles = cycles;
    best.quality.densifying_cycles = done;
    best.quality.preparation_friction = Some(recipe.preparation_friction);
    Ok(best)
}

/// One cycle with `scale` times the wished amplitude: the REV after it, and the cycles of integration it took.
fn cycle(
    target: &Target,
    scale: f64,
    rev: &Rev<2, 1>,
    pressure: f64,
) -> Result<(Rev<2, 1>, u32), PreparationError> {
    let mut now = rev.clone();
    let mut cycles = 0;
    match target.by {
        Means::ShearCycles { amplitude, .. } => {
            let gamma = scale * amplitude;
            for shear in [gamma, -2.0 * gamma, gamma] {
                let (next, relaxed) = sheared(&now, pressure, shear, "a cycle of shear")?;
                now = next;
                cycles += relaxed.cycles;
            }
        }
        Means::CompressionCycles { ratio, .. } => {
            let higher = pressure * (1.0 + scale * (ratio - 1.0));
            let (next, relaxed) =
                under_pressure(&now, &isotropic(higher), "a cycle of compression")?;
            now = next;
            cycles += relaxed.cycles;
        }
        Means::Friction => {}
    }
    let (next, relaxed) = under_pressure(&now, &isotropic(pressure), "the end of a cycle")?;
    Ok((next, cycles + relaxed.cycles))
}
