//! `femdem-flow rev prepare|test|show|import|export`

use std::path::PathBuf;

use crate::address::RevAddress;
use crate::failure::Failure;
use crate::input;
use crate::plot::PictureFile;
use crate::report::Report;
use crate::run::{self, Context, RevSource, RevTestExtras};

#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Prepare the packings that an input needs and keep them in the store, as `submit` would do first.
    ///
    /// Reports their quality. A run with the same materials then starts at once.
    Prepare {
        /// The input (YAML).
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// This material only.
        #[arg(long, value_name = "NAME")]
        material: Option<String>,
    },
    /// Run the element test of an input and print its curve (CSV), without keeping a run.
    ///
    /// The curve is the one that `submit` and `export` give, to the last bit.
    Test {
        /// The input (YAML), with an `element_test`.
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Draw stress ratio and volume strain too, into this PNG or SVG.
        #[arg(long, value_name = "PICTURE")]
        plot: Option<PictureFile>,
        /// Say too how wide a band is with this second-gradient modulus, from the softening in a biaxial test.
        #[arg(long, value_name = "D", allow_negative_numbers = true)]
        internal_length: Option<f64>,
    },
    /// Draw a REV: its grains, the forces between them, and how both are directed.
    ///
    /// Lines between centres carry the contact forces, as thick as the normal force is large. Contacts that slide and grains
    /// that carry nothing are marked; images across the sides of the periodic cell are faint. The roses show how many
    /// contacts point where and the mean normal and shear force in them, with the fitted series. `--json` has the figures.
    Show {
        /// A REV of a run (`hollow@12:e46.2`, `hollow@last:e0.0`), or a packing file (JSON).
        #[arg(value_name = "WHERE")]
        source: RevSource,
        /// The picture, PNG or SVG by its extension; by default a PNG here, named after the REV.
        #[arg(long, short, value_name = "FILE")]
        output: Option<PictureFile>,
    },
    /// Read a packing of another program (JSON) and say how good it is: as it stands, at rest, and under its stress.
    ///
    /// Nothing is kept: a material takes a packing by `rev: { import: PACKING }`.
    Import {
        /// The packing.
        #[arg(value_name = "PACKING")]
        packing: PathBuf,
    },
    /// Write the packing of one REV as JSON.
    Export {
        /// The REV: `hollow@12:e46.2`.
        #[arg(value_name = "RUN@STEP:eN.G")]
        rev: RevAddress,
        /// The file to write.
        #[arg(value_name = "FILE")]
        into: PathBuf,
    },
}

pub fn perform(verb: &Verb, context: &Context<'_>) -> Result<Report, Failure> {
    match verb {
        Verb::Prepare { file, material } => {
            run::rev_prepare(context, &input::load(file)?, material.as_deref())
        }
        Verb::Test {
            file,
            plot,
            internal_length,
        } => {
            let extras = RevTestExtras {
                plot: plot.clone(),
                internal_length: *internal_length,
            };
            run::rev_test(context, &input::load(file)?, &extras)
        }
        Verb::Show { source, output } => run::rev_show(context, source, output.as_ref()),
        Verb::Import { packing } => run::rev_import(context, packing),
        Verb::Export { rev, into } => run::rev_export(context, rev, into),
    }
}
