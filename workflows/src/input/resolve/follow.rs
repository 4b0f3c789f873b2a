//! What a stage follows in place of a load, and what ends it early.

use super::loads::Loads;
use super::read::Reader;
use crate::input::boundaries::{Place, PlaceKind, places};
use crate::input::document::{self, Sense};
use crate::input::path::Path;
use crate::input::problem::Model;
use crate::input::programme::{Bound, Control, Followed, Stop};
use crate::input::report::{list, suggest};

/// What a programme loads.
pub enum Subject {
    /// A body with these boundaries and nodes.
    Body(Vec<Place>),
    /// One point of a material.
    ElementTest,
}

impl Subject {
    /// That of a model.
    pub fn of(model: &Model) -> Self {
        match model {
            Model::Body(body) => Subject::Body(places(&body.mesh)),
            Model::ElementTest(_) => Subject::ElementTest,
        }
    }
}

/// The control written at `path`.
pub fn control(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::StageControl,
    loads: &mut Loads,
    subject: Option<&Subject>,
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
            if *to <= -1.0 {
                let message = format!("the volume of `{boundary}` cannot change by {to} of itself");
                let help = "0.5 is half as much again, −0.5 half of it".to_owned();
                reader.report.at(&at, message, help);
                return None;
            }
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

/// The conditions written at `path`.
pub fn until(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &[document::Until],
    loads: &mut Loads,
    subject: Option<&Subject>,
) -> Option<Vec<Stop>> {
    let stops = written.iter().enumerate();
    let stops: Vec<Option<Stop>> = stops
        .map(|(index, written)| stop(reader, &path.index(index), written, loads, subject))
        .collect();
    stops.into_iter().collect()
}

fn stop(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::Until,
    loads: &mut Loads,
    subject: Option<&Subject>,
) -> Option<Stop> {
    let given = |keys: &[(&'static str, bool)]| -> Vec<&'static str> {
        let given = keys.iter().filter(|(_, given)| *given);
        given.map(|(key, _)| *key).collect()
    };
    let what = given(&[
        ("load", written.load.is_some()),
        ("volume", written.volume.is_some()),
        ("shear_strain", written.shear_strain.is_some()),
        ("settled", written.settled.is_some()),
    ]);
    let sides = given(&[
        ("above", written.above.is_some()),
        ("below", written.below.is_some()),
    ]);
    let span = given(&[
        ("within", written.within.is_some()),
        ("over", written.over.is_some()),
    ]);
    let needed: (&[&str], &[&str]) = match what.as_slice() {
        ["load" | "volume"] => (&sides, &span),
        ["settled"] => (&span, &sides),
        ["shear_strain"] => (&[], if sides.is_empty() { &span } else { &sides }),
        [] if reader.is_misspelt(path) => return None,
        _ => {
            let message = match what.len() {
                0 => "this condition says nothing".to_owned(),
                _ => format!("one condition cannot be about {} together", list(what)),
            };
            let help = "write one of `{ load: …, above: … }`, `{ volume: …, above: … }`, `{ shear_strain: … }`, `{ settled: …, within: 0.01, over: 5 }`; several conditions are several entries, of which any ends the stage";
            reader.report.at(path, message, help.to_owned());
            return None;
        }
    };
    if let Some(key) = needed.1.first() {
        let message = format!("`{key}` does not belong to `{}`", what[0]);
        reader
            .report
            .at_key(&path.key(*key), message, "remove it".to_owned());
        return None;
    }
    let complete = match what[0] {
        "settled" => needed.0.len() == 2,
        "shear_strain" => true,
        _ => needed.0.len() == 1,
    };
    if !complete && !reader.is_misspelt(path) {
        let help = match what[0] {
            "settled" => "write both `within: 0.01` and `over: 5`",
            _ => "write one of `above: …`, `below: …`",
        };
        let message = format!("when `{}` ends the stage is not said", what[0]);
        reader.report.at(path, message, help.to_owned());
        return None;
    }
    let bound = match (written.above, written.below) {
        (Some(value), _) => Bound::Above(value),
        (None, below) => Bound::Below(below.unwrap_or_default()),
    };
    let mut load = |reader: &mut Reader<'_, '_>, key: &str, name: &Option<String>| {
        let name = name.as_deref()?;
        loads.find(reader, &path.key(key), name)
    };
    match what[0] {
        "load" => Some(Stop::Load(load(reader, "load", &written.load)?, bound)),
        "settled" => Some(Stop::Settled {
            load: load(reader, "settled", &written.settled)?,
            within: written.within?,
            over: written.over?,
        }),
        "shear_strain" => written.shear_strain.map(Stop::ShearStrain),
        _ => {
            let boundary = written.volume.as_deref()?;
            let at = path.key("volume");
            Some(Stop::Volume(cavity(reader, &at, boundary, subject)?, bound))
        }
    }
}

/// The name of a boundary, where there is one; whether it encloses a volume is seen when the mesh is built.
fn cavity(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    name: &str,
    subject: Option<&Subject>,
) -> Option<String> {
    let places = match subject? {
        Subject::Body(places) => places,
        Subject::ElementTest => {
            let message = "an element test has no cavity";
            reader.report.at_key(path, message, None);
            return None;
        }
    };
    let boundaries = places.iter().filter(|place| place.kind != PlaceKind::Node);
    let names: Vec<&str> = boundaries.map(|place| place.name.as_str()).collect();
    if names.contains(&name) {
        return Some(name.to_owned());
    }
    let message = format!("the mesh has no boundary `{name}`");
    let help = suggest(name, names.iter().copied(), "boundaries");
    reader.report.at_key(path, message, help);
    None
}
