//! What makes a body inhomogeneous by the user's choice. Without it identical REVs in a homogeneous field stay alike as far
//! as the tolerances go, and where a band begins is chance.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{draw::scattered_friction, error::RunError, text};
use crate::input::{
    Packings, Problem,
    body::{self, Divided},
    derive::catalogue,
    problem::{Body, Law, Material, Model, Origin, Rev},
};

/// One reason why bands may form here rather than there.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Trigger {
    /// Elements of another material than most.
    Region {
        /// The region that says so; `None` for elements outside of all regions.
        region: Option<String>,
        /// How many elements have their material from it.
        elements: usize,
        /// Their material.
        material: String,
        /// The material of most elements.
        against: String,
        /// What differs between the two; empty where one has grains and the other none.
        differs: Vec<Difference>,
    },
    /// Elements or Gauss points of one material with different packings.
    Packings {
        /// The material.
        material: String,
        /// Who gets which.
        packings: Packings,
    },
    /// Elements of one material with different friction.
    FrictionScatter {
        /// The material.
        material: String,
        /// Largest relative deviation from the material's friction.
        scatter: f64,
        /// The element with the lowest friction.
        least: Extreme,
        /// The element with the highest.
        most: Extreme,
    },
}

/// A key of two materials, and its values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The key, as in `friction`.
    pub key: String,
    /// Its value here.
    pub value: String,
    /// Its value in most elements.
    pub against: String,
}

/// The friction of an element.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Extreme {
    /// Number of the element.
    pub element: u64,
    /// Its friction.
    pub friction: f64,
}

/// The triggers of a body with grains; `None` for an element test, and for a body without, in which nothing localises.
///
/// # Errors
/// The mesh cannot be built.
pub fn triggers(problem: &Problem) -> Result<Option<Vec<Trigger>>, RunError> {
    let Model::Body(body) = &problem.model else {
        return Ok(None);
    };
    let divided = body::divided(body)?;
    let used = elements_by_material(&divided);
    let revs: Vec<(&Material, &Rev, &[u64])> = used
        .iter()
        .filter_map(|(&index, elements)| match &problem.materials[index].law {
            Law::Rev(rev) => Some((&problem.materials[index], rev, elements.as_slice())),
            Law::Elastic(_) => None,
        })
        .collect();
    if revs.is_empty() {
        return Ok(None);
    }
    let mut found = regions(problem, body, &divided, &used);
    let per_element = body.mesh.points_per_element();
    let dealt = revs
        .iter()
        .filter(|(_, rev, elements)| differ(rev, elements.len(), per_element));
    found.extend(dealt.map(|(material, rev, _)| Trigger::Packings {
        material: material.name.clone(),
        packings: rev.packings,
    }));
    found.extend(
        revs.iter()
            .filter_map(|&(material, rev, elements)| scatter(material, rev, elements)),
    );
    Ok(Some(found))
}

/// The elements of each material that has some.
fn elements_by_material(divided: &Divided) -> BTreeMap<usize, Vec<u64>> {
    let mut used: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
    for (&material, element) in divided.materials.iter().zip(0..) {
        used.entry(material).or_default().push(element);
    }
    used
}

/// Parts of the body whose material is not that of most elements.
fn regions(
    problem: &Problem,
    body: &Body,
    divided: &Divided,
    used: &BTreeMap<usize, Vec<u64>>,
) -> Vec<Trigger> {
    let count = |(index, elements): &(&usize, &Vec<u64>)| {
        // The first of several that have as many.
        (elements.len(), std::cmp::Reverse(**index))
    };
    let Some((&usual, _)) = used.iter().max_by_key(count) else {
        return Vec::new();
    };
    let mut parts: BTreeMap<(Option<usize>, usize), usize> = BTreeMap::new();
    for (&region, &material) in divided.regions.iter().zip(&divided.materials) {
        *parts.entry((region, material)).or_default() += 1;
    }
    let others = parts
        .into_iter()
        .filter(|((_, material), _)| *material != usual);
    others
        .filter_map(|((region, material), elements)| {
            let [here, there] = [material, usual].map(|index| &problem.materials[index]);
            let differs = differences(problem, here, there)?;
            Some(Trigger::Region {
                region: region.map(|index| body.regions[index].name.clone()),
                elements,
                material: here.name.clone(),
                against: there.name.clone(),
                differs,
            })
        })
        .collect()
}

