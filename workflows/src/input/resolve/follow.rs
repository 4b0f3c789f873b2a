//! What a stage follows in place of a load.

use solver_fem::boundary::CavityProblem;

use super::loads::Loads;
use super::read::Reader;
use super::subject::Subject;
use crate::input::boundaries::PlaceKind;
use crate::input::document::{self, Sense};
use crate::input::path::Path;
use crate::input::programme::{Control, Followed};
use crate::input::report::suggest;

/// The control written at `path`.
pub fn control(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::StageControl,
    loads: &mut Loads,
    subject: Option<&Subject<'_>>,
) -> Option<Control> {
    if matches!(subject, Some(Subject::ElementTest)) {
        let message = "an element test has no boundary whose load could adapt";
        let help = "prescribe the strain of the component that softens, and the stress of the others: `ramp: …`";
        reader.report.at_key(path, message, help.to_owned());
        return None;
    }
    let load = loads.find(reader, &path.key("load"), &written.load);
    if let (Some(_), None) = (written.at_first, written.arc_length) {
        let help = "a volume says itself which way it goes; remove `at_first`".to_owned();
        let message = "`at_first` belongs to `arc_length`";
        reader.report.at_key(&path.key("at_first"), message, help);
    }
    let followed = match (&written.volume, written.arc_length) {
        (Some(volume), None) => {
            let inner = path.key("volume");
            let mut entries = volume.iter();
            let (Some((boundary, to)), None) = (entries.next(), entries.next()) else {
                let message = format!("`{inner}` names {} boundaries", volume.len());
                let help = "one cavity can be followed: `volume: { inner: 0.5 }`".to_owned();
                reader.report.at_key(&inner, message, help);
                return None;
            };
            let at = inner.key(boundary.as_str());
            let known = cavity(reader, &at, boundary, subject)?;
            Some(Followed::Volume {
                boundary: known,
                to: *to,
            })
        }
        (None, Some(length)) => {
            let sense = match written.at_first {
                Some(Sense::Rising) => Some(1.0),
                Some(Sense::Falling) => Some(-1.0),
                None => {
                    let message = "which way the load goes at first is missing";
                    let help = "write `at_first: rising` or `at_first: falling`".to_owned();
                    reader.report.at_key(path, message, help);
                    None
                }
            };
            sense.map(|sense| Followed::ArcLength { length, sense })
        }
        (volume, _) => {
            let message = match volume {
                Some(_) => "a stage cannot follow a volume and a length together",
                None => "nothing is followed",
            };
            let help = "write one of `volume: { boundary: expansion }`, `arc_length: …`";
            reader.report.at_key(path, message, help.to_owned());
            None
        }
    };
    Some(Control {
        load: load?,
        path: followed?,
    })
}

/// The name of a boundary with a volume behind it, where there is one.
pub fn cavity(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    name: &str,
    subject: Option<&Subject<'_>>,
) -> Option<String> {
    let body = match subject? {
        Subject::Body(body) => body,
        Subject::ElementTest => {
            let message = "an element test has no cavity";
            let help = "look at a load, or at `shear_strain`".to_owned();
            reader.report.at_key(path, message, help);
            return None;
        }
    };
    let boundaries = body.places.iter();
    let boundaries = boundaries.filter(|place| place.kind != PlaceKind::Node);
    let names: Vec<&str> = boundaries.map(|place| place.name.as_str()).collect();
    if !names.contains(&name) {
        let message = format!("the mesh has no boundary `{name}`");
        let help = suggest(name, names.iter().copied(), "boundaries");
        reader.report.at_key(path, message, help);
        return None;
    }
    if let Some(problem) = body.cavity_problem(name) {
        let help = match problem {
            CavityProblem::Open { .. } | CavityProblem::Parallel { .. } => {
                "a boundary with a volume is closed, or ends on planes of symmetry x = const and y = const, at most one of each, along which it is free: `{ on: …, displacement: { x: 0 } }`"
            }
            CavityProblem::Unknown(_) | CavityProblem::Flat(_) => {
                "name the wall of the cavity, as `inner` of a ring"
            }
        };
        reader
            .report
            .at_key(path, problem.to_string(), help.to_owned());
        return None;
    }
    Some(name.to_owned())
}
