//! What ends a stage early.

use super::follow::cavity;
use super::loads::Loads;
use super::read::Reader;
use super::subject::{Named, Subject};
use crate::input::document::{self, Axis};
use crate::input::path::Path;
use crate::input::programme::{Along, Bound, Measured, Stop};
use crate::input::report::{list, suggest};

/// The conditions written at `path`.
pub fn until(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &[document::Until],
    loads: &mut Loads,
    subject: Option<&Subject<'_>>,
) -> Option<Vec<Stop>> {
    let stops = written.iter().enumerate();
    let stops: Vec<Option<Stop>> = stops
        .map(|(index, written)| {
            let path = path.index(index);
            let about = about(reader, &path, written)?;
            stop(reader, &path, (about, written), loads, subject)
        })
        .collect();
    stops.into_iter().collect()
}

/// The keys that belong to one kind of condition.
struct Kind {
    /// What it is about.
    key: &'static str,
    /// Of these there has to be one.
    one_of: &'static [&'static str],
    /// These have to be there all.
    all_of: &'static [&'static str],
}

const KINDS: [Kind; 6] = [
    Kind {
        key: "load",
        one_of: &["above", "below", "drop"],
        all_of: &[],
    },
    Kind {
        key: "volume",
        one_of: &["above", "below"],
        all_of: &[],
    },
    Kind {
        key: "displacement",
        one_of: &["above", "below"],
        all_of: &["along"],
    },
    Kind {
        key: "force",
        one_of: &["above", "below", "drop"],
        all_of: &["along"],
    },
    Kind {
        key: "shear_strain",
        one_of: &[],
        all_of: &[],
    },
    Kind {
        key: "settled",
        one_of: &[],
        all_of: &["within", "over"],
    },
];

/// What the condition at `path` is about, where its keys make one condition.
fn about(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::Until,
) -> Option<&'static str> {
    let given = given(written);
    let has = |key: &str| given.contains(&key);
    let kinds: Vec<&Kind> = KINDS.iter().filter(|kind| has(kind.key)).collect();
    let kind = match kinds.as_slice() {
        [kind] => *kind,
        [] if reader.is_misspelt(path) => return None,
        several => {
            let message = match several {
                [] => "this condition says nothing".to_owned(),
                several => format!(
                    "one condition cannot be about {} together",
                    list(several.iter().map(|kind| kind.key))
                ),
            };
            let help = "write one of `{ load: …, above: … }`, `{ volume: …, above: … }`, `{ displacement: …, along: y, below: … }`, `{ force: …, along: y, drop: 0.2 }`, `{ shear_strain: … }`, `{ settled: …, within: 0.01, over: 5 }`; several conditions are several entries, of which any ends the stage";
            reader.report.at(path, message, help.to_owned());
            return None;
        }
    };
    let belongs =
        |key: &str| key == kind.key || kind.one_of.contains(&key) || kind.all_of.contains(&key);
    if let Some(key) = given.iter().find(|key| !belongs(key)) {
        let message = format!("`{key}` does not belong to `{}`", kind.key);
        let path = path.key(*key);
        reader.report.at_key(&path, message, "remove it".to_owned());
        return None;
    }
    let chosen = kind.one_of.iter().copied().filter(|key| has(key));
    let chosen: Vec<&str> = chosen.collect();
    if chosen.len() > 1 {
        let message = format!(
            "when `{}` ends the stage is said more than once, by {}",
            kind.key,
            list(chosen.iter().copied())
        );
        let help =
            "keep one of them; several conditions are several entries, of which any ends the stage";
        reader.report.at(path, message, help.to_owned());
        return None;
    }
    let open = !kind.one_of.is_empty() && chosen.is_empty();
    let lacks = kind.all_of.iter().any(|key| !has(key));
    if !open && !lacks {
        return Some(kind.key);
    }
    if !reader.is_misspelt(path) {
        let (message, help) = match kind.key {
            "settled" => ("when", "write both `within: 0.01` and `over: 5`".to_owned()),
            _ if open => {
                let forms = kind.one_of.iter().map(|key| format!("`{key}: …`"));
                let forms: Vec<String> = forms.collect();
                ("when", format!("write one of {}", forms.join(", ")))
            }
            _ => (
                "along which axis",
                "write `along: x` or `along: y`".to_owned(),
            ),
        };
        let message = format!("{message} `{}` ends the stage is not said", kind.key);
        reader.report.at(path, message, help);
    }
    None
}

