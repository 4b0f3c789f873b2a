//! The files of a replayed REV.
//!
//! | file | content |
//! |---|---|
//! | `grains-before.vtp`, `grains-after.vtp` | grains as points, contacts as lines, for ParaView |
//! | `packing-before.json`, `packing-after.json` | the same as packings, for `rev import` and other programs |
//! | `report.json` | what `--json` prints |
//!
//! Grains: `radius`, `contacts`; in the second file also `displacement`, what is left of it when the affine motion of the cell
//! is taken off. Contacts: `normal_force` (repulsion positive) and `tangential_force`; those across a side of the cell are left
//! out.

use std::path::Path;

use solver_dem::exchange::PackingRecord;
use solver_dem::tensor::{apply, product};

use crate::{
    output::{
        WriteError,
        vtp::{self, Points},
        vtu::{Array, Values},
        write_text,
    },
    report::Report,
    run::point::PlaneRev,
};

/// Writes the REV before and, where there is one, after its deformation; returns the paths.
///
/// # Errors
/// The file system's refusal.
pub fn write(
    folder: &Path,
    before: &PlaneRev,
    after: Option<&PlaneRev>,
) -> Result<Vec<String>, WriteError> {
    let mut written = Vec::new();
    let mut put = |rev: &PlaneRev, which: &str, moved: Option<Vec<[f64; 2]>>| {
        let grains = folder.join(format!("grains-{which}.vtp"));
        write_grains(&grains, rev, moved.as_deref())?;
        let packing = folder.join(format!("packing-{which}.json"));
        // Forces in the file are as they are; its reader needs a stress to settle under only if it asks for that.
        let record = PackingRecord::from_rev(rev, 1.0);
        let text = serde_json::to_string_pretty(&record)
            .expect("numbers of known form serialise into memory");
        write_text(&packing, &text)?;
        written.extend([grains, packing].map(|path| path.display().to_string()));
        Ok(())
    };
    put(before, "before", None)?;
    if let Some(after) = after {
        put(after, "after", Some(fluctuations(before, after)))?;
    }
    Ok(written)
}

/// Writes what was found out.
///
/// # Errors
/// The file system's refusal.
pub fn write_report(folder: &Path, report: &Report) -> Result<(), WriteError> {
    write_text(&folder.join("report.json"), &format!("{:#}\n", report.json))
}

/// Displacements without the affine motion: x − H·H₀⁻¹·x₀.
fn fluctuations(before: &PlaneRev, after: &PlaneRev) -> Vec<[f64; 2]> {
    let back = before.state.cell.inverse().unwrap_or_default();
    let carried = product(&after.state.cell.h, &back);
    let pairs = after.state.positions.iter().zip(&before.state.positions);
    pairs
        .map(|(x, old)| {
            let affine = apply(&carried, old);
            [x[0] - affine[0], x[1] - affine[1]]
        })
        .collect()
}

fn write_grains(path: &Path, rev: &PlaneRev, moved: Option<&[[f64; 2]]>) -> Result<(), WriteError> {
    let record = PackingRecord::from_rev(rev, 1.0);
    let (mut lines, mut normal, mut tangential) = (Vec::new(), Vec::new(), Vec::new());
    for (contact, row) in rev.state.contacts.iter().zip(&record.contacts_list) {
        if let &[_, _, shift_x, shift_y, _, _, _, fn_, ft] = row.as_slice()
            && shift_x == 0.0
            && shift_y == 0.0
        {
            lines.push([contact.i, contact.j]);
            normal.push(fn_);
            tangential.push(ft);
        }
    }
    let mut degree = vec![0.0; rev.grains.radii.len()];
    for contact in &rev.state.contacts {
        degree[contact.i as usize] += 1.0;
        degree[contact.j as usize] += 1.0;
    }
    let scalar = |name, values| Array {
        name,
        values: Values::Scalar(values),
    };
    let mut point_data = vec![
        scalar("radius", &rev.grains.radii),
        scalar("contacts", &degree),
    ];
    point_data.extend(moved.map(|moved| Array {
        name: "displacement",
        values: Values::Vector(moved),
    }));
    let points = Points {
        points: &rev.state.positions,
        lines: &lines,
    };
    let line_data = [
        scalar("normal_force", &normal),
        scalar("tangential_force", &tangential),
    ];
    vtp::write(path, &points, &point_data, &line_data)
}
