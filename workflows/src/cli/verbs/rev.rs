//! `femdem-flow rev prepare|test|import|export`

use std::path::PathBuf;

use crate::address::RevAddress;
use crate::failure::Failure;
use crate::input;
use crate::report::Report;
use crate::run::{self, Context};

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
        Verb::Test { file } => run::rev_test(context, &input::load(file)?),
        Verb::Import { packing } => run::rev_import(context, packing),
        Verb::Export { rev, into } => run::rev_export(context, rev, into),
    }
}