/// The keys that are there.
fn given(written: &document::Until) -> Vec<&'static str> {
    let keys = [
        ("load", written.load.is_some()),
        ("volume", written.volume.is_some()),
        ("displacement", written.displacement.is_some()),
        ("force", written.force.is_some()),
        ("shear_strain", written.shear_strain.is_some()),
        ("settled", written.settled.is_some()),
        ("along", written.along.is_some()),
        ("above", written.above.is_some()),
        ("below", written.below.is_some()),
        ("drop", written.drop.is_some()),
        ("within", written.within.is_some()),
        ("over", written.over.is_some()),
    ];
    let given = keys.into_iter().filter(|(_, given)| *given);
    given.map(|(key, _)| key).collect()
}

/// The condition about `about`, whose keys are complete.
fn stop(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    (about, written): (&'static str, &document::Until),
    loads: &mut Loads,
    subject: Option<&Subject<'_>>,
) -> Option<Stop> {
    let at = path.key(about);
    let bound = match (written.above, written.below) {
        (Some(value), _) => Some(Bound::Above(value)),
        (None, below) => below.map(Bound::Below),
    };
    match about {
        "load" => {
            let load = loads.find(reader, &at, written.load.as_deref()?)?;
            Some(match written.drop {
                Some(part) => Stop::Drop(Measured::Load(load), part),
                None => Stop::Load(load, bound?),
            })
        }
        "settled" => Some(Stop::Settled {
            load: loads.find(reader, &at, written.settled.as_deref()?)?,
            within: written.within?,
            over: written.over?,
        }),
        "displacement" => {
            let along = along(
                reader,
                &at,
                (written.displacement.as_deref()?, written.along?),
                subject?,
            )?;
            Some(Stop::Displacement(along, bound?))
        }
        "force" => {
            let along = along(
                reader,
                &at,
                (written.force.as_deref()?, written.along?),
                subject?,
            )?;
            supported(reader, &at, &along, subject?)?;
            Some(match written.drop {
                Some(part) => Stop::Drop(Measured::Force(along), part),
                None => Stop::Force(along, bound?),
            })
        }
        "shear_strain" => written.shear_strain.map(Stop::ShearStrain),
        _ => {
            let boundary = written.volume.as_deref()?;
            Some(Stop::Volume(
                cavity(reader, &at, boundary, subject)?,
                bound?,
            ))
        }
    }
}

/// A component at a boundary or nodes that exist.
fn along(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    (name, axis): (&str, Axis),
    subject: &Subject<'_>,
) -> Option<Along> {
    let Subject::Body(Named { places, .. }) = subject else {
        let help = "look at a load, or at `shear_strain`".to_owned();
        reader
            .report
            .at_key(path, "an element test has no boundary", help);
        return None;
    };
    let names: Vec<&str> = places.iter().map(|place| place.name.as_str()).collect();
    if !names.contains(&name) {
        let message = format!("the mesh has no boundary `{name}`");
        let help = suggest(name, names.iter().copied(), "boundaries and nodes");
        reader.report.at(path, message, help);
        return None;
    }
    let component = match axis {
        Axis::X => 0,
        Axis::Y => 1,
    };
    Some(Along {
        on: name.to_owned(),
        component,
    })
}

/// Where nothing is held or driven no support exerts a force, and the condition could never be met.
fn supported(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    along: &Along,
    subject: &Subject<'_>,
) -> Option<()> {
    let Subject::Body(named) = subject else {
        return None;
    };
    if named.is_supported(&along.on, along.component) {
        return Some(());
    }
    let axis = ["x", "y"][along.component];
    let message = format!(
        "no displacement {axis} is prescribed on `{}`: no support exerts a force there",
        along.on
    );
    let supports = named.supports.iter();
    let same = supports.filter(|(_, component)| *component == along.component);
    let names: Vec<&str> = same.map(|(on, _)| on.as_str()).collect();
    let help = match names.is_empty() {
        true => format!("no displacement {axis} is prescribed anywhere"),
        false => format!("it is on {}", list(names.iter().copied())),
    };
    reader.report.at(path, message, help);
    None
}
