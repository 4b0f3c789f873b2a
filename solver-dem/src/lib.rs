//! The discrete-element side of femdem-flow: periodic assemblies of grains (REVs), brought to
//! equilibrium under a prescribed deformation, and homogenised to a Cauchy stress and a tangent.
//!
//! The face of the crate is [`Rev`], a state that serialises exactly, and pure functions of it:
//!
//! - [`respond`]: `(base, start, F) → state, stress, tangent, report`, what a Gauss point asks for;
//! - [`drive`]: the same under mixed stress/strain control, for element tests;
//! - [`prepare()`]: a packing from its recipe and seed;
//! - [`anatomy()`]: what every contact and grain of a state carries.
//!
//! Conventions: tension positive for stresses and strains, repulsion positive for contact forces,
//! the columns of the cell matrix are the cell vectors, a step deforms the cell by `H ← F·H`.
//! Lengths, forces and stresses are in the user's own consistent units; the thickness is 1 in 2D.
//!
//! This crate knows no files, no threads and no finite elements.

// Results must not depend on the system's mathematics; see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod anatomy;
pub mod cell;
pub mod contact;
mod drive;
mod dynamics;
pub mod exchange;
pub mod homogenise;
pub mod measure;
mod neighbours;
mod network;
mod onward;
pub mod prepare;
mod relax;
mod respond;
mod response;
pub mod rev;
pub mod settings;
mod simd;
pub mod tensor;
pub mod wire;

pub use anatomy::{Anatomy, anatomy};
pub use cell::Cell;
pub use contact::ContactLaw;
pub use drive::{Component, Control, drive};
pub use prepare::{
    AnisotropicStress, Fraction, Means, PreparationError, Quality, Quantity, Recipe, Sizes,
    SizesError, Target, prepare, settle,
};
pub use respond::respond;
pub use response::{EquilibriumError, Method, Report, Response, Start, Started, Trust};
pub use rev::{Contact, Grains, Rev, RevState};
pub use settings::{LossOfConfinement, Settings, Tangents, Unsettled};
