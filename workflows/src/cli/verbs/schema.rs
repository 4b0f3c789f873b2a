//! `femdem-flow schema`

use crate::input;
use crate::report::Report;

/// The schema is data for programs: it has the same form with and without `--json`.
pub fn perform() -> Report {
    let schema = input::schema();
    Report {
        text: format!("{schema:#}"),
        json: schema,
    }
}
