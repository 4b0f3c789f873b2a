//! What can be drawn on a mesh, at a step or between two.

use std::sync::Arc;

use clap::ValueEnum;
use solver_fem::{Tensor2, newton::MacroState, post, tensor};

use crate::run::{model::Model, point::PlaneRev, point::PointState};

/// A quantity on the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Quantity {
    /// Equivalent deviatoric strain √(⅔ e:e), from the logarithmic strain.
    ShearStrain,
    /// Volume strain ln(v/v0), dilation positive.
    VolumeStrain,
    /// q/p: half the difference of the principal stresses over their mean.
    StressRatio,
    /// Mean stress p = −(σxx + σyy)/2, compression positive.
    MeanStress,
    /// Component σxx of the Cauchy stress, tension positive.
    StressXx,
    /// Component σyy.
    StressYy,
    /// Component σxy.
    StressXy,
    /// Length of the displacement.
    Displacement,
    /// Displacement along x.
    DisplacementX,
    /// Displacement along y.
    DisplacementY,
    /// Volume of voids over volume of grains.
    VoidRatio,
    /// Contacts of a grain, rattlers included.
    Coordination,
    /// CPU seconds of the element's REVs in the step.
    RevCost,
}

/// How a quantity is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// From zero up.
    FromZero,
    /// From the least to the greatest value.
    Spread,
    /// Symmetric about zero.
    Signed,
}

/// Where values sit.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// One a node.
    Nodes(Vec<f64>),
    /// One a Gauss point.
    Points(Vec<f64>),
    /// One an element.
    Elements(Vec<f64>),
}

/// A step as far as it is drawn.
pub struct Snapshot {
    /// Positions, stresses.
    pub state: MacroState<2>,
    /// States of the Gauss points.
    pub points: Vec<Arc<PointState>>,
    /// CPU seconds by element.
    pub cost: Vec<f64>,
}

impl Quantity {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShearStrain => "shear_strain",
            Self::VolumeStrain => "volume_strain",
            Self::StressRatio => "stress_ratio",
            Self::MeanStress => "mean_stress",
            Self::StressXx => "stress_xx",
            Self::StressYy => "stress_yy",
            Self::StressXy => "stress_xy",
            Self::Displacement => "displacement",
            Self::DisplacementX => "displacement_x",
            Self::DisplacementY => "displacement_y",
            Self::VoidRatio => "void_ratio",
            Self::Coordination => "coordination",
            Self::RevCost => "rev_cost",
        }
    }

    /// What stands beside the colours; `increment` tells whether it is what came about between two steps.
    pub fn label(self, increment: bool) -> String {
        let label = match self {
            Self::ShearStrain => "shear strain √(2/3 *e*:*e*) (%)",
            Self::VolumeStrain => "volume strain (%), dilation positive",
            Self::StressRatio => "stress ratio *q*/*p*",
            Self::MeanStress => "mean stress *p*, compression positive",
            Self::StressXx => "stress *σ*_{xx}, tension positive",
            Self::StressYy => "stress *σ*_{yy}, tension positive",
            Self::StressXy => "stress *σ*_{xy}",
            Self::Displacement => "displacement",
            Self::DisplacementX => "displacement along *x*",
            Self::DisplacementY => "displacement along *y*",
            Self::VoidRatio => "void ratio *e*",
            Self::Coordination => "coordination *z*",
            Self::RevCost => "CPU time of an element (s)",
        };
        match (increment, self) {
            (true, Self::RevCost) | (false, _) => label.to_owned(),
            (true, _) => format!("increment of {label}"),
        }
    }

    /// How it is coloured.
    pub fn scale(self, increment: bool) -> Scale {
        match self {
            Self::ShearStrain | Self::Displacement | Self::RevCost => Scale::FromZero,
            Self::VolumeStrain | Self::StressXy | Self::DisplacementX | Self::DisplacementY => {
                Scale::Signed
            }
            _ if increment => Scale::Signed,
            Self::StressRatio => Scale::FromZero,
            _ => Scale::Spread,
        }
    }

    /// Its values at `now`, or what they changed by since `before`.
    ///
    /// Strains between two steps are those of the deformation in between, F = F_now F_before⁻¹; what has no such meaning
    /// is a plain difference. The cost is always that of the step `now`.
    pub fn values(self, model: &Model, now: &Snapshot, before: Option<&Snapshot>) -> Values {
        let problem = &model.problem;
        match self {
            Self::RevCost => Values::Elements(now.cost.clone()),
            Self::Displacement | Self::DisplacementX | Self::DisplacementY => {
                let moved = |node: usize| {
                    let [x, y] = now.state.displacement_of(node);
                    let [u, v] = before.map_or([0.0; 2], |step| step.state.displacement_of(node));
                    match self {
                        Self::DisplacementX => x - u,
                        Self::DisplacementY => y - v,
                        _ => ((x - u) * (x - u) + (y - v) * (y - v)).sqrt(),
                    }
                };
                Values::Nodes((0..problem.mesh().nodes.len()).map(moved).collect())
            }
            Self::ShearStrain | Self::VolumeStrain => {
                let gradients =
                    |step: &Snapshot| post::deformation_gradients(problem, &step.state.coordinates);
                let mut gradients_now = gradients(now);
                if let Some(before) = before {
                    for (f, start) in gradients_now.iter_mut().zip(gradients(before)) {
                        let inverse = tensor::determinant_and_inverse(&start).1;
                        *f = inverse.map_or([[f64::NAN; 2]; 2], |back| tensor::product(f, &back));
                    }
                }
                let percent = |f: &Tensor2<2>| {
                    let strain = post::logarithmic(f);
                    100.0
                        * match self {
                            Self::ShearStrain => post::second_invariant(&strain),
                            _ => post::volumetric(&strain),
                        }
                };
                Values::Points(gradients_now.iter().map(percent).collect())
            }
            _ => {
                let now = self.of_points(model, now);
                let before = before.map(|step| self.of_points(model, step));
                Values::Points(match before {
                    None => now,
                    Some(before) => now.iter().zip(before).map(|(a, b)| a - b).collect(),
                })
            }
        }
    }

    /// A scalar of stress or of grains at every Gauss point.
    fn of_points(self, model: &Model, step: &Snapshot) -> Vec<f64> {
        let grains = |value: fn(&PlaneRev) -> f64| -> Vec<f64> {
            let of_point = |point: &Arc<PointState>| match &**point {
                PointState::Rev(rev) => value(rev),
                PointState::Elastic { .. } => f64::NAN,
            };
            step.points.iter().map(of_point).collect()
        };
        match self {
            Self::VoidRatio => grains(PlaneRev::void_ratio),
            Self::Coordination => grains(PlaneRev::coordination),
            _ => {
                let points = model.problem.gauss_points();
                points
                    .map(|point| self.of_stress(&step.state.stress_at(point)))
                    .collect()
            }
        }
    }

    /// p = −(σ_xx + σ_yy)/2 and q = √(((σ_xx − σ_yy)/2)² + σ_xy²), by Mohr's circle.
    fn of_stress(self, s: &Tensor2<2>) -> f64 {
        let shear = 0.5 * (s[0][1] + s[1][0]);
        let p = -0.5 * (s[0][0] + s[1][1]);
        match self {
            Self::StressXx => s[0][0],
            Self::StressYy => s[1][1],
            Self::StressXy => shear,
            Self::MeanStress => p,
            _ => {
                let half = 0.5 * (s[0][0] - s[1][1]);
                (half * half + shear * shear).sqrt() / p
            }
        }
    }
}
