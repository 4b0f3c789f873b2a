//! `femdem-flow bench rev`, `bench macro`, `bench store`

use std::num::NonZeroU32;

use crate::bench;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::Context;

#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Measure what a REV costs on this machine.
    ///
    /// Prints, in CPU time of one thread: what a cycle of the solver costs (contact updates are the pairs in contact times
    /// the cycles), and what an increment of 5e-4 axial strain at constant lateral stress costs a Gauss point before, at and
    /// after the peak, residual 1e-6, tangents included, over several packings with and without cohesion. Takes some
    /// minutes; writes nothing.
    Rev {
        /// One packing of 400 grains to 2 % strain only: some seconds.
        #[arg(long)]
        quick: bool,
        /// Sizes of the REVs: 400,1600 (and 100 for the cycles) where it is not given.
        #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(16..=100_000))]
        grains: Vec<u32>,
        /// Packings of each kind; 3 where it is not given.
        #[arg(long, value_name = "P")]
        packings: Option<NonZeroU32>,
    },
    /// Measure what the store costs on this machine and disk.
    ///
    /// Commits load steps of 512 REVs of 400 grains, opens a store of 1000 load steps, branches off one of them, and prints CPU
    /// and wall time, the space on disk over that of the bare states, and the share of the store in a load step. Works in a folder
    /// beside the store (about 200 MB), which is removed again; takes up to a minute.
    Store {
        /// Three commits, 100 load steps: some seconds.
        #[arg(long)]
        quick: bool,
    },
    /// Measure what the equations of the macro scale cost on this machine.
    ///
    /// Prints, in CPU time of one thread: what assembly, factorisation and solution cost in an iteration on specimens of 8×16, 16×32 and
    /// 32×64 Q8, plain and with second gradient, with both linear solvers, and which share of an iteration in which a
    /// REV of 400 grains answers at each Gauss point that is. Takes less than a minute; writes nothing.
    Macro {
        /// The smallest mesh only: some seconds.
        #[arg(long)]
        quick: bool,
    },
}

pub fn perform(verb: &Verb, context: &Context<'_>) -> Result<Report, Failure> {
    match verb {
        Verb::Rev {
            quick,
            grains,
            packings,
        } => {
            let mut plan = if *quick {
                bench::rev::Plan::quick()
            } else {
                bench::rev::Plan::default()
            };
            if !grains.is_empty() {
                plan.cycle_grains.clone_from(grains);
                plan.increment_grains.clone_from(grains);
            }
            if let Some(packings) = packings {
                plan.packings = packings.get();
            }
            bench::rev::measure(&plan, context.progress)
        }
        Verb::Store { quick } => {
            let plan = if *quick {
                bench::store::Plan::quick()
            } else {
                bench::store::Plan::default()
            };
            bench::store::measure(&plan, &context.store, context.progress)
        }
        Verb::Macro { quick } => {
            let plan = if *quick {
                bench::macro_scale::Plan::quick()
            } else {
                bench::macro_scale::Plan::default()
            };
            bench::macro_scale::measure(&plan, context.progress)
        }
    }
}