/// The keys in which two materials differ, none where they are of different kinds. `None` for two of the same content.
fn differences(problem: &Problem, here: &Material, there: &Material) -> Option<Vec<Difference>> {
    if std::mem::discriminant(&here.law) != std::mem::discriminant(&there.law) {
        return Some(Vec::new());
    }
    let all = catalogue(problem, &BTreeMap::new());
    let of = |material: &Material| -> BTreeMap<&str, &str> {
        let prefixes =
            ["rev", "elastic"].map(|kind| format!("materials.{}.{kind}.", material.name));
        let entries = all.iter().filter_map(|(key, entry)| {
            let name = prefixes
                .iter()
                .find_map(|prefix| key.strip_prefix(prefix.as_str()))?;
            Some((name, entry.value.as_str()))
        });
        entries.collect()
    };
    let (here, there) = (of(here), of(there));
    let keys: std::collections::BTreeSet<&&str> = here.keys().chain(there.keys()).collect();
    let value =
        |of: &BTreeMap<&str, &str>, key: &str| of.get(key).copied().unwrap_or("nothing").to_owned();
    let found: Vec<Difference> = keys
        .into_iter()
        .map(|key| Difference {
            key: (*key).to_owned(),
            value: value(&here, key),
            against: value(&there, key),
        })
        .filter(|difference| difference.value != difference.against)
        .collect();
    (!found.is_empty()).then_some(found)
}

/// Whether `packings` deals different ones to so many elements of a material.
fn differ(rev: &Rev, elements: usize, per_element: usize) -> bool {
    // One from a file is the same for all.
    matches!(rev.origin, Origin::Prepared(_))
        && match rev.packings {
            Packings::Shared => false,
            Packings::Gallery(size) => size > 1 && elements * per_element > 1,
            Packings::OnePerElement => elements > 1,
            Packings::OnePerGaussPoint => elements * per_element > 1,
        }
}

fn scatter(material: &Material, rev: &Rev, elements: &[u64]) -> Option<Trigger> {
    if rev.friction_scatter == 0.0 || elements.len() < 2 {
        return None;
    }
    let each = elements.iter().map(|&element| Extreme {
        element,
        friction: scattered_friction(rev.friction, rev.friction_scatter, rev.seed, element),
    });
    let by_friction = |a: &Extreme, b: &Extreme| a.friction.total_cmp(&b.friction);
    Some(Trigger::FrictionScatter {
        material: material.name.clone(),
        scatter: rev.friction_scatter,
        least: each.clone().min_by(by_friction)?,
        most: each.max_by(by_friction)?,
    })
}

impl Trigger {
    /// The trigger in a line.
    pub fn in_words(&self) -> String {
        match self {
            Self::Region {
                region,
                elements,
                material,
                against,
                differs,
            } => {
                let whose = match region {
                    Some(region) => format!("region `{region}`"),
                    None => "what is in no region".to_owned(),
                };
                let count = text::count(*elements, "element");
                let how = match differs.as_slice() {
                    [] => format!("`{material}` among `{against}`"),
                    differs => {
                        let each: Vec<String> = differs
                            .iter()
                            .map(|d| format!("{} {} against {}", d.key, d.value, d.against))
                            .collect();
                        each.join(", ")
                    }
                };
                format!("{whose} ({count}, {how})")
            }
            Self::Packings { material, packings } => {
                let how = match packings {
                    Packings::Shared => "one packing for all".to_owned(),
                    Packings::Gallery(size) => format!("{size} packings dealt out"),
                    Packings::OnePerElement => "one packing per element".to_owned(),
                    Packings::OnePerGaussPoint => "one packing per Gauss point".to_owned(),
                };
                format!("{how} (`{material}`)")
            }
            Self::FrictionScatter {
                material,
                scatter,
                least,
                most,
            } => format!(
                "friction scattered by ±{} (`{material}`), from {:.4} in e{} to {:.4} in e{}",
                percent(*scatter),
                least.friction,
                least.element,
                most.friction,
                most.element,
            ),
        }
    }
}

