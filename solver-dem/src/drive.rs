//! A REV under mixed stress and strain control: the element test.

use serde::{Deserialize, Serialize};

use crate::{
    Rev,
    respond::{Asked, check, follow_path, map_or_follow},
    response::{EquilibriumError, Method, Response},
    settings::Settings,
    tensor::{Tensor2, invert, product},
};

/// What is imposed on one component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// The component of the total F (1 on the diagonal means no stretch).
    Gradient(f64),
    /// The Cauchy stress, tension positive; the component of F follows.
    Stress(f64),
}

/// What is imposed on a REV, component by component. One of the two shear components of F must be
/// given: stress cannot hold a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Control {
    /// `components[i][j]` governs F_ij or σ_ij.
    pub components: [[Component; 2]; 2],
}

impl Control {
    /// The prescribed part of F (unchanged where the stress is given) and the prescribed stresses.
    fn split(&self, from: &Tensor2<2>) -> (Tensor2<2>, [[Option<f64>; 2]; 2]) {
        let mut gradient = *from;
        let mut stress = [[None; 2]; 2];
        for k in 0..2 {
            for l in 0..2 {
                match self.components[k][l] {
                    Component::Gradient(value) => gradient[k][l] = value,
                    Component::Stress(value) => stress[k][l] = Some(value),
                }
            }
        }
        (gradient, stress)
    }
}

/// Brings `base`, whose total deformation gradient is `from`, to equilibrium under `control`, with
/// friction by return mapping or along the path. The stress-controlled components of F are degrees
/// of freedom of the cell and settle together with the grains.
///
/// # Errors
/// As [`crate::respond`], and when both shear components are stress-controlled.
pub fn drive(
    base: &Rev<2, 1>,
    from: &Tensor2<2>,
    control: &Control,
    method: Method,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    let (gradient, stress) = control.split(from);
    let step = match invert(from) {
        (determinant, Some(back)) if determinant > 0.0 => product(&gradient, &back),
        (determinant, _) => {
            return Err(EquilibriumError::NotAMotion {
                gradient: *from,
                determinant,
            });
        }
    };
    check(base, &step)?;
    if !stress.iter().flatten().flatten().all(|s| s.is_finite()) {
        return Err(EquilibriumError::InvalidState(
            "a stress asked for is not finite".into(),
        ));
    }
    if stress[0][1].is_some() && stress[1][0].is_some() {
        return Err(EquilibriumError::InvalidState(
            "both shear components are stress-controlled, which leaves the rotation free".into(),
        ));
    }
    let asked = Asked {
        from: *from,
        to: gradient,
        stress,
    };
    match method {
        Method::Path | Method::Unsettled => follow_path(base, &asked, settings, 0),
        Method::ReturnMapping | Method::Rebased => {
            map_or_follow(base, None, &step, &asked, settings)
        }
    }
}
