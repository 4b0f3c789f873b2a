//! How wide a localisation band becomes: the modulus D of the second gradient against the softening of the material.
//!
//! For a bilinear law (modulus E, softening slope −H) the band in a bar has the exact width
//! w = 2 (π − arctan √(H/E)) √(D/H). E and H are measured on the curve of a biaxial element test, axial stress over
//! axial strain: E between the first two points, H by least squares from the peak to where half of the fall is done. A band
//! in a plane is inclined, and a material of grains is no bilinear law: the width is an estimate, good enough to choose
//! D or the elements by.

use std::f64::consts::PI;

use serde::Serialize;

use crate::input::problem::{Amount, Control, ElementTest};

/// Part of the rise to the peak by which the stress must fall again to count as softening.
const LEAST_FALL: f64 = 0.05;

/// Softening as measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Softening {
    /// E: slope at the beginning; stress.
    pub stiffness: f64,
    /// H: slope of the fall, positive; stress.
    pub slope: f64,
    /// Axial strains, positive in compression, between which H was measured; the first is that of the peak.
    pub strains: [f64; 2],
}

/// There is nothing to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoSoftening {
    /// The test is of another kind.
    #[error(
        "the internal length is measured in a biaxial test: stress xx constant, strain yy along a load, no shear"
    )]
    OtherTest,
    /// The curve has no peak, or hardly falls after it.
    #[error(
        "the axial stress does not fall by 5 % of its rise after the peak; load further, in smaller steps"
    )]
    NoPeak,
}

/// Whether the test loads one axis at constant stress of the other.
///
/// # Errors
/// Another test.
pub fn check(test: &ElementTest) -> Result<(), NoSoftening> {
    let lateral = matches!(test.xx, Control::Stress(Amount::Constant(_)));
    let axial = matches!(test.yy, Control::Strain(Amount::Load(_)));
    let shear = matches!(test.xy, Control::Strain(Amount::Constant(_)));
    if lateral && axial && shear {
        Ok(())
    } else {
        Err(NoSoftening::OtherTest)
    }
}

impl Softening {
    /// From points (axial strain, axial stress), both positive in compression.
    ///
    /// # Errors
    /// No peak with a fall after it.
    pub fn measure(curve: &[[f64; 2]]) -> Result<Self, NoSoftening> {
        let highest = (0..curve.len()).max_by(|&a, &b| curve[a][1].total_cmp(&curve[b][1]));
        let peak = highest
            .filter(|&peak| peak > 0)
            .ok_or(NoSoftening::NoPeak)?;
        let after = &curve[peak..];
        let lowest = after
            .iter()
            .map(|point| point[1])
            .fold(f64::INFINITY, f64::min);
        let (rise, fall) = (curve[peak][1] - curve[0][1], curve[peak][1] - lowest);
        // An infinite stress gives no number here.
        if fall.is_nan() || fall < LEAST_FALL * rise {
            return Err(NoSoftening::NoPeak);
        }
        let half = curve[peak][1] - 0.5 * fall;
        let end = after.iter().position(|point| point[1] <= half);
        let falling = &after[..=end.ok_or(NoSoftening::NoPeak)?];
        let slope = -regression(falling);
        let first = regression(&curve[..2]);
        let falls = slope > 0.0 && first > 0.0;
        falls.then_some(()).ok_or(NoSoftening::NoPeak)?;
        Ok(Self {
            stiffness: first,
            slope,
            strains: [falling[0][0], falling[falling.len() - 1][0]],
        })
    }

    /// w of the modulus D.
    pub fn width(&self, modulus: f64) -> f64 {
        2.0 * self.phase() * (modulus / self.slope).sqrt()
    }

    /// D of the width w.
    pub fn modulus(&self, width: f64) -> f64 {
        let ratio = width / (2.0 * self.phase());
        self.slope * ratio * ratio
    }

    fn phase(&self) -> f64 {
        PI - (self.slope / self.stiffness).sqrt().atan()
    }
}

/// Slope of the line with the least squares of deviations.
fn regression(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let products = |k: usize, origin: f64| {
        let terms = points
            .iter()
            .map(|point| (point[0] - x) * (point[k] - origin));
        terms.sum::<f64>()
    };
    products(1, y) / products(0, x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_curve_gives_its_own_slopes_and_the_known_width() {
        let stress = |e: f64| {
            if e <= 1.0 {
                2.0 + e
            } else {
                3.0 - 0.1 * (e - 1.0)
            }
        };
        let curve: Vec<[f64; 2]> = (0..=60)
            .map(|k| 0.05 * f64::from(k))
            .map(|e| [e, stress(e)])
            .collect();
        let found = Softening::measure(&curve).expect("it softens");
        assert!((found.stiffness - 1.0).abs() < 1e-12 && (found.slope - 0.1).abs() < 1e-12);
        assert!((found.strains[0] - 1.0).abs() < 1e-12 && (found.strains[1] - 2.0).abs() < 0.06);
        // physics: E = 1, H = 0.1, D = 1e-3 give 0.56706.
        assert!((found.width(1e-3) - 0.56706).abs() < 1e-5);
        assert!((found.modulus(found.width(1e-3)) - 1e-3).abs() < 1e-15);
    }

    #[test]
    fn a_curve_that_only_rises_has_no_band() {
        let rising: Vec<[f64; 2]> = (0..9)
            .map(|k| [f64::from(k), f64::from(k).sqrt()])
            .collect();
        assert_eq!(Softening::measure(&rising), Err(NoSoftening::NoPeak));
        assert_eq!(Softening::measure(&[]), Err(NoSoftening::NoPeak));
        let mut barely = rising;
        barely.push([9.0, 8.0_f64.sqrt() - 0.05]);
        assert_eq!(Softening::measure(&barely), Err(NoSoftening::NoPeak));
    }
}
