//! Second gradient: regions that exist, and boundaries on which it is clear what is held of v.

use std::collections::BTreeMap;

use solver_fem::second_gradient::Side;

use super::read::Reader;
use crate::input::boundaries::{Place, PlaceKind, places};
use crate::input::document::{self, Gradient};
use crate::input::mesh::Mesh;
use crate::input::path::Path;
use crate::input::problem::{Amount, Condition, ConditionKind, Region, SecondGradient};
use crate::input::report::suggest;

/// `Some(None)` where there is none; `None` where something is wrong. `regions` and `conditions` are absent where they
/// are wrong themselves.
pub fn read(
    reader: &mut Reader<'_, '_>,
    mesh: Option<&Mesh>,
    regions: Option<&[Region]>,
    conditions: Option<&[Condition]>,
) -> Option<Option<SecondGradient>> {
    let path = Path::root().key("second_gradient");
    let written = gradients(reader);
    if !reader.has(&path) {
        for (_, at, _) in &written {
            reader.report.at_key(
                at,
                "`gradient` says nothing without a second gradient",
                "remove it, or add `second_gradient: { D: … }`".to_owned(),
            );
        }
        return written.is_empty().then_some(None);
    }
    let spec: document::SecondGradient = reader.required(&path)?;
    let mut sound = true;
    for (name, &modulus) in &spec.regions {
        let at = path.key("regions").key(name.as_str());
        let known = regions.map(|all| all.iter().map(|region| region.name.as_str()));
        if let Some(known) = known
            && !known.clone().any(|region| region == name)
        {
            let help = suggest(name, known, "regions");
            let message = format!("there is no region `{name}`");
            reader.report.at_key(&at, message, help);
            sound = false;
        }
        if !(modulus >= 0.0 && modulus.is_finite()) {
            let message = format!("D must not be negative, it is {modulus}");
            reader.report.at(&at, message, None);
            sound = false;
        }
    }
    let places = places(mesh?);
    let mut sides = BTreeMap::new();
    for (on, at, gradient) in written {
        let place = places.iter().find(|place| place.name == on);
        if place.is_some_and(|place| place.kind == PlaceKind::Node) {
            let message = format!("`{on}` names nodes; v is held along a boundary");
            reader.report.at_key(&at, message, None);
            sound = false;
        }
        let side = side(&gradient);
        let known = sides.entry(on.clone()).or_insert_with(|| side.clone());
        if *known != side {
            let message = format!("what is held of v on `{on}` is said twice, and differently");
            reader
                .report
                .at_key(&at, message, "keep one of the two".to_owned());
            sound = false;
        }
        if side == Side::Symmetry && !place.is_none_or(|place| is_held(place, conditions)) {
            let message =
                format!("`{on}` is no plane of symmetry: its normal displacement is not 0");
            reader.report.at_key(&at, message, None);
            sound = false;
        }
    }
    // The sides of a mesh from a file are looked at one by one when the problem is built.
    let imported = matches!(mesh, Some(Mesh::Imported(_)));
    for place in &places {
        sound &= imported || straight(reader, place, conditions, &sides);
        if mesh.is_some_and(|mesh| is_cut(mesh, place)) && is_held(place, conditions) {
            sides.entry(place.name.clone()).or_insert(Side::Symmetry);
        }
    }
    if !sound {
        return None;
    }
    let plain = spec.modulus == 0.0 && spec.regions.values().all(|&modulus| modulus == 0.0);
    Some((!plain).then_some(SecondGradient {
        modulus: spec.modulus,
        regions: spec.regions,
        sides,
    }))
}

/// Boundary, path and value of every `gradient` that is written.
fn gradients(reader: &mut Reader<'_, '_>) -> Vec<(String, Path, Gradient)> {
    let section = Path::root().key("boundary");
    (0..reader.count(&section))
        .filter_map(|index| {
            let path = section.index(index);
            if !reader.has(&path.key("gradient")) {
                return None;
            }
            let written: document::Condition = reader.required(&path)?;
            Some((written.on, path.key("gradient"), written.gradient?))
        })
        .collect()
}

fn side(gradient: &Gradient) -> Side {
    match gradient {
        Gradient::Platen => Side::Platen,
        Gradient::Symmetry => Side::Symmetry,
        Gradient::Free => Side::Free,
        Gradient::Held(components) => Side::Held(components.iter().map(|c| c.indices()).collect()),
    }
}

/// The cuts of a ring are planes of symmetry by their nature.
fn is_cut(mesh: &Mesh, place: &Place) -> bool {
    matches!(mesh, Mesh::Annulus(_)) && matches!(place.kind, PlaceKind::Straight(_))
}

/// Whether the normal displacement of a place is held at zero.
fn is_held(place: &Place, conditions: Option<&[Condition]>) -> bool {
    let PlaceKind::Straight(normal) = place.kind else {
        return false;
    };
    let holds = |condition: &Condition| {
        let kind = ConditionKind::Displacement {
            component: normal,
            value: Amount::Constant(0.0),
        };
        condition.on == place.name && condition.kind == kind
    };
    // Where the conditions are wrong, that is reported already.
    conditions.is_none_or(|all| all.iter().any(holds))
}

/// Reports a curved boundary with a prescribed displacement on which nothing says what is held of v.
fn straight(
    reader: &mut Reader<'_, '_>,
    place: &Place,
    conditions: Option<&[Condition]>,
    sides: &BTreeMap<String, Side>,
) -> bool {
    let moves = |condition: &Condition| {
        let displacement = matches!(condition.kind, ConditionKind::Displacement { .. });
        condition.on == place.name && displacement
    };
    let prescribed = conditions.is_some_and(|all| all.iter().any(moves));
    let unclear = matches!(sides.get(&place.name), None | Some(Side::Platen));
    if place.kind != PlaceKind::Curved || !prescribed || !unclear {
        return true;
    }
    let message = format!(
        "`{}` is curved and its displacement prescribed: what is held of v there does not follow from it",
        place.name
    );
    let help = format!(
        "say it where `{}` is held, as in `gradient: free`",
        place.name
    );
    reader
        .report
        .at_key(&Path::root().key("second_gradient"), message, help);
    false
}
