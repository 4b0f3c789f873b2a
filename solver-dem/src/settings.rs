//! How hard the solver tries.

use serde::{Deserialize, Serialize};

/// Which tangents a solve computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangents {
    /// The algorithmic and the elastic one.
    #[default]
    Both,
    /// The algorithmic one; the affine operator, a bound of the elastic tangent from above that costs
    /// nothing, stands in its place.
    Algorithmic,
}

/// What becomes of a REV whose grains have all come apart. Without cohesion that is where it is pulled, or unloaded to no
/// stress at all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossOfConfinement {
    /// There is no answer, which [`crate::EquilibriumError::ConfinementLost`] says.
    #[default]
    Fail,
    /// The answer is a void: zero stress, zero tangents, until grains touch again.
    Allow,
}

/// What is answered where no solver comes to an equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unsettled {
    /// There is no answer, which [`crate::EquilibriumError::NotReached`] says.
    #[default]
    Fail,
    /// The state that the first ramp of the path solver came to, marked by [`crate::Method::Unsettled`]: something for an
    /// iteration to go on from, never to end with.
    Answer,
}

/// Numerical settings of a REV solve. The defaults are the measured ones of docs/design/rev-solver.md.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Largest unbalanced force or moment/radius of a grain, over the mean contact force. 1e-4 is
    /// the loosest that counts as equilibrium.
    pub tolerance: f64,
    /// Largest change of a stress component between two checks, over the mean stress.
    pub drift_tolerance: f64,
    /// Largest error of a stress-controlled component, over the mean stress asked for.
    pub stress_tolerance: f64,
    /// Cycles after which return mapping gives up its single reference state and re-bases the
    /// friction history at every check.
    pub rebase_after: u32,
    /// Cycles of return mapping after which the path solver takes over.
    pub return_mapping_cap: u32,
    /// Cycles of relaxation after which the path solver gives up.
    pub path_cap: u32,
    /// Strain per cycle of the path solver's ramp.
    pub ramp_rate: f64,
    /// The shortest ramp in cycles.
    pub ramp_min_cycles: u32,
    /// Stiffness put on every grain's diagonal when the network is linearised, over kn: it keeps
    /// nearly unstable networks from answering with an unbounded displacement.
    pub network_regularisation: f64,
    /// Which tangents are computed: each costs about 40 cycles.
    pub tangents: Tangents,
    /// Whether a REV without contacts is an answer.
    pub loss_of_confinement: LossOfConfinement,
    /// Whether a REV that does not come to rest is an answer.
    #[serde(default)]
    pub unsettled: Unsettled,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-4,
            drift_tolerance: 1e-5,
            stress_tolerance: 1e-4,
            rebase_after: 1000,
            return_mapping_cap: 4000,
            path_cap: 60_000,
            ramp_rate: 2e-6,
            ramp_min_cycles: 200,
            network_regularisation: 1e-3,
            tangents: Tangents::Both,
            loss_of_confinement: LossOfConfinement::Fail,
            unsettled: Unsettled::Fail,
        }
    }
}
