//! Boundary conditions: on places that exist, each of one kind, none against another, and no motion left free.

use super::loads::Loads;
use super::read::Reader;
use super::rigid;
use crate::input::boundaries::{Place, PlaceKind, places};
use crate::input::document;
use crate::input::mesh::Mesh;
use crate::input::path::Path;
use crate::input::problem::{Amount, Condition, ConditionKind};
use crate::input::report::{list, suggest};

/// The names of the components.
const AXES: [&str; 2] = ["x", "y"];

/// A condition with its place in the mesh and in the input.
struct Placed<'p> {
    place: &'p Place,
    path: Path,
    condition: Condition,
}

/// All conditions; `mesh` is absent where it is wrong, and then names cannot be looked up.
pub fn read(
    reader: &mut Reader<'_, '_>,
    loads: &mut Loads,
    mesh: Option<&Mesh>,
) -> Option<Vec<Condition>> {
    let section = Path::root().key("boundary");
    let places = mesh.map(places);
    let mut placed = Some(Vec::new());
    if reader.has(&section) && reader.keys(&section).is_some() {
        return None;
    }
    // What holds the body may stand under the key that was misspelt.
    if !reader.has(&section) && reader.is_misspelt(&Path::root()) {
        return None;
    }
    for index in 0..reader.count(&section) {
        let new = condition(reader, &section.index(index), loads, places.as_deref());
        placed = placed.zip(new).map(|(mut all, new)| {
            all.extend(new);
            all
        });
    }
    let placed = placed?;
    for (index, later) in placed.iter().enumerate() {
        for earlier in &placed[..index] {
            let contradicts = contradiction(reader, earlier, later);
            // A copy of a condition contradicts all that its original does, which is reported already.
            if contradicts && earlier.place.name == later.place.name {
                break;
            }
        }
    }
    if let Some(places) = &places {
        rigid::check(
            reader,
            &section,
            places,
            placed.iter().map(|one| (one.place, &one.condition.kind)),
        );
    }
    Some(placed.into_iter().map(|one| one.condition).collect())
}

/// The force on the whole body; `Some(None)` where there is none.
pub fn body_force(reader: &mut Reader<'_, '_>, loads: &mut Loads) -> Option<Option<[Amount; 2]>> {
    let path = Path::root().key("body_force");
    if !reader.has(&path) {
        return Some(None);
    }
    let written: document::Components = reader.required(&path)?;
    if written.x.is_none() && written.y.is_none() {
        let help = "write `{ y: weight }` with a load `weight`, for example".to_owned();
        let message = "this body force has no component";
        reader.report.at(&path, message, help);
        return None;
    }
    let mut along = |axis: &str, value: Option<&document::Amount>| match value {
        None => Some(Amount::Constant(0.0)),
        Some(value) => loads.amount(reader, &path.key(axis), value),
    };
    let (x, y) = (
        along("x", written.x.as_ref()),
        along("y", written.y.as_ref()),
    );
    x.zip(y).map(|(x, y)| Some([x, y]))
}

fn condition<'p>(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    loads: &mut Loads,
    places: Option<&'p [Place]>,
) -> Option<Vec<Placed<'p>>> {
    let written: document::Condition = reader.required(path)?;
    let on = path.key("on");
    let place = places.and_then(|places| places.iter().find(|place| place.name == written.on));
    if let (None, Some(places)) = (place, places) {
        let message = format!("the mesh has no boundary `{}`", written.on);
        reader.report.at(
            &on,
            message,
            suggest(
                &written.on,
                places.iter().map(|place| place.name.as_str()),
                "boundaries and nodes",
            ),
        );
    }
    let mut kinds = Vec::new();
    let mut complete = true;
    let mut keep = |kind: Option<(Path, ConditionKind)>| match kind {
        Some(kind) => kinds.push(kind),
        None => complete = false,
    };
    if let Some(displacement) = &written.displacement {
        let path = path.key("displacement");
        for (component, value) in [&displacement.x, &displacement.y].into_iter().enumerate() {
            let Some(value) = value else { continue };
            let path = path.key(AXES[component]);
            let value = loads.amount(reader, &path, value);
            keep(value.map(|value| (path, ConditionKind::Displacement { component, value })));
        }
        if displacement.x.is_none() && displacement.y.is_none() {
            reader.report.at(
                &path,
                "this displacement has no component",
                "write `{ x: 0 }`, for example".to_owned(),
            );
        }
    }
    if let Some(pressure) = &written.pressure {
        let path = path.key("pressure");
        let value = loads.amount(reader, &path, pressure);
        keep(value.map(|value| (path, ConditionKind::Pressure(value))));
    }
    if let Some([x, y]) = &written.traction {
        let path = path.key("traction");
        let (x, y) = (
            loads.amount(reader, &path.index(0), x),
            loads.amount(reader, &path.index(1), y),
        );
        keep(
            x.zip(y)
                .map(|(x, y)| (path, ConditionKind::Traction([x, y]))),
        );
    }
    one_kind(reader, path, &written, place)?;
    let place = place.filter(|_| complete)?;
    let condition = |kind| Condition {
        on: written.on.clone(),
        kind,
    };
    Some(
        kinds
            .into_iter()
            .map(|(path, kind)| Placed {
                place,
                path,
                condition: condition(kind),
            })
            .collect(),
    )
}

