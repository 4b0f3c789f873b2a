//! Grain-size distributions.
//!
//! Sizes are quantiles of the distribution at (k + ½)/N, not random draws: the grading is met as closely as N grains
//! can, the same for every seed, and only the places of the grains are random.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The largest Rmax/Rmin: beyond it the neighbour lists of large grains hold most of the packing.
pub const LARGEST_RATIO: f64 = 20.0;

/// The distribution of grain diameters. Only ratios count: lengths come out with the mean diameter (by number) a = 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sizes {
    /// Every diameter between the smallest and the largest is equally frequent (by number).
    Uniform {
        /// Rmax/Rmin, in [1, 20].
        ratio: f64,
    },
    /// ln(d/median) is normally distributed (by number), cut off on both sides.
    LogNormal {
        /// Standard deviation of ln d before the cut, ≥ 1e-3.
        deviation: f64,
        /// Smallest diameter over the median, in (0, 1).
        smallest: f64,
        /// Largest diameter over the median, > 1.
        largest: f64,
    },
    /// A grading curve, linear between its points.
    Table {
        /// What the fractions count.
        by: Fraction,
        /// (diameter in any unit, fraction of what is not larger), from fraction 0 to 1.
        curve: Vec<[f64; 2]>,
    },
}

/// What the fractions of a grading curve count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fraction {
    /// Grains.
    Number,
    /// Their area: the mass per unit thickness, as a sieve test gives it.
    #[default]
    Area,
}

/// Below it all grains are the same to any purpose.
const SMALLEST_DEVIATION: f64 = 1e-3;

