//! Derived quantities for output: strains, nodal averages, boundary resultants.

mod gradient;
mod nodal;
mod spread;
mod strain;

pub use gradient::gradient_at_nodes;
pub use nodal::{boundary_force, boundary_mean_displacement, nodal_average};
pub use spread::{Spread, spread};
pub use strain::{
    deformation_gradients, green_lagrange, logarithmic, second_invariant, volumetric,
};
