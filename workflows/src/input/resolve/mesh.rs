//! Mesh and regions: elements of no size, numbers that are not in the mesh, regions of no material.

use std::path::Path as FilePath;
use std::sync::Arc;

use super::materials::Materials;
use super::read::Reader;
use crate::input::document::{self, Annulus};
use crate::input::gmsh;
use crate::input::mesh::Mesh;
use crate::input::path::Path;
use crate::input::problem::{Region, Selection};
use crate::input::report::suggest;

/// The most elements of one mesh.
pub const MOST_ELEMENTS: u64 = 1_000_000;

/// Shortest over longest radial length of an element in a ring, below which it counts as having no area.
const THINNEST: f64 = 1e-9;

/// The largest mesh file that is read, in bytes: a million elements take some hundred.
const LARGEST_FILE: u64 = 1 << 30;

pub fn read(reader: &mut Reader<'_, '_>, base: &FilePath) -> Option<Mesh> {
    let path = Path::root().key("mesh");
    match reader.required::<document::Mesh>(&path)? {
        // A size or a number of elements that is not positive fails the schema, and then nothing can be built on it.
        document::Mesh::Rectangle(rectangle) => {
            let positive = rectangle.size.iter().all(|&side| side > 0.0);
            let mesh = Mesh::Rectangle(rectangle);
            check_count(reader, &path.key("rectangle"), &mesh);
            (positive && mesh.element_count() > 0).then_some(mesh)
        }
        document::Mesh::Annulus(annulus) => {
            let path = path.key("annulus");
            let good = annulus_is_good(reader, &path, &annulus);
            let mesh = Mesh::Annulus(annulus);
            check_count(reader, &path, &mesh);
            good.then_some(mesh)
        }
        document::Mesh::Gmsh(written) => imported(reader, &path.key("gmsh"), &written, base),
    }
}

fn check_count(reader: &mut Reader<'_, '_>, path: &Path, mesh: &Mesh) {
    let count = mesh.element_count();
    if count > MOST_ELEMENTS {
        let message =
            format!("the mesh has {count} elements, at most {MOST_ELEMENTS} can be handled");
        reader.report.at(&path.key("elements"), message, None);
    }
}

/// The mesh in a file of Gmsh.
fn imported(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &document::Gmsh,
    base: &FilePath,
) -> Option<Mesh> {
    let place = path.key("file");
    let full = base.join(&written.file);
    let mut refuse = |message: String, help: Option<String>| {
        reader.report.at(&place, message, help);
    };
    let file = &written.file;
    let where_ = || {
        format!(
            "it is looked for at {}, relative to the folder of the input",
            full.display()
        )
    };
    let length = match std::fs::metadata(&full) {
        Ok(metadata) if metadata.is_file() => metadata.len(),
        _ => {
            refuse(format!("there is no file `{file}`"), Some(where_()));
            return None;
        }
    };
    if length > LARGEST_FILE {
        let message = format!("`{file}` has {length} bytes, a mesh file at most {LARGEST_FILE}");
        refuse(message, None);
        return None;
    }
    let bytes = match std::fs::read(&full) {
        Ok(bytes) => bytes,
        Err(error) => {
            refuse(format!("cannot read `{file}`: {error}"), Some(where_()));
            return None;
        }
    };
    let mut mesh = match gmsh::read(&bytes, file) {
        Ok(mesh) => mesh,
        Err(errors) => {
            for error in errors.0 {
                let help = error.help().map(str::to_owned);
                refuse(format!("`{file}`: {error}"), help);
            }
            return None;
        }
    };
    if let Some(element) = written.element {
        if element.plane().node_count() != mesh.element.plane().node_count() {
            let message = format!(
                "`{file}` has {} elements, not {}",
                mesh.element.in_words(),
                element.in_words()
            );
            let help = "leave `element` out, or make the mesh with those elements".to_owned();
            reader.report.at(&path.key("element"), message, help);
            return None;
        }
        mesh.element = element;
    }
    Some(Mesh::Imported(Arc::new(mesh)))
}