/// Why a distribution has no meaning.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SizesError {
    /// Rmax/Rmin is out of range.
    #[error("the largest over the smallest grain is {ratio}, it must be in [1, 20]")]
    Ratio {
        /// Rmax/Rmin.
        ratio: f64,
    },
    /// The deviation is too small or no number.
    #[error("the deviation is {0}, it must be a number from {SMALLEST_DEVIATION}")]
    Deviation(f64),
    /// The cut-offs do not enclose the median.
    #[error(
        "the cut-offs {smallest} and {largest} must lie below and above the median, which is 1"
    )]
    CutOffs {
        /// The lower one.
        smallest: f64,
        /// The upper one.
        largest: f64,
    },
    /// A curve needs two points.
    #[error("a grading curve needs at least two points, this one has {0}")]
    TooFewPoints(usize),
    /// A point of the curve cannot be.
    #[error("point {row} of the grading curve, counted from 0: {problem}")]
    Point {
        /// Its number from 0.
        row: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl Default for Sizes {
    fn default() -> Self {
        Self::Uniform { ratio: 2.5 }
    }
}

impl Sizes {
    /// Whether the distribution has a meaning.
    ///
    /// # Errors
    /// [`SizesError`] says what is wrong.
    pub fn check(&self) -> Result<(), SizesError> {
        match self {
            Self::Uniform { .. } => {}
            Self::LogNormal {
                deviation,
                smallest,
                largest,
            } => {
                // Below, ln d over the deviation overflows.
                if !(SMALLEST_DEVIATION..f64::INFINITY).contains(deviation) {
                    return Err(SizesError::Deviation(*deviation));
                }
                if !(*smallest > 0.0 && *smallest < 1.0 && *largest > 1.0) {
                    let (smallest, largest) = (*smallest, *largest);
                    return Err(SizesError::CutOffs { smallest, largest });
                }
            }
            Self::Table { curve, .. } => check_curve(curve)?,
        }
        let ratio = self.ratio();
        // Written so that a NaN is out of range.
        if (1.0..=LARGEST_RATIO).contains(&ratio) {
            Ok(())
        } else {
            Err(SizesError::Ratio { ratio })
        }
    }

    /// Rmax/Rmin of the distribution.
    pub fn ratio(&self) -> f64 {
        match self {
            Self::Uniform { ratio } => *ratio,
            Self::LogNormal {
                smallest, largest, ..
            } => largest / smallest,
            Self::Table { curve, .. } => match (curve.first(), curve.last()) {
                (Some([first, _]), Some([last, _])) => last / first,
                _ => f64::NAN,
            },
        }
    }

    /// `count` radii of mean ½, largest first. The distribution must have passed [`Self::check`].
    pub(super) fn radii(&self, count: u32) -> Vec<f64> {
        let n = f64::from(count);
        let parts = (0..count).map(|k| (f64::from(k) + 0.5) / n);
        let mut radii: Vec<f64> = match self {
            Self::Uniform { ratio } => {
                let smallest = 1.0 / (1.0 + ratio);
                let largest = ratio * smallest;
                return parts
                    .map(|part| largest - (largest - smallest) * part)
                    .collect();
            }
            Self::LogNormal {
                deviation,
                smallest,
                largest,
            } => {
                let bounds = [smallest, largest].map(|d| libm::log(*d) / deviation);
                parts
                    .map(|part| libm::exp(deviation * normal_quantile(bounds, 1.0 - part)))
                    .collect()
            }
            Self::Table { by, curve } => {
                let by_number = cumulative_number(*by, curve);
                parts
                    .map(|part| curve_quantile(*by, curve, &by_number, 1.0 - part))
                    .collect()
            }
        };
        let mean = radii.iter().sum::<f64>() / n;
        for radius in &mut radii {
            *radius *= 0.5 / mean;
        }
        radii
    }
}

fn check_curve(curve: &[[f64; 2]]) -> Result<(), SizesError> {
    if curve.len() < 2 {
        return Err(SizesError::TooFewPoints(curve.len()));
    }
    let problem = |row: usize| {
        let [size, fraction] = curve[row];
        let first_or_last = row == 0 || row + 1 == curve.len();
        // Squares of sizes and their inverses are taken.
        if !(1e-60..1e60).contains(&size) {
            Some("the size must be a positive number, from 1e-60 to 1e60")
        } else if !(0.0..=1.0).contains(&fraction) {
            Some("the fraction must be in [0, 1]")
        } else if row == 0 && fraction != 0.0 {
            Some("the curve must begin with fraction 0: no grain is smaller than the smallest")
        } else if first_or_last && row > 0 && fraction != 1.0 {
            Some("the curve must end with fraction 1: no grain is larger than the largest")
        } else if row > 0 && (size < curve[row - 1][0] || fraction < curve[row - 1][1]) {
            Some("sizes and fractions must not decrease")
        } else {
            None
        }
    };
    match (0..curve.len()).find_map(|row| Some((row, problem(row)?))) {
        Some((row, problem)) => Err(SizesError::Point { row, problem }),
        None => Ok(()),
    }
}

/// The standard normal variable below which lies the part `part` of what is between `bounds`, by bisection of
/// Φ(x) = ½(1 + erf(x/√2)).
fn normal_quantile(bounds: [f64; 2], part: f64) -> f64 {
    let below = |x: f64| 0.5 * (1.0 + libm::erf(x * std::f64::consts::FRAC_1_SQRT_2));
    let [low, high] = bounds.map(below);
    let wanted = low + part * (high - low);
    let [mut low, mut high] = bounds;
    // Each halving gains a bit, and a double has 53.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The numbers of grains up to each point of a curve, not normalised. Between two points of a curve by area the
/// density of the area is constant, so that of the number goes with 1/d², and ∫ dd/d² = 1/d₀ − 1/d₁.
fn cumulative_number(by: Fraction, curve: &[[f64; 2]]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![0.0];
    for pair in curve.windows(2) {
        let ([d0, c0], [d1, c1]) = (pair[0], pair[1]);
        sum += match by {
            Fraction::Number => c1 - c0,
            Fraction::Area => (c1 - c0) / (d0 * d1),
        };
        sums.push(sum);
    }
    sums
}

/// The diameter below which lies the part `part` of the number of grains.
fn curve_quantile(by: Fraction, curve: &[[f64; 2]], by_number: &[f64], part: f64) -> f64 {
    let wanted = part * by_number.last().copied().unwrap_or(0.0);
    let last = curve.len() - 2;
    let k = (0..last)
        .find(|&k| by_number[k + 1] >= wanted)
        .unwrap_or(last);
    let (d0, d1) = (curve[k][0], curve[k + 1][0]);
    let share = (wanted - by_number[k]) / (by_number[k + 1] - by_number[k]);
    // A segment without grains: the next one begins where it ends.
    let share = if share.is_finite() { share } else { 1.0 };
    match by {
        Fraction::Number => d0 + share * (d1 - d0),
        Fraction::Area => 1.0 / (1.0 / d0 + share * (1.0 / d1 - 1.0 / d0)),
    }
}
