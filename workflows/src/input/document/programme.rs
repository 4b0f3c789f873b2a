//! The load programme, as it is written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// One stage of loading: exactly one of `ramp`, `hold`, `cycle`, `control`. Loads that it does not name keep their value.
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
    /// Follow the volume of a cavity or the length of the deformation's path, while a load adapts: through limit loads,
    /// where no value of the load could be given beforehand.
    pub control: Option<Control>,
    /// Number of load steps of the stage; of a cycle, of each of its ways.
    #[schemars(range(min = 1, max = 100_000))]
    pub steps: u32,
    /// For `cycle`: how often it is gone; 1 where it is left out.
    #[schemars(range(min = 1, max = 100_000))]
    pub times: Option<u32>,
    /// End the stage before its last load step where one of these is met; the next stage begins, or the run is complete.
    #[serde(default)]
    pub until: Vec<Until>,
}

/// What is followed while a load adapts: exactly one of `volume`, `arc_length`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// The load that adapts: its value is found in every load step.
    pub load: String,
    /// The boundary of a cavity and the expansion V/V0 − 1 that it is brought to, as in `{ inner: 0.5 }`: 0.5 is half as
    /// much again, −0.5 half of it.
    #[schemars(extend("additionalProperties" = expansion()))]
    pub volume: Option<BTreeMap<String, f64>>,
    /// Length of the path over the whole stage: each load step moves the nodes by `arc_length`/`steps` (root mean square).
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub arc_length: Option<f64>,
    /// With `arc_length`: whether the load rises or falls in the first load step of the stage. Later ones go on in the
    /// direction of the deformation.
    pub at_first: Option<Sense>,
}

/// The expansion of a cavity: some of its volume is left, and it has not swallowed the body many times over.
fn expansion() -> serde_json::Value {
    serde_json::json!({
        "description": "V/V0 − 1 of the cavity: 0.5 is half as much again, −0.5 half of it.",
        "type": "number",
        "format": "double",
        "exclusiveMinimum": -1.0,
        "maximum": 1000.0,
    })
}

/// A direction of change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sense {
    /// The value grows.
    Rising,
    /// The value falls.
    Falling,
}

/// What ends a stage: exactly one of `load`, `volume`, `displacement`, `force`, `shear_strain`, `settled`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Until {
    /// This load is `above` or `below` a value, or has fallen from its peak by a part, `drop`.
    pub load: Option<String>,
    /// V/V0 − 1 of the cavity behind this boundary is `above` or `below` a value.
    pub volume: Option<String>,
    /// The mean displacement of the nodes of this boundary or node set `along` an axis is `above` or `below` a value: the
    /// column `ux_NAME` or `uy_NAME` of the curves.
    pub displacement: Option<String>,
    /// The force `along` an axis that the supports of this boundary or node set exert on the body is `above` or `below` a
    /// value, or has fallen from its peak by a part, `drop`: the column `fx_NAME` or `fy_NAME` of the curves.
    pub force: Option<String>,
    /// The equivalent shear strain of some Gauss point is above this value.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub shear_strain: Option<f64>,
    /// This load has come to a limit: over the last `over` increments of the programme its largest and smallest value differ
    /// by less than `within` of it.
    pub settled: Option<String>,
    /// For `displacement` and `force`: the axis.
    pub along: Option<Axis>,
    /// For `load`, `volume`, `displacement` and `force`.
    pub above: Option<f64>,
    /// For `load`, `volume`, `displacement` and `force`.
    pub below: Option<f64>,
    /// For `load` and `force`: the part of its largest magnitude since the stage began that it has lost, as 0.2.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub drop: Option<f64>,
    /// For `settled`: a part of the value, as 0.01.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub within: Option<f64>,
    /// For `settled`: a number of increments, cut ones counted once.
    #[schemars(range(min = 1, max = 100_000))]
    pub over: Option<u32>,
}

/// An axis of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
}

/// A hold has no settings: `{}`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hold {}
