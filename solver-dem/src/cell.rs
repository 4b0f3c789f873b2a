//! The periodic cell.

use serde::{Deserialize, Serialize};

use crate::tensor::{Tensor2, Vector, apply, invert, product};

/// A periodic cell; the columns of `h` are the cell vectors: x = H·s with s ∈ [0,1)^D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell<const D: usize> {
    /// `h[a][b]` is the component `a` of the cell vector `b`, in length units.
    pub h: Tensor2<D>,
}

impl<const D: usize> Cell<D> {
    /// A cell with edges of the given lengths along the axes.
    pub fn rectangular(lengths: Vector<D>) -> Self {
        let mut h = [[0.0; D]; D];
        for i in 0..D {
            h[i][i] = lengths[i];
        }
        Self { h }
    }

    /// H ← F·H.
    pub fn deformed(&self, f: &Tensor2<D>) -> Self {
        Self {
            h: product(f, &self.h),
        }
    }

    /// det H: the area in 2D (per unit thickness), the volume in 3D. Positive for a valid cell.
    pub fn volume(&self) -> f64 {
        invert(&self.h).0
    }

    /// H⁻¹, or `None` when the cell is degenerate.
    pub fn inverse(&self) -> Option<Tensor2<D>> {
        invert(&self.h).1
    }

    /// The smallest distance between two opposite faces, V/|face|: it bounds the range in which
    /// the nearest image is unique. From 1/height_b = |row b of H⁻¹|.
    pub fn smallest_height(&self) -> f64 {
        self.heights().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The distances between opposite faces; 0 for a degenerate cell.
    pub fn heights(&self) -> Vector<D> {
        let Some(inverse) = self.inverse() else {
            return [0.0; D];
        };
        inverse.map(|row| 1.0 / row.iter().map(|c| c * c).sum::<f64>().sqrt())
    }

    /// H·k: the translation that belongs to whole numbers of cell vectors.
    #[inline]
    pub fn translation(&self, k: &Vector<D>) -> Vector<D> {
        apply(&self.h, k)
    }

    /// The same lattice described by shorter vectors: a cell vector is replaced by its sum or
    /// difference with another as long as that shortens it (Gauss reduction in 2D). Nothing
    /// physical changes: the set of images of every grain is the same.
    pub fn reduced(&self) -> Self {
        let mut h = self.h;
        let dot =
            |h: &Tensor2<D>, a: usize, b: usize| (0..D).map(|i| h[i][a] * h[i][b]).sum::<f64>();
        // Each pass shortens a vector; 64 passes reduce any cell that a simulation can reach.
        for _ in 0..64 {
            let mut changed = false;
            for a in 0..D {
                for b in 0..D {
                    if a == b {
                        continue;
                    }
                    let k = (dot(&h, a, b) / dot(&h, b, b)).round();
                    // Hysteresis: an exact 45° cell must not flip back and forth.
                    if k != 0.0 && (dot(&h, a, b) / dot(&h, b, b)).abs() > 0.5 + 1e-9 {
                        for i in 0..D {
                            h[i][a] -= k * h[i][b];
                        }
                        changed = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        Self { h }
    }
}

impl<const D: usize> Serialize for Cell<D> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let flat: Vec<f64> = self.h.iter().flatten().copied().collect();
        flat.serialize(serializer)
    }
}

impl<'de, const D: usize> Deserialize<'de> for Cell<D> {
    fn deserialize<De: serde::Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        let flat = Vec::<f64>::deserialize(deserializer)?;
        if flat.len() != D * D {
            return Err(serde::de::Error::invalid_length(
                flat.len(),
                &"D×D cell components",
            ));
        }
        let mut h = [[0.0; D]; D];
        for (k, value) in flat.into_iter().enumerate() {
            h[k / D][k % D] = value;
        }
        Ok(Self { h })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduction_keeps_the_lattice_of_a_strongly_sheared_cell() {
        let cell = Cell {
            h: [[10.0, 23.7], [0.0, 9.0]],
        };
        let reduced = cell.reduced();
        assert!((reduced.volume() - cell.volume()).abs() < 1e-12);
        assert!(reduced.smallest_height() > cell.smallest_height());
        // Each new vector is a whole combination of the old ones.
        let old = cell.inverse().unwrap();
        let whole = product(&old, &reduced.h);
        for component in whole.iter().flatten() {
            assert!((component - component.round()).abs() < 1e-12);
        }
    }
}
