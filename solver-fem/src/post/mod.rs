//! Derived quantities for output: strains, nodal averages, boundary resultants.

mod nodal;
mod strain;

pub use nodal::{boundary_force, boundary_mean_displacement, nodal_average};
pub use strain::{
    deformation_gradients, green_lagrange, logarithmic, second_invariant, volumetric,
};
