//! What the equations are written for.

/// A trial configuration with the stresses that were found there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Configuration<'a> {
    /// Positions of the nodes and, where the problem has them, v and λ, in the order of its
    /// [`Layout`](crate::layout::Layout).
    pub unknowns: &'a [f64],
    /// Cauchy stress of every Gauss point, D×D each.
    pub stress: &'a [f64],
    /// Load values.
    pub loads: &'a [f64],
    /// Where the step began. A plain problem does not read it.
    pub start: Start<'a>,
}

/// The beginning of a step, as far as second gradient remembers it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Start<'a> {
    /// Positions of the nodes.
    pub coordinates: &'a [f64],
    /// χ of every Gauss point, D³ each.
    pub double_stress: &'a [f64],
}

impl<'a> Configuration<'a> {
    /// Of a problem without second gradient.
    pub fn plain(coordinates: &'a [f64], stress: &'a [f64], loads: &'a [f64]) -> Self {
        Configuration {
            unknowns: coordinates,
            stress,
            loads,
            start: Start::default(),
        }
    }
}