/// Exactly one of displacement, pressure, traction, and no distributed load on a node.
fn one_kind(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::Condition,
    place: Option<&Place>,
) -> Option<()> {
    let given = [
        ("displacement", written.displacement.is_some()),
        ("pressure", written.pressure.is_some()),
        ("traction", written.traction.is_some()),
    ];
    let given: Vec<&str> = given
        .into_iter()
        .filter(|(_, given)| *given)
        .map(|(key, _)| key)
        .collect();
    let message = match given.as_slice() {
        [] if reader.is_misspelt(path) => return None,
        [] => format!("nothing is prescribed on `{}`", written.on),
        ["displacement"] => return Some(()),
        [load] if place.is_some_and(|place| place.kind == PlaceKind::Node) => {
            let message = format!("`{}` names nodes; {load} acts along a boundary", written.on);
            reader.report.at_key(&path.key(*load), message, None);
            return None;
        }
        [_] => return Some(()),
        several => format!(
            "one condition cannot prescribe {} together",
            list(several.iter().copied())
        ),
    };
    let help = "write one of `displacement`, `pressure`, `traction`; a second condition makes a second entry".to_owned();
    reader.report.at(path, message, help);
    None
}

/// Reports `later` where it says something else than `earlier` about the same; returns whether it does.
fn contradiction(reader: &mut Reader<'_, '_>, earlier: &Placed<'_>, later: &Placed<'_>) -> bool {
    use ConditionKind::{Displacement, Pressure, Traction};
    let (a, b) = (earlier, later);
    let same = a.place.name == b.place.name;
    let name = &a.place.name;
    let message = match (&a.condition.kind, &b.condition.kind) {
        (
            Displacement {
                component: i,
                value: v,
            },
            Displacement {
                component: j,
                value: w,
            },
        ) if i == j => {
            let meet = a
                .place
                .points
                .iter()
                .any(|point| b.place.points.contains(point));
            if same {
                format!(
                    "the displacement of `{name}` along {} is prescribed twice",
                    AXES[*i]
                )
            } else if meet && v != w {
                let other = &b.place.name;
                format!(
                    "`{name}` and `{other}` meet, and their displacements along {} differ",
                    AXES[*i]
                )
            } else {
                return false;
            }
        }
        (Pressure(_), Pressure(_)) | (Traction(_), Traction(_)) if same => {
            format!("the load on `{name}` is prescribed twice")
        }
        (Displacement { component, .. }, Pressure(_))
        | (Pressure(_), Displacement { component, .. })
            if same =>
        {
            match a.place.kind {
                PlaceKind::Straight(normal) if normal != *component => return false,
                _ => format!(
                    "on `{name}`, displacement along {} and pressure contradict each other",
                    AXES[*component]
                ),
            }
        }
        (Displacement { component, .. }, Traction(traction))
        | (Traction(traction), Displacement { component, .. })
            if same && traction[*component] != Amount::Constant(0.0) =>
        {
            format!(
                "on `{name}`, displacement and traction along {} contradict each other",
                AXES[*component]
            )
        }
        _ => return false,
    };
    reader.report.at(
        &b.path,
        message,
        "remove one of the two conditions".to_owned(),
    );
    true
}
