//! What the schema cannot say: names that refer to nothing, contradictions, files that are not there; and from there
//! the resolved form of the input.
//!
//! Every part is read by itself and left out where it is already known to be wrong, so that one mistake does not hide
//! the others and is not reported twice.

mod conditions;
mod element_test;
mod follow;
mod loads;
mod materials;
mod mesh;
mod packing;
mod programme;
mod read;
mod rigid;
mod second_gradient;
mod subject;
mod until;

use std::collections::BTreeSet;
use std::path::Path as FilePath;

pub use self::loads::Loads;
use self::materials::Materials;
pub use self::programme::read as read_programme;
pub use self::read::Reader;
pub use self::subject::Subject;
use super::document::{OutputSettings, SolverSettings};
use super::path::Path;
use super::problem::{Body, Model, Problem};
use super::report::Report;
use crate::address::RunName;

/// Resolves the tree of `report`, skipping the keys in `unknown`. `None` exactly where the report is not clean.
pub fn resolve(
    report: &mut Report<'_>,
    unknown: &BTreeSet<Path>,
    source: &str,
    base: &FilePath,
) -> Option<Problem> {
    let mut reader = Reader { report, unknown };
    let root = Path::root();
    let name = run_name(&mut reader);
    let mut loads = Loads::read(&mut reader);
    let materials = Materials::read(&mut reader, base);
    let model = model(&mut reader, &mut loads, &materials, base);
    let count = loads.names().count();
    let subject = model.as_ref().map(|model| Subject::of(model, count));
    let programme = programme::read(&mut reader, &mut loads, subject.as_ref());
    let solver: Option<SolverSettings> = reader.optional(&root.key("solver"));
    if let Some(solver) = &solver {
        check_solver(&mut reader, solver);
    }
    let output: Option<OutputSettings> = reader.optional(&root.key("output"));
    let complete = (|| {
        Some(Problem {
            name: name?,
            loads: loads.names().map(str::to_owned).collect(),
            materials: materials.into_resolved()?,
            model: model?,
            programme: programme?,
            solver: solver?,
            output: output?,
            source: source.to_owned(),
        })
    })();
    if complete.is_none() && report.is_clean() {
        report.at(&root, "the input could not be understood as a whole", None);
    }
    complete.filter(|_| report.is_clean())
}

fn run_name(reader: &mut Reader<'_, '_>) -> Option<RunName> {
    let path = Path::root().key("name");
    let name: String = reader.required(&path)?;
    let help = "letters, digits, `-` and `_` make a name, as in `hollow-2`".to_owned();
    name.parse()
        .map_err(|error| {
            reader
                .report
                .at(&path, format!("`name` is no run name: {error}"), help)
        })
        .ok()
}

fn model(
    reader: &mut Reader<'_, '_>,
    loads: &mut Loads,
    materials: &Materials,
    base: &FilePath,
) -> Option<Model> {
    let root = Path::root();
    let has = |reader: &Reader<'_, '_>, key: &str| reader.report.tree().entry(key).is_some();
    if has(reader, "element_test") {
        for key in [
            "mesh",
            "regions",
            "boundary",
            "body_force",
            "second_gradient",
        ] {
            if has(reader, key) {
                let message = format!("`{key}` and `element_test` exclude each other");
                reader.report.at_key(
                    &root.key(key),
                    message,
                    "an element test has no mesh; remove one of the two".to_owned(),
                );
            }
        }
        let material = materials.default(reader);
        let test = element_test::read(reader, loads, material, materials);
        return test.map(Model::ElementTest);
    }
    if !has(reader, "mesh") && reader.keys(&root).is_some() && !reader.is_misspelt(&root) {
        let help =
            "add `mesh: { rectangle: … }`, `mesh: { annulus: … }` or `mesh: { gmsh: … }`, or an `element_test: …`"
                .to_owned();
        reader.report.at(
            &root,
            "there is neither a `mesh` nor an `element_test`",
            help,
        );
    }
    if !has(reader, "mesh") {
        // A test that is missing would perhaps have brought loads along.
        loads.forget();
    }
    let mesh = mesh::read(reader, base);
    let regions = mesh::regions(reader, mesh.as_ref(), materials);
    let material = materials.default(reader);
    let conditions = conditions::read(reader, loads, mesh.as_ref());
    let body_force = conditions::body_force(reader, loads);
    if conditions.is_some() && body_force.is_some() {
        loads.report_idle(reader);
    }
    let second_gradient = second_gradient::read(
        reader,
        mesh.as_ref(),
        regions.as_deref(),
        conditions.as_deref(),
    );
    Some(Model::Body(Body {
        mesh: mesh?,
        material: material?,
        regions: regions?,
        conditions: conditions?,
        second_gradient: second_gradient?,
        body_force: body_force?,
    }))
}

/// Reports settings that contradict one another.
pub fn check_solver(reader: &mut Reader<'_, '_>, solver: &SolverSettings) {
    if solver.loosest_force_tolerance < solver.force_tolerance {
        let path = Path::root().key("solver").key("loosest_force_tolerance");
        let message = format!(
            "`loosest_force_tolerance` {} is below `force_tolerance` {}",
            solver.loosest_force_tolerance, solver.force_tolerance
        );
        reader.report.at(
            &path,
            message,
            "the loosest tolerance is the larger one".to_owned(),
        );
    }
}
