//! Format 4.1: entities with their physical groups, then nodes and elements in blocks of one entity.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::error::GmshError;
use super::kinds::kind;
use super::raw::{self, Raw, RawElement};
use super::scan::{Encoding, Scanner};

/// Physical groups of the entities, by dimension and number.
type Groups = BTreeMap<(i64, i64), Arc<[u32]>>;

/// The sections behind the header.
pub fn read(scanner: &mut Scanner<'_>) -> Result<Raw, GmshError> {
    let mut raw = Raw::default();
    let mut groups = Groups::new();
    let mut missing = [Some("Nodes"), Some("Elements")];
    let encoding = scanner.encoding;
    while let Some(section) = scanner.next_section()? {
        scanner.encoding = encoding;
        match section.as_str() {
            "PhysicalNames" => {
                scanner.encoding = Encoding::Ascii;
                raw::names(scanner, &mut raw)?;
            }
            "Entities" => entities(scanner, &mut groups)?,
            "PartitionedEntities" => return Err(GmshError::Partitioned),
            "Nodes" => {
                nodes(scanner, &mut raw)?;
                missing[0] = None;
            }
            "Elements" => {
                elements(scanner, &mut raw, &groups)?;
                missing[1] = None;
            }
            _ => {
                scanner.skip_section()?;
                continue;
            }
        }
        scanner.close(&section)?;
    }
    match missing.into_iter().flatten().next() {
        Some(section) => Err(GmshError::NoSection { section }),
        None => Ok(raw),
    }
}

/// Numbers of points, curves, surfaces, volumes; then each: tag, position or box, groups and, but for points, what
/// bounds it.
fn entities(scanner: &mut Scanner<'_>, groups: &mut Groups) -> Result<(), GmshError> {
    let counts = [
        scanner.count()?,
        scanner.count()?,
        scanner.count()?,
        scanner.count()?,
    ];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = scanner.int()?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                scanner.double()?;
            }
            let count = scanner.count()?;
            if count > raw::MOST_GROUPS {
                return Err(scanner.wrong(format!("an entity in {count} physical groups")));
            }
            let mut own = Vec::with_capacity(count);
            for _ in 0..count {
                own.push(raw::group(scanner.int()?));
            }
            if !own.is_empty() {
                groups.insert((dimension as i64, tag), own.into());
            }
            if dimension > 0 {
                for _ in 0..scanner.count()? {
                    scanner.int()?;
                }
            }
        }
    }
    Ok(())
}

/// Numbers of blocks and nodes, least and greatest tag; then blocks: dimension, entity, parametric, number of nodes;
/// their tags, then their positions, with 1 to 3 parameters behind where they are parametric.
fn nodes(scanner: &mut Scanner<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let (blocks, count) = (scanner.count()?, scanner.count()?);
    scanner.count()?;
    scanner.count()?;
    raw.nodes.reserve(scanner.room(count, 8));
    for _ in 0..blocks {
        let dimension = scanner.int()?;
        scanner.int()?;
        let parametric = scanner.int()?;
        let parameters = match (parametric, dimension) {
            (0, _) => 0,
            (1, 0..=3) => dimension,
            _ => return Err(scanner.wrong("a block of nodes begins wrongly")),
        };
        let size = scanner.count()?;
        let mut tags = Vec::with_capacity(scanner.room(size, 2));
        for _ in 0..size {
            tags.push(scanner.long()?);
        }
        for tag in tags {
            raw.nodes.push((tag, scanner.position()?));
            for _ in 0..parameters {
                scanner.double()?;
            }
        }
    }
    Ok(())
}

/// Numbers of blocks and elements, least and greatest tag; then blocks: dimension, entity, kind, number of elements;
/// then each: tag, nodes.
fn elements(scanner: &mut Scanner<'_>, raw: &mut Raw, groups: &Groups) -> Result<(), GmshError> {
    let (blocks, count) = (scanner.count()?, scanner.count()?);
    scanner.count()?;
    scanner.count()?;
    raw.elements.reserve(scanner.room(count, 8));
    for _ in 0..blocks {
        let entity = (scanner.int()?, scanner.int()?);
        let number = scanner.unsigned()?;
        let kind = kind(number)
            .ok_or_else(|| scanner.wrong(format!("elements of kind {number} are not known")))?;
        let own = groups
            .get(&entity)
            .map_or_else(|| Arc::from([]), Arc::clone);
        for _ in 0..scanner.count()? {
            let tag = scanner.long()?;
            let mut nodes = Vec::with_capacity(usize::from(kind.nodes));
            for _ in 0..kind.nodes {
                nodes.push(scanner.long()?);
            }
            raw.elements.push(RawElement {
                tag,
                kind,
                groups: Arc::clone(&own),
                nodes,
            });
        }
    }
    Ok(())
}
