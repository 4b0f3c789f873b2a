//! Materials: `like` followed, laws completed.

use std::path::Path as FilePath;

use serde_json::{Map, Value as Json};

use super::packing;
use super::read::Reader;
use crate::input::document;
use crate::input::path::Path;
use crate::input::problem::{Elastic, Law, Material, Rev};
use crate::input::report::suggest;

/// The materials of the input in alphabetical order.
pub struct Materials {
    names: Vec<String>,
    resolved: Vec<Option<Material>>,
    known: bool,
}

impl Materials {
    pub fn read(reader: &mut Reader<'_, '_>, base: &FilePath) -> Self {
        let section = Path::root().key("materials");
        let keys = reader.keys(&section);
        let known = keys.is_some();
        let mut names = keys.unwrap_or_default();
        names.sort();
        if known && names.is_empty() {
            reader.report.at(
                &section,
                "there is no material",
                "add one, as in `sand: { rev: {} }`".to_owned(),
            );
        }
        let resolved = names
            .iter()
            .map(|name| material(reader, &section, name, &names, base))
            .collect();
        Self {
            names,
            resolved,
            known,
        }
    }

    /// All of them, if all are good.
    pub fn into_resolved(self) -> Option<Vec<Material>> {
        self.resolved.into_iter().collect()
    }

    /// The material at `index`, if it is good.
    pub fn get(&self, index: usize) -> Option<&Material> {
        self.resolved.get(index)?.as_ref()
    }

    /// The index of the material named at `path`.
    pub fn find(&self, reader: &mut Reader<'_, '_>, path: &Path, name: &str) -> Option<usize> {
        let found = self.names.iter().position(|known| known == name);
        if found.is_none() && self.known {
            let help = suggest(name, self.names.iter().map(String::as_str), "materials");
            reader
                .report
                .at(path, format!("there is no material `{name}`"), help);
        }
        found
    }

    /// The index of the material named by `material`, or of the only one.
    pub fn default(&self, reader: &mut Reader<'_, '_>) -> Option<usize> {
        let path = Path::root().key("material");
        if reader.has(&path) {
            let name: String = reader.required(&path)?;
            return self.find(reader, &path, &name);
        }
        if self.names.len() > 1 {
            let message = "there are several materials, and `material` does not say which one is the usual one";
            let help = format!("add `material: {}`, for example", self.names[0]);
            reader
                .report
                .at(&Path::root().key("materials"), message, help);
        }
        (self.names.len() == 1).then_some(0)
    }
}

fn material(
    reader: &mut Reader<'_, '_>,
    section: &Path,
    name: &str,
    names: &[String],
    base: &FilePath,
) -> Option<Material> {
    let path = section.key(name);
    let merged = merge(reader, section, name, names)?;
    let written: document::Material = reader.value(Json::Object(merged), &path)?;
    let law = match (written.rev, written.elastic) {
        (Some(rev), None) => Law::Rev(resolve_rev(reader, &path.key("rev"), rev, base)?),
        (None, Some(elastic)) => {
            Law::Elastic(resolve_elastic(reader, &path.key("elastic"), &elastic)?)
        }
        (Some(_), Some(_)) => {
            let message = format!("material `{name}` is both `rev` and `elastic`");
            reader
                .report
                .at_key(&path, message, "keep one; `like` counts too".to_owned());
            return None;
        }
        (None, None) if reader.is_misspelt(&path) => return None,
        (None, None) => {
            let help = "add `rev: {}` or `elastic: { young: …, poisson: … }`".to_owned();
            reader.report.at_key(
                &path,
                format!("material `{name}` is neither `rev` nor `elastic`"),
                help,
            );
            return None;
        }
    };
    Some(Material {
        name: name.to_owned(),
        law,
    })
}

/// The material as written, laid over the one it is like.
fn merge(
    reader: &mut Reader<'_, '_>,
    section: &Path,
    name: &str,
    names: &[String],
) -> Option<Map<String, Json>> {
    let mut layers = Vec::new();
    let mut trail = vec![name.to_owned()];
    let mut current = name.to_owned();
    loop {
        let path = section.key(current.as_str());
        let Some(Json::Object(mut layer)) = reader.json(&path) else {
            return None;
        };
        let like = layer.remove("like");
        layers.push(layer);
        let Some(like) = like.as_ref().and_then(Json::as_str) else {
            break;
        };
        // What is wrong with the `like` of another material is reported there.
        let own = current == name;
        if !names.iter().any(|known| known == like) {
            if own {
                let help = suggest(like, names.iter().map(String::as_str), "materials");
                reader.report.at(
                    &path.key("like"),
                    format!("there is no material `{like}`"),
                    help,
                );
            }
            return None;
        }
        if trail.iter().any(|known| known == like) {
            if like == name {
                trail.push(like.to_owned());
                let message = format!("`like` runs in a circle: {}", trail.join(" → "));
                let own_like = section.key(name).key("like");
                reader.report.at(
                    &own_like,
                    message,
                    "one of them must stand by itself".to_owned(),
                );
            }
            return None;
        }
        trail.push(like.to_owned());
        current = like.to_owned();
    }
    Some(layers.into_iter().rev().fold(Map::new(), overlay))
}

/// `over` replaces `under` key by key, inside maps too.
fn overlay(mut under: Map<String, Json>, over: Map<String, Json>) -> Map<String, Json> {
    for (key, value) in over {
        let value = match (under.remove(&key), value) {
            (Some(Json::Object(below)), Json::Object(above)) => Json::Object(overlay(below, above)),
            (_, value) => value,
        };
        under.insert(key, value);
    }
    under
}

fn resolve_rev(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    rev: document::Rev,
    base: &FilePath,
) -> Option<Rev> {
    let origin = packing::origin(reader, path, &rev, base);
    let idle = rev.friction_scatter > 0.0 && rev.friction == 0.0;
    if idle {
        let scatter = path.key("friction_scatter");
        let message = "a friction of 0 has nothing to scatter".to_owned();
        match reader.has(&scatter) {
            true => {
                let help = "remove `friction_scatter`, or give the grains a `friction`";
                reader.report.at_key(&scatter, message, help.to_owned());
            }
            false => {
                let help = "add `friction_scatter: 0`: it is taken over by `like`";
                reader.report.at_key(path, message, help.to_owned());
            }
        }
    }
    let origin = origin.filter(|_| !idle)?;
    Some(Rev {
        origin,
        confining_stress: rev.confining_stress,
        stiffness: rev.stiffness,
        tangential_stiffness: rev.tangential_stiffness,
        friction: rev.friction,
        cohesion_ratio: rev.cohesion_ratio,
        packings: rev.packings,
        seed: rev.seed,
        friction_scatter: rev.friction_scatter,
    })
}

fn resolve_elastic(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    elastic: &document::Elastic,
) -> Option<Elastic> {
    for (key, value) in [("young", elastic.young), ("poisson", elastic.poisson)] {
        if value.is_none() {
            reader.report.at(
                path,
                format!("the key `{key}` is missing in `{path}`"),
                format!("add `{key}: …`"),
            );
        }
    }
    Some(Elastic {
        young: elastic.young?,
        poisson: elastic.poisson?,
        initial_stress: elastic.initial_stress,
    })
}