/// A share as people write it: `5 %`.
pub fn percent(share: f64) -> String {
    // Without the digits that a percentage of a decimal fraction is rounded to.
    format!("{} %", (100.0 * share * 1e9).round() / 1e9)
}

/// What is said where there is none.
pub const NONE: &str =
    "none: identical REVs, which in a homogeneous field only the tolerances set apart";

/// The triggers in lines, one each; empty where the question does not arise.
pub fn in_lines(triggers: Option<&[Trigger]>) -> Vec<String> {
    match triggers {
        None => Vec::new(),
        Some([]) => vec![NONE.to_owned()],
        Some(triggers) => triggers.iter().map(Trigger::in_words).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines about a body of 2×2 elements with these materials and regions; most of it is `sand`.
    fn of(materials: &str, regions: &str) -> Vec<String> {
        let text = format!(
            "name: t\nmesh: {{ rectangle: {{ size: [1.0, 1.0], elements: [2, 2] }} }}\n\
             materials: {{ {materials} }}\nmaterial: sand\nregions: [ {regions} ]\nloads: {{ side: 1 }}\n\
             boundary:\n  - {{ on: bottom, displacement: {{ y: 0 }} }}\n  - {{ on: left, displacement: {{ x: 0 }} }}\n  \
             - {{ on: top, pressure: 1 }}\n  - {{ on: right, pressure: side }}\n\
             programme: [ {{ name: a, ramp: {{ side: 2 }}, steps: 1 }} ]\n"
        );
        let problem = crate::input::parse(&text, "t.yaml", std::path::Path::new("."));
        let problem = problem.unwrap_or_else(|errors| panic!("{errors}"));
        in_lines(triggers(&problem).unwrap().as_deref())
    }

    #[test]
    fn a_region_is_told_by_what_differs_and_where_regions_overlap_by_what_holds() {
        let materials = "sand: { rev: {} }, weak: { like: sand, rev: { friction: 0.4, seed: 2 } }, \
                         rock: { elastic: { young: 100, poisson: 0.2 } }";
        let regions = "{ name: first, elements: [0, 1], material: weak }, \
                       { name: second, elements: [1], material: rock }";
        assert_eq!(
            of(materials, regions),
            [
                "region `first` (1 element, friction 0.4 against 0.5, seed 2 against 1)",
                "region `second` (1 element, `rock` among `sand`)",
            ]
        );
    }

    #[test]
    fn what_is_alike_is_no_trigger_whatever_it_is_called() {
        let twin = "sand: { rev: {} }, twin: { like: sand }";
        let region = "{ name: part, elements: [0], material: twin }";
        assert_eq!(of(twin, region), [NONE]);
        let one = "sand: { rev: { packings: { gallery: 1 } } }";
        assert_eq!(of(one, ""), [NONE]);
    }

    #[test]
    fn the_material_of_most_elements_is_the_usual_one() {
        let materials = "sand: { rev: { friction: 0.4 } }, hard: { rev: {} }";
        let region = "{ name: most, elements: [0, 1, 2], material: hard }";
        assert_eq!(
            of(materials, region),
            ["what is in no region (1 element, friction 0.4 against 0.5)"]
        );
    }

    #[test]
    fn a_body_without_grains_has_no_question_to_answer() {
        let rock = "sand: { elastic: { young: 100, poisson: 0.2, initial_stress: -1 } }";
        assert_eq!(of(rock, ""), Vec::<String>::new());
    }
}
