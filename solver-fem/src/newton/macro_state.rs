//! The committed state of the macro scale: all the next step reads.

use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use thiserror::Error;

use crate::assembly::{Configuration, Start, residual};
use crate::constitutive::GaussPointId;
use crate::kinematics::InvertedElement;
use crate::problem::Problem;
use crate::second_gradient::SecondGradientState;
use crate::tensor::{self, Tensor2, Tensor4};

/// State of the macro scale at the end of a step. Arrays are flat: nodes × D, or Gauss points × D²
/// (stress, row by row) or × D⁴ (tangents, last index fastest).
#[derive(Deserialize, Clone, PartialEq, Debug, Default)]
pub struct MacroState<const D: usize> {
    /// Total displacement from the initial mesh.
    pub displacement: Vec<f64>,
    /// Node positions.
    pub coordinates: Vec<f64>,
    /// Cauchy stress at every Gauss point, tension positive.
    pub stress: Vec<f64>,
    /// Tangents of the last pure sweep, kept for the next predictor.
    pub predictor_tangents: Vec<f64>,
    /// Initial elastic tangents E, what tangents are judged against.
    pub elastic_tangents: Vec<f64>,
    /// Force the supports exert on the body; zero on free degrees of freedom.
    pub reactions: Vec<f64>,
    /// Load values.
    pub loads: Vec<f64>,
    /// The fields of second gradient, where the problem has one.
    #[serde(default)]
    pub second_gradient: Option<SecondGradientState>,
    /// Displacement over the last step, where that was controlled by arc length: the next one goes on in its direction.
    #[serde(default)]
    pub increment: Option<Vec<f64>>,
}

/// A state is stored as an array. What it has not is left out at the end of it, so that what a plain state is stored as
/// does not change with what others may have.
impl<const D: usize> Serialize for MacroState<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let last = match (&self.second_gradient, &self.increment) {
            (None, None) => 7,
            (Some(_), None) => 8,
            (_, Some(_)) => 9,
        };
        let mut fields = serializer.serialize_struct("MacroState", last)?;
        fields.serialize_field("displacement", &self.displacement)?;
        fields.serialize_field("coordinates", &self.coordinates)?;
        fields.serialize_field("stress", &self.stress)?;
        fields.serialize_field("predictor_tangents", &self.predictor_tangents)?;
        fields.serialize_field("elastic_tangents", &self.elastic_tangents)?;
        fields.serialize_field("reactions", &self.reactions)?;
        fields.serialize_field("loads", &self.loads)?;
        if last > 7 {
            fields.serialize_field("second_gradient", &self.second_gradient)?;
        }
        if last > 8 {
            fields.serialize_field("increment", &self.increment)?;
        }
        fields.end()
    }
}

