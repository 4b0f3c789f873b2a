//! Random draws: numbers that depend on a seed and a place alone, on no order and no number of threads.

/// Sets the stream of the friction's scatter apart from that of the packings, which have the same seeds.
const FRICTION: u64 = u64::from_be_bytes(*b"friction");

/// A number that depends on the seed and the place alone (SplitMix64, Steele, Lea, Flood 2014).
pub fn draw(seed: u64, place: u64) -> u64 {
    let mut z = seed
        .wrapping_mul(0xd1b5_4a32_d192_ed03)
        .wrapping_add(place.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Friction of the grains of an element:
///
/// μ_e = μ (1 + s ξ_e), ξ_e evenly distributed in (−1, 1), by `seed` and the number of the element alone.
///
/// `scatter` s is ≥ 0 and < 1; the mean of all elements is μ, their standard deviation μ s/√3. Without scatter it is μ to the bit.
pub fn scattered_friction(friction: f64, scatter: f64, seed: u64, element: u64) -> f64 {
    if scatter == 0.0 {
        return friction;
    }
    friction * (1.0 + scatter * even(draw(seed ^ FRICTION, element)))
}

/// The upper 52 bits of a draw as one of as many places in (−1, 1), which lie symmetrically to 0; exact.
fn even(draw: u64) -> f64 {
    let place = (draw >> 12) as f64 + 0.5;
    place * 2.0_f64.powi(-51) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_reach_from_end_to_end_without_touching_them() {
        let step = 2.0_f64.powi(-52);
        assert_eq!(even(0), -1.0 + step);
        assert_eq!(even(u64::MAX), 1.0 - step);
        assert_eq!(even(1 << 63), step);
        assert_eq!(even((1 << 63) - 1), -step);
    }

    /// An even distribution on (−1, 1) has mean 0, variance 1/3 and a tenth of its draws in each tenth.
    #[test]
    fn elements_get_even_and_independent_draws() {
        const COUNT: u64 = 10_000;
        for seed in [0, 1, 2, u64::MAX] {
            let xi: Vec<f64> = (0..COUNT)
                .map(|element| 10.0 * (scattered_friction(1.0, 0.1, seed, element) - 1.0))
                .collect();
            let n = COUNT as f64;
            let mean = xi.iter().sum::<f64>() / n;
            let variance = xi.iter().map(|x| x * x).sum::<f64>() / n;
            let neighbours = xi.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / n;
            // Four standard errors each: 1/√(3n), √(4/45n), 1/(3√n).
            assert!(mean.abs() < 4.0 / (3.0 * n).sqrt(), "{mean}");
            assert!(
                (variance - 1.0 / 3.0).abs() < 4.0 * (4.0 / 45.0 / n).sqrt(),
                "{variance}"
            );
            assert!(neighbours.abs() < 4.0 / (3.0 * n.sqrt()), "{neighbours}");
            let mut tenths = [0_u32; 10];
            for x in &xi {
                assert!(x.abs() < 1.0 + 1e-12);
                tenths[((x + 1.0) * 5.0).clamp(0.0, 9.0) as usize] += 1;
            }
            assert!(
                tenths.iter().all(|count| (880..=1120).contains(count)),
                "{tenths:?}"
            );
        }
    }

    /// Other draws in a later version would continue the runs of an earlier one with other grains.
    #[test]
    fn the_draws_of_stored_runs_stay_what_they_are() {
        let bits = |seed, element| scattered_friction(0.5, 0.05, seed, element).to_bits();
        assert_eq!(
            [bits(1, 0), bits(1, 1), bits(7, 51)],
            [
                4_602_566_617_862_258_866,
                4_602_506_901_039_127_838,
                4_602_593_109_301_196_360
            ]
        );
        assert_eq!(scattered_friction(0.3, 0.0, 1, 0), 0.3);
    }

    #[test]
    fn the_scatter_of_the_friction_and_the_seeds_of_the_packings_are_unrelated() {
        for element in 0..100 {
            assert_ne!(draw(1 ^ FRICTION, element), draw(1, element));
        }
    }
}
