//! Round numbers on an axis.

/// The steps that a decade is divided by.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];

/// Multiples of a round step (1, 2 or 5 times a power of ten) in [low, high]: the finest that gives at most `most`.
/// Empty where the range is empty or not finite.
pub fn ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) || most == 0 {
        return Vec::new();
    }
    let decade = (span / most as f64).log10().floor() as i32;
    // Rounding must not lose a tick at the very end.
    let slack = 1e-9 * span;
    for power in decade..decade + 4 {
        for step in STEPS {
            let step = step * 10f64.powi(power);
            let first = ((low - slack) / step).ceil();
            let last = ((high + slack) / step).floor();
            if last - first < most as f64 {
                let count = (last - first) as usize;
                return (0..=count)
                    .map(|k| (first + k as f64) * step)
                    // −0 would be printed as such.
                    .map(|tick| if tick == 0.0 { 0.0 } else { tick })
                    .collect();
            }
        }
    }
    Vec::new()
}

/// The ticks as text: as many decimals as the step between them needs, with a true minus sign.
pub fn labels(ticks: &[f64]) -> Vec<String> {
    let step = match ticks {
        [a, b, ..] => b - a,
        [a] => a.abs().max(1e-300),
        [] => return Vec::new(),
    };
    let largest = ticks.iter().fold(0.0_f64, |a, t| a.max(t.abs()));
    if !(1e-4..1e6).contains(&largest.max(step)) {
        return ticks.iter().map(|t| minus(&format!("{t:.1e}"))).collect();
    }
    let decimals = (-(step * 1.000_001).log10().floor()).clamp(0.0, 9.0) as usize;
    ticks
        .iter()
        .map(|tick| minus(&format!("{tick:.decimals$}")))
        .collect()
}

/// A number with a minus sign that is as wide as a plus.
pub fn minus(number: &str) -> String {
    number.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(
            labels(&ticks(-0.03, 0.47, 6)),
            ["0.0", "0.1", "0.2", "0.3", "0.4"]
        );
        assert_eq!(
            labels(&ticks(0.0, 2.0, 6)),
            ["0.0", "0.5", "1.0", "1.5", "2.0"]
        );
        assert_eq!(
            labels(&ticks(-150.0, 40.0, 5)),
            ["−150", "−100", "−50", "0"]
        );
        assert_eq!(
            labels(&ticks(1.0, 2e7, 3)),
            ["0.0e0", "1.0e7", "2.0e7"][1..]
        );
    }

    #[test]
    fn an_empty_or_broken_range_has_no_ticks_and_no_end() {
        for (low, high) in [
            (1.0, 1.0),
            (2.0, 1.0),
            (f64::NAN, 1.0),
            (0.0, f64::INFINITY),
        ] {
            assert!(ticks(low, high, 5).is_empty());
        }
        assert!(ticks(1e300, 1.1e300, 5).len() <= 5);
        assert!(ticks(1.0, 1.0 + 1e-15, 5).len() <= 5);
    }
}
