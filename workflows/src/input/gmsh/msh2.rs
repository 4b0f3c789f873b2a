//! Format 2.2: one flat list of nodes, one of elements, each with its tags.

use super::error::GmshError;
use super::kinds::{Kind, kind};
use super::raw::{self, Raw, RawElement};
use super::scan::{Encoding, Scanner};

/// The sections behind the header.
pub fn read(scanner: &mut Scanner<'_>) -> Result<Raw, GmshError> {
    let mut raw = Raw::default();
    let mut missing = [Some("Nodes"), Some("Elements")];
    let encoding = scanner.encoding;
    while let Some(section) = scanner.next_section()? {
        scanner.encoding = encoding;
        match section.as_str() {
            "PhysicalNames" => {
                scanner.encoding = Encoding::Ascii;
                raw::names(scanner, &mut raw)?;
            }
            "Nodes" => {
                nodes(scanner, &mut raw)?;
                missing[0] = None;
            }
            "Elements" => {
                elements(scanner, &mut raw)?;
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

/// `number`, then `tag x y z` each; the number is text in every encoding.
fn nodes(scanner: &mut Scanner<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let count = scanner.word_count()?;
    scanner.end_line();
    raw.nodes.reserve(scanner.room(count, 8));
    for _ in 0..count {
        let tag = scanner.unsigned()?;
        raw.nodes.push((u64::from(tag), scanner.position()?));
    }
    Ok(())
}

/// `number`, then as text `tag kind tags… nodes…` each, in binary blocks of one kind: `kind count tags`, then
/// `tag tags… nodes…` each. Tags: physical group (0 is none), entity, number of partitions and these, which are nothing
/// to us: the mesh is whole.
fn elements(scanner: &mut Scanner<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let count = scanner.word_count()?;
    scanner.end_line();
    raw.elements.reserve(scanner.room(count, 8));
    let mut left = count;
    while left > 0 {
        if scanner.encoding == Encoding::Ascii {
            let tag = scanner.unsigned()?;
            let kind = element_kind(scanner)?;
            let tags = scanner.unsigned()?;
            element(scanner, raw, tag, kind, tags)?;
            left -= 1;
            continue;
        }
        let kind = element_kind(scanner)?;
        let (block, tags) = (scanner.unsigned()?, scanner.unsigned()?);
        if block == 0 || block as usize > left {
            let what = format!("a block of {block} elements, where {left} are left");
            return Err(scanner.wrong(what));
        }
        for _ in 0..block {
            let tag = scanner.unsigned()?;
            element(scanner, raw, tag, kind, tags)?;
        }
        left -= block as usize;
    }
    Ok(())
}

fn element_kind(scanner: &mut Scanner<'_>) -> Result<Kind, GmshError> {
    let number = scanner.unsigned()?;
    kind(number).ok_or_else(|| scanner.wrong(format!("elements of kind {number} are not known")))
}

fn element(
    scanner: &mut Scanner<'_>,
    raw: &mut Raw,
    tag: u32,
    kind: Kind,
    tags: u32,
) -> Result<(), GmshError> {
    let mut group = None;
    for place in 0..tags {
        let value = scanner.int()?;
        match place {
            0 if value != 0 => group = Some(raw::group(value)),
            _ => {}
        }
    }
    let mut nodes = Vec::with_capacity(usize::from(kind.nodes));
    for _ in 0..kind.nodes {
        nodes.push(u64::from(scanner.unsigned()?));
    }
    raw.elements.push(RawElement {
        tag: u64::from(tag),
        kind,
        groups: group.into_iter().collect(),
        nodes,
    });
    Ok(())
}