fn annulus_is_good(reader: &mut Reader<'_, '_>, path: &Path, ring: &Annulus) -> bool {
    if ring.inner_radius >= ring.outer_radius && ring.inner_radius > 0.0 && ring.outer_radius > 0.0
    {
        let message = format!(
            "the elements have no area: `outer_radius` {} does not exceed `inner_radius` {}",
            ring.outer_radius, ring.inner_radius
        );
        reader.report.at(
            &path.key("outer_radius"),
            message,
            "the cavity is the smaller one".to_owned(),
        );
        return false;
    }
    let contrast = ring.growth.ln().abs() * f64::from(ring.elements[1].saturating_sub(1));
    if ring.growth > 0.0 && contrast > -THINNEST.ln() {
        let message = format!(
            "the elements at one end have no area: growth {} over {} elements",
            ring.growth, ring.elements[1]
        );
        reader.report.at(
            &path.key("growth"),
            message,
            "bring it nearer to 1, or take fewer elements".to_owned(),
        );
        return false;
    }
    let least = match ring.sector {
        document::Sector::Quarter => 1,
        document::Sector::Half => 2,
        document::Sector::Full => 3,
    };
    if ring.elements[0] > 0 && ring.elements[0] < least {
        let message = format!(
            "{} elements cannot close this ring, it takes at least {least}",
            ring.elements[0]
        );
        reader
            .report
            .at(&path.key("elements").index(0), message, None);
        return false;
    }
    ring.inner_radius > 0.0
        && ring.outer_radius > 0.0
        && ring.growth > 0.0
        && ring.elements.iter().all(|&n| n > 0)
}

/// The regions; `mesh` is absent where it is wrong.
pub fn regions(
    reader: &mut Reader<'_, '_>,
    mesh: Option<&Mesh>,
    materials: &Materials,
) -> Option<Vec<Region>> {
    let section = Path::root().key("regions");
    let mut seen: Vec<String> = Vec::new();
    let mut regions = Some(Vec::new());
    if reader.has(&section) && reader.keys(&section).is_some() {
        return None;
    }
    for index in 0..reader.count(&section) {
        let path = section.index(index);
        let region = region(reader, &path, mesh, materials, &mut seen);
        regions = regions.zip(region).map(|(mut regions, region)| {
            regions.push(region);
            regions
        });
    }
    regions
}

fn region(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    mesh: Option<&Mesh>,
    materials: &Materials,
    seen: &mut Vec<String>,
) -> Option<Region> {
    let written: document::Region = reader.required(path)?;
    if seen.contains(&written.name) {
        let message = format!("there are two regions `{}`", written.name);
        reader.report.at(
            &path.key("name"),
            message,
            "give each its own name".to_owned(),
        );
    }
    seen.push(written.name.clone());
    let material = materials.find(reader, &path.key("material"), &written.material);
    let selection = match (written.elements, written.within, written.group) {
        (Some(elements), None, None) => {
            check_elements(reader, &path.key("elements"), &elements, mesh);
            let numbers = elements
                .into_iter()
                .map(|element| u32::try_from(element).ok());
            numbers.collect::<Option<_>>().map(Selection::Elements)
        }
        (None, None, Some(name)) => group(reader, &path.key("group"), &name, mesh),
        (None, Some(within), None) => {
            for axis in 0..2 {
                if within.from[axis] > within.to[axis] {
                    let message = format!(
                        "the box is empty: from {} to {}",
                        within.from[axis], within.to[axis]
                    );
                    let help = "`from` is the corner of least coordinates".to_owned();
                    reader
                        .report
                        .at(&path.key("box").key("to").index(axis), message, help);
                }
            }
            Some(Selection::Box(within))
        }
        (None, None, None) if reader.is_misspelt(path) => None,
        _ => {
            let message = format!(
                "region `{}` must be given by exactly one of `elements`, `box` and `group`",
                written.name
            );
            reader.report.at(path, message, None);
            None
        }
    };
    Some(Region {
        name: written.name,
        material: material?,
        selection: selection?,
    })
}

/// The elements of a group of the mesh file.
fn group(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    name: &str,
    mesh: Option<&Mesh>,
) -> Option<Selection> {
    let Mesh::Imported(imported) = mesh? else {
        let help = "choose by `elements` or by `box`".to_owned();
        let message = "groups come with the mesh of a file; this mesh has none";
        reader.report.at(path, message, help);
        return None;
    };
    match imported.groups.get(name) {
        Some(elements) => Some(Selection::Elements(elements.clone())),
        None => {
            let known = imported.groups.keys().map(String::as_str);
            let help = suggest(name, known, "groups of surfaces");
            let message = format!("`{}` has no group of surfaces `{name}`", imported.file);
            reader.report.at(path, message, help);
            None
        }
    }
}

fn check_elements(reader: &mut Reader<'_, '_>, path: &Path, elements: &[i64], mesh: Option<&Mesh>) {
    let Some(count) = mesh.map(Mesh::element_count) else {
        return;
    };
    for (index, &element) in elements.iter().enumerate() {
        // A negative number fails the schema.
        if u64::try_from(element).is_ok_and(|element| element >= count) {
            let help = format!(
                "the mesh has {count} elements, numbered from 0 to {}",
                count.saturating_sub(1)
            );
            reader.report.at(
                &path.index(index),
                format!("there is no element {element}"),
                help,
            );
        }
    }
}
