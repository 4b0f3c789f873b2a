//! Median, 95th percentile and maximum.

use serde::Serialize;

/// How a measured quantity is spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the values are below.
    pub median: f64,
    /// 95 % of the values are at most this (nearest rank).
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// The spread of `values`; `None` of none at all.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let max = *sorted.last()?;
        // ⌈p n⌉ values are at most the value of that rank.
        let rank = |part: f64| {
            let rank = (part * sorted.len() as f64).ceil() as usize;
            sorted[rank.clamp(1, sorted.len()) - 1]
        };
        Some(Self {
            median: rank(0.5),
            p95: rank(0.95),
            max,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_solve_moves_the_maximum_and_not_the_median() {
        let mut values: Vec<f64> = (1..=100).map(f64::from).collect();
        values.reverse();
        let spread = Spread::of(&values).unwrap();
        assert_eq!((spread.median, spread.p95, spread.max), (50.0, 95.0, 100.0));
        values[0] = 1e6;
        let spread = Spread::of(&values).unwrap();
        assert_eq!((spread.median, spread.p95, spread.max), (50.0, 95.0, 1e6));
        assert_eq!(Spread::of(&[3.0]).unwrap().p95, 3.0);
        assert_eq!(Spread::of(&[]), None);
    }
}
