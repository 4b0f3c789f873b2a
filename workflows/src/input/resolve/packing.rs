//! Where assemblies of grains come from: a recipe, or a file.

use std::path::Path as FilePath;

use solver_dem::{AnisotropicStress, Fraction, Means, Quantity, Sizes, SizesError, Target};

use super::read::Reader;
use crate::input::document;
use crate::input::path::Path;
use crate::input::problem::{Origin, Preparation};

/// The keys of a recipe, which a packing from a file does not have.
const RECIPE_KEYS: [&str; 8] = [
    "grains",
    "size_ratio",
    "sizes",
    "preparation_friction",
    "target",
    "aspect_ratio",
    "anisotropy",
    "orientation",
];
/// How close to a target is close enough: about half of what packings of 400 grains scatter.
const TOLERANCES: [f64; 2] = [0.002, 0.02];

/// The origin of the packings of the material at `path`; what is wrong goes into the report.
pub fn origin(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    rev: &document::Rev,
    base: &FilePath,
) -> Option<Origin> {
    match &rev.import {
        Some(file) => imported(reader, path, file, base).map(Origin::Imported),
        None => prepared(reader, path, rev).map(Origin::Prepared),
    }
}

fn imported(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    file: &str,
    base: &FilePath,
) -> Option<String> {
    let mut good = true;
    for key in RECIPE_KEYS {
        let path = path.key(key);
        if reader.has(&path) {
            let help = "an imported packing is already prepared; remove this key".to_owned();
            let message = format!("`{key}` and `import` exclude each other");
            reader.report.at_key(&path, message, help);
            good = false;
        }
    }
    let full = base.join(file);
    // An inherited import is reported where it is written.
    let import = path.key("import");
    if !full.is_file() {
        if reader.has(&import) {
            let help = format!(
                "it is looked for at {}, relative to the folder of the input",
                full.display()
            );
            let message = format!("there is no file `{file}`");
            reader.report.at(&import, message, help);
        }
        good = false;
    }
    good.then(|| full.display().to_string())
}

fn prepared(reader: &mut Reader<'_, '_>, path: &Path, rev: &document::Rev) -> Option<Preparation> {
    let sizes = sizes(reader, path, rev);
    let target = match &rev.target {
        Some(written) => Some(target(reader, path, written)?),
        None => None,
    };
    Some(Preparation {
        grains: rev.grains,
        sizes: sizes?,
        friction: rev.preparation_friction,
        target,
        aspect_ratio: rev.aspect_ratio,
        anisotropy: rev.anisotropy.map(|written| AnisotropicStress {
            stress_ratio: written.stress_ratio,
            direction: written.direction.to_radians(),
        }),
        orientation: rev.orientation.to_radians(),
    })
}

fn sizes(reader: &mut Reader<'_, '_>, path: &Path, rev: &document::Rev) -> Option<Sizes> {
    let Some(written) = &rev.sizes else {
        return Some(Sizes::Uniform {
            ratio: rev.size_ratio,
        });
    };
    let short = path.key("size_ratio");
    if reader.has(&short) {
        let help = "`size_ratio: 2.5` is short for `sizes: { uniform: { ratio: 2.5 } }`; keep one (`like` counts, too)";
        let message = "`size_ratio` and `sizes` exclude each other";
        reader.report.at_key(&short, message, help.to_owned());
        return None;
    }
    let (sizes, place) = match written {
        document::Sizes::Uniform(uniform) => (
            Sizes::Uniform {
                ratio: uniform.ratio,
            },
            "uniform",
        ),
        document::Sizes::LogNormal(law) => (
            Sizes::LogNormal {
                deviation: law.deviation,
                smallest: law.smallest,
                largest: law.largest,
            },
            "log_normal",
        ),
        document::Sizes::Table(table) => (
            Sizes::Table {
                by: match table.by {
                    document::Fraction::Number => Fraction::Number,
                    document::Fraction::Area => Fraction::Area,
                },
                curve: table.curve.clone(),
            },
            "table",
        ),
    };
    let path = path.key("sizes").key(place);
    match sizes.check() {
        Ok(()) => Some(sizes),
        // The check has said the same of one of the numbers.
        Err(_) if !reader.report.is_clean_below(&path) => None,
        Err(SizesError::Point { row, problem }) => {
            let help = "as in `curve: [[0.5, 0], [1.0, 0.4], [2.0, 1]]`".to_owned();
            let row = path.key("curve").index(row);
            reader.report.at(&row, problem, help);
            None
        }
        Err(error @ SizesError::Ratio { .. }) => {
            let help = "cut the fine or the coarse tail off: few grains of one size carry no stress that says anything";
            reader.report.at(&path, error.to_string(), help.to_owned());
            None
        }
        Err(error) => {
            reader.report.at(&path, error.to_string(), None);
            None
        }
    }
}

fn target(reader: &mut Reader<'_, '_>, path: &Path, written: &document::Target) -> Option<Target> {
    let place = path.key("target");
    let (quantity, value) = match (written.void_ratio, written.coordination) {
        (Some(value), None) => (Quantity::VoidRatio, value),
        (None, Some(value)) => (Quantity::Coordination, value),
        (Some(_), Some(_)) => {
            let help = "keep one: the other follows from how the packing is made".to_owned();
            let message = "`void_ratio` and `coordination` exclude each other";
            let place = place.key("coordination");
            reader.report.at_key(&place, message, help);
            return None;
        }
        (None, None) if reader.is_misspelt(&place) => return None,
        (None, None) => {
            let help = "add `void_ratio: 0.2` or `coordination: 3.5`, for example".to_owned();
            let message = "this target says nothing to reach";
            reader.report.at_key(&place, message, help);
            return None;
        }
    };
    let friction = path.key("preparation_friction");
    if written.by == document::Means::Friction && reader.has(&friction) {
        let help = "remove it, or let cycles densify what it gives: `by: { shear_cycles: {} }`";
        let message = "`preparation_friction` is what this target chooses";
        reader.report.at_key(&friction, message, help.to_owned());
        return None;
    }
    let usual = match quantity {
        Quantity::VoidRatio => TOLERANCES[0],
        Quantity::Coordination => TOLERANCES[1],
    };
    Some(Target {
        quantity,
        value,
        tolerance: written.tolerance.unwrap_or(usual),
        by: match written.by {
            document::Means::Friction => Means::Friction,
            document::Means::ShearCycles(cycles) => Means::ShearCycles {
                amplitude: cycles.amplitude,
                friction: cycles.friction,
            },
            document::Means::CompressionCycles(cycles) => Means::CompressionCycles {
                ratio: cycles.ratio,
                friction: cycles.friction,
            },
        },
    })
}
