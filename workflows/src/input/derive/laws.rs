//! Contact laws and elastic constants that a rerun replaces.

use serde_json::Value as Json;

use super::catalogue::like;
use crate::input::path::Path;
use crate::input::problem::{Law, Material, Problem};
use crate::input::report::{list, suggest};
use crate::input::resolve::Reader;
use crate::input::tree::{self, Node};

/// The keys of a grain material that make sense with states that are there already.
const REV_KEYS: [&str; 5] = [
    "stiffness",
    "tangential_stiffness",
    "friction",
    "friction_scatter",
    "cohesion_ratio",
];
/// The same for an elastic one.
const ELASTIC_KEYS: [&str; 2] = ["young", "poisson"];

/// Lays the `materials` of a change over those of `problem`; what is wrong goes into the report.
pub fn apply(reader: &mut Reader<'_, '_>, problem: &mut Problem) {
    let section = Path::root().key("materials");
    let before = problem.materials.clone();
    let tree = tree::read(&problem.source, &mut Vec::new());
    for name in reader.keys(&section).unwrap_or_default() {
        let path = section.key(name.as_str());
        let Some(index) = before.iter().position(|material| material.name == name) else {
            let names = before.iter().map(|material| material.name.as_str());
            let help = suggest(&name, names, "materials");
            let message = format!("there is no material `{name}`");
            reader.report.at_key(&path, message, help);
            continue;
        };
        for kind in reader.keys(&path).unwrap_or_default() {
            let path = path.key(kind.as_str());
            let allowed: &[&str] = match (kind.as_str(), &before[index].law) {
                ("rev", Law::Rev(_)) => &REV_KEYS,
                ("elastic", Law::Elastic(_)) => &ELASTIC_KEYS,
                _ if reader.unknown.contains(&path) => continue,
                _ => {
                    let message =
                        format!("material `{name}` cannot become another kind of material");
                    let help = "another material needs a run of its own: `femdem-flow submit FILE`";
                    reader.report.at_key(&path, message, help.to_owned());
                    continue;
                }
            };
            for key in reader.keys(&path).unwrap_or_default() {
                let place = path.key(key.as_str());
                if reader.unknown.contains(&place) {
                    continue;
                }
                if !allowed.contains(&key.as_str()) {
                    let message = format!(
                        "`{key}` makes other grains than those in the stored states of `{name}`"
                    );
                    let help = format!(
                        "a rerun can change {}; for anything else `femdem-flow submit FILE`",
                        list(allowed.iter().copied())
                    );
                    reader.report.at_key(&place, message, help);
                    continue;
                }
                if let Some(value) = reader.json(&place).as_ref().and_then(Json::as_f64) {
                    set(&mut problem.materials[index], &key, value);
                    let tree = tree.as_ref();
                    for follower in followers(&before, tree, index, &kind, &key) {
                        set(&mut problem.materials[follower], &key, value);
                    }
                }
            }
            // Not at each key: one may make up for the other.
            if nothing_to_scatter(&problem.materials[index]) {
                let message = format!("`{name}` is left without a friction to scatter");
                let help = "set `friction_scatter` to 0, or `friction` to more".to_owned();
                reader.report.at_key(&path, message, help);
            }
        }
    }
}

/// The materials that take this very value over from material `index` by `like`.
fn followers(
    materials: &[Material],
    tree: Option<&Node>,
    index: usize,
    kind: &str,
    key: &str,
) -> Vec<usize> {
    let Some(tree) = tree else { return Vec::new() };
    let leader = &materials[index];
    let takes_over = |material: &Material| {
        let mut current = material.name.clone();
        for _ in 0..materials.len() {
            let written = Path::root()
                .key("materials")
                .key(current.as_str())
                .key(kind)
                .key(key);
            if tree.locate(&written).is_some() {
                return false;
            }
            match like(tree, &current) {
                Some(next) if next == leader.name => return true,
                Some(next) => current = next,
                None => return false,
            }
        }
        false
    };
    // One that an earlier rerun has set apart follows no more.
    (0..materials.len())
        .filter(|&other| other != index && takes_over(&materials[other]))
        .filter(|&other| get(&materials[other], key) == get(leader, key))
        .collect()
}

/// Whether a scatter is asked for that has no effect.
fn nothing_to_scatter(material: &Material) -> bool {
    matches!(&material.law, Law::Rev(rev) if rev.friction_scatter > 0.0 && rev.friction == 0.0)
}

fn get(material: &Material, key: &str) -> Option<f64> {
    field(&mut material.clone(), key).copied()
}

fn set(material: &mut Material, key: &str, value: f64) {
    if let Some(field) = field(material, key) {
        *field = value;
    }
}

fn field<'m>(material: &'m mut Material, key: &str) -> Option<&'m mut f64> {
    match (&mut material.law, key) {
        (Law::Rev(rev), "stiffness") => Some(&mut rev.stiffness),
        (Law::Rev(rev), "tangential_stiffness") => Some(&mut rev.tangential_stiffness),
        (Law::Rev(rev), "friction") => Some(&mut rev.friction),
        (Law::Rev(rev), "friction_scatter") => Some(&mut rev.friction_scatter),
        (Law::Rev(rev), "cohesion_ratio") => Some(&mut rev.cohesion_ratio),
        (Law::Elastic(elastic), "young") => Some(&mut elastic.young),
        (Law::Elastic(elastic), "poisson") => Some(&mut elastic.poisson),
        _ => None,
    }
}
