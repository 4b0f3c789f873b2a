//! From Gauss point values to the global residual and its exact linearisation.
//!
//! All loops run over elements and Gauss points in ascending order: the sums are the same bits
//! whatever order the constitutive answers arrived in.

mod configuration;
mod pattern;
mod residual;
mod tangent;

pub use configuration::{Configuration, Start};
pub use pattern::Pattern;
pub use residual::{ElementShare, Residual, element_shares, internal_forces, residual};
pub use tangent::{LinearSystem, element_tangent, tangent};
