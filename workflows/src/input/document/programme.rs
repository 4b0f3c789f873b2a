//! The load programme, as it is written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// One stage of loading: exactly one of `ramp`, `hold`, `cycle`. Loads that it does not name keep their value.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name of the stage.
    pub name: String,
    /// Bring each of these loads from its value to this one, in `steps` equal increments.
    pub ramp: Option<BTreeMap<String, f64>>,
    /// Keep all loads for `steps` load steps: `hold: {}`.
    pub hold: Option<Hold>,
    /// Bring each of these loads to the first value and then to the second, `times` times, each way in `steps` equal
    /// increments.
    pub cycle: Option<BTreeMap<String, [f64; 2]>>,
    /// Number of load steps of the ramp, of the hold, or of each way of the cycle.
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: u32,
    /// Number of cycles; 1 where it is left out.
    #[schemars(range(min = 1, max = 100_000))]
    pub times: Option<u32>,
}

/// A hold has no settings: `{}`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hold {}