/// A state does not fit its problem.
#[derive(Error, Clone, PartialEq, Debug)]
pub enum StateError {
    /// An array has the wrong length.
    #[error("read the macro state: {what} has {found} values, the problem needs {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length the problem gives.
        expected: usize,
    },
    /// The state has fields of second gradient and the problem none, or the other way round.
    #[error("read the macro state: {0}")]
    SecondGradient(&'static str),
    /// A number is NaN or infinite.
    #[error("read the macro state: {what} holds a value that is not a finite number")]
    NonFinite {
        /// Which array.
        what: &'static str,
    },
    /// The positions fold an element.
    #[error(transparent)]
    Inverted(#[from] InvertedElement),
}

impl<const D: usize> MacroState<D> {
    /// The state before the first step: initial positions, given stresses and elastic tangents of
    /// every Gauss point, load values.
    ///
    /// # Errors
    /// Arrays that do not fit the problem.
    pub fn initial(
        problem: &Problem<D>,
        stress: &[Tensor2<D>],
        elastic: &[Tensor4<D>],
        loads: &[f64],
    ) -> Result<Self, StateError> {
        let tangents = tensor::flatten4(elastic);
        let mut state = MacroState {
            displacement: vec![0.0; problem.dof_count()],
            coordinates: problem.initial().to_vec(),
            stress: tensor::flatten2(stress),
            predictor_tangents: tangents.clone(),
            elastic_tangents: tangents,
            reactions: vec![0.0; problem.dof_count()],
            loads: loads.to_vec(),
            second_gradient: SecondGradientState::zero(problem),
            increment: None,
        };
        state.check(problem)?;
        let unknowns = state.unknowns();
        let out_of_balance = residual(problem, &state.configuration(&unknowns, loads))?;
        state.reactions = reactions(problem, &out_of_balance.vector);
        Ok(state)
    }

    /// Whether every array fits the problem and is finite.
    ///
    /// # Errors
    /// The first array that does not.
    pub fn check(&self, problem: &Problem<D>) -> Result<(), StateError> {
        let (dofs, points) = (problem.dof_count(), problem.gauss_point_count());
        let tensor4 = points * D * D * D * D;
        let layout = problem.layout();
        let (none, fields) = (Vec::new(), self.second_gradient.as_ref());
        match (fields, layout.multiplier_count()) {
            (None, 1..) => {
                return Err(StateError::SecondGradient(
                    "the problem has a second gradient, the state none",
                ));
            }
            (Some(_), 0) => {
                return Err(StateError::SecondGradient(
                    "the state has a second gradient, the problem none",
                ));
            }
            _ => {}
        }
        let of = |array: fn(&SecondGradientState) -> &Vec<f64>| fields.map_or(&none, array);
        let double_stress = fields.map_or(0, |_| points * D * D * D);
        let (gradient, multipliers) = (layout.gradient_count(), layout.multiplier_count());
        for (what, array, expected) in [
            ("the double stress", of(|f| &f.double_stress), double_stress),
            (
                "the list of multipliers",
                of(|f| &f.multipliers),
                multipliers,
            ),
            ("the increment of v", of(|f| &f.increment), gradient),
            (
                "the list of mismatches",
                of(|f| &f.mismatch),
                multipliers / (D * D),
            ),
            ("the field v", of(|f| &f.gradient), gradient),
            (
                "the last increment",
                self.increment.as_ref().unwrap_or(&self.displacement),
                dofs,
            ),
            ("the displacement", &self.displacement, dofs),
            ("the list of positions", &self.coordinates, dofs),
            ("the stress", &self.stress, points * D * D),
            (
                "the list of predictor tangents",
                &self.predictor_tangents,
                tensor4,
            ),
            (
                "the list of elastic tangents",
                &self.elastic_tangents,
                tensor4,
            ),
            ("the list of reactions", &self.reactions, dofs),
            ("the list of loads", &self.loads, problem.load_count()),
        ] {
            if array.len() != expected {
                return Err(StateError::Length {
                    what,
                    found: array.len(),
                    expected,
                });
            }
            if array.iter().any(|value| !value.is_finite()) {
                return Err(StateError::NonFinite { what });
            }
        }
        Ok(())
    }

    /// All unknowns at the beginning of the next step, in the order of the problem's
    /// [`Layout`](crate::layout::Layout): positions, v = 0, λ.
    pub fn unknowns(&self) -> Vec<f64> {
        let mut unknowns = self.coordinates.clone();
        if let Some(fields) = &self.second_gradient {
            unknowns.resize(unknowns.len() + fields.gradient.len(), 0.0);
            unknowns.extend(&fields.multipliers);
        }
        unknowns
    }

    /// What the next step begins from.
    pub fn start(&self) -> Start<'_> {
        let fields = self.second_gradient.as_ref();
        Start {
            coordinates: &self.coordinates,
            double_stress: fields.map_or(&[], |fields| &fields.double_stress),
        }
    }

    /// The configuration of this state at the beginning of the next step, under other loads;
    /// `unknowns` are [those](Self::unknowns) of the state.
    pub fn configuration<'a>(&'a self, unknowns: &'a [f64], loads: &'a [f64]) -> Configuration<'a> {
        Configuration {
            unknowns,
            stress: &self.stress,
            loads,
            start: self.start(),
        }
    }

    /// Cauchy stress of a Gauss point.
    ///
    /// # Panics
    /// For a point the state does not have.
    pub fn stress_at(&self, point: GaussPointId) -> Tensor2<D> {
        tensor::load2(&self.stress, point.index())
    }

    /// Displacement of a node.
    ///
    /// # Panics
    /// For a node the state does not have.
    pub fn displacement_of(&self, node: usize) -> [f64; D] {
        crate::kinematics::position(&self.displacement, node)
    }
}

/// The entries of a residual on prescribed displacements, zero elsewhere.
pub(super) fn reactions<const D: usize>(problem: &Problem<D>, residual: &[f64]) -> Vec<f64> {
    let equation = &problem.constraints().equation;
    residual[..problem.dof_count()]
        .iter()
        .zip(equation)
        .map(|(r, eq)| if eq.is_some() { 0.0 } else { *r })
        .collect()
}
