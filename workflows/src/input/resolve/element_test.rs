//! The element test: the usual paths written out, the volume kept by one component at most.

use super::loads::Loads;
use super::materials::Materials;
use super::read::Reader;
use crate::input::document::{self, Component, LoadPath};
use crate::input::path::Path;
use crate::input::problem::{Amount, Control, ElementTest};

/// Reads it; `material` is absent where it is wrong.
pub fn read(
    reader: &mut Reader<'_, '_>,
    loads: &mut Loads,
    material: Option<usize>,
    materials: &Materials,
) -> Option<ElementTest> {
    let path = Path::root().key("element_test");
    let Some(written): Option<document::ElementTest> = reader.required(&path) else {
        // Which loads it would have brought along is not known.
        loads.forget();
        return None;
    };
    let controls = match (written.path, &written.control) {
        (Some(usual), None) => {
            // Known only with the material; 0 stands for it where that is wrong, and nothing comes of it then.
            let initial = material
                .and_then(|index| materials.get(index))
                .map_or(0.0, |material| material.initial_stress());
            Some(write_out(usual, loads, initial))
        }
        (None, Some(control)) => {
            let path = path.key("control");
            let parts = [
                ("xx", &control.xx),
                ("yy", &control.yy),
                ("xy", &control.xy),
            ];
            let [xx, yy, xy] =
                parts.map(|(key, part)| component(reader, &path.key(key), part, loads));
            check_volume(reader, &path, control);
            xx.zip(yy).zip(xy).map(|((xx, yy), xy)| [xx, yy, xy])
        }
        (None, None) if reader.is_misspelt(&path) => {
            loads.forget();
            None
        }
        _ => {
            loads.forget();
            let message = "an element test is given by exactly one of `path` and `control`";
            reader.report.at(
                &path,
                message,
                "write `path: biaxial`, for example".to_owned(),
            );
            None
        }
    };
    let [xx, yy, xy] = controls?;
    loads.report_idle(reader);
    Some(ElementTest {
        material: material?,
        xx,
        yy,
        xy,
    })
}

fn component(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    written: &Component,
    loads: &mut Loads,
) -> Option<Control> {
    Some(match written {
        Component::Strain(amount) => {
            Control::Strain(loads.amount(reader, &path.key("strain"), amount)?)
        }
        Component::Stress(amount) => {
            Control::Stress(loads.amount(reader, &path.key("stress"), amount)?)
        }
        Component::KeepVolume => Control::KeepVolume,
    })
}

/// det F = (1 + xx)(1 + yy): one normal strain follows from the other, which must itself be given as a strain.
fn check_volume(reader: &mut Reader<'_, '_>, path: &Path, control: &document::Control) {
    if matches!(control.xy, Component::KeepVolume) {
        let message = "the shear component cannot keep the volume";
        reader
            .report
            .at(&path.key("xy"), message, "only `xx` or `yy` can".to_owned());
    }
    match (&control.xx, &control.yy) {
        (Component::KeepVolume, Component::KeepVolume) => {
            let message = "`xx` and `yy` cannot both keep the volume";
            reader.report.at(
                &path.key("yy"),
                message,
                "give one of them as a strain".to_owned(),
            );
        }
        (Component::KeepVolume, Component::Stress(_)) => {
            let message = "where `xx` keeps the volume, `yy` must be given as a strain";
            reader.report.at(&path.key("yy"), message, None);
        }
        (Component::Stress(_), Component::KeepVolume) => {
            let message = "where `yy` keeps the volume, `xx` must be given as a strain";
            reader.report.at(&path.key("xx"), message, None);
        }
        _ => {}
    }
}

/// The components xx, yy, xy of a usual path, from the isotropic stress `initial` (positive in tension).
fn write_out(path: LoadPath, loads: &mut Loads, initial: f64) -> [Control; 3] {
    use Control::{KeepVolume, Strain, Stress};
    let constant = Amount::Constant;
    match path {
        LoadPath::Biaxial => [
            Stress(constant(initial)),
            Strain(loads.bring("axial", 0.0)),
            Strain(constant(0.0)),
        ],
        LoadPath::Isotropic => {
            let mean = loads.bring("mean_stress", initial);
            [Stress(mean), Stress(mean), Strain(constant(0.0))]
        }
        LoadPath::SimpleShear => [
            Strain(constant(0.0)),
            Stress(constant(initial)),
            Strain(loads.bring("shear", 0.0)),
        ],
        LoadPath::ConstantVolume => [
            KeepVolume,
            Strain(loads.bring("axial", 0.0)),
            Strain(constant(0.0)),
        ],
    }
}
