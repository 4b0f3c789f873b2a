//! `femdem-flow plan submit|resume|branch|rerun …`

use super::{branch, resume, submit};
use crate::failure::Failure;
use crate::input::derive::Scope;
use crate::report::Report;
use crate::run::{self, Context, Intent};

/// The verbs that can be planned; they take the same arguments as by themselves.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// What `submit` would compute, and which run of the store is like it.
    Submit(submit::Args),
    /// What `resume` would compute.
    Resume(resume::Args),
    /// What `branch` would share and compute.
    Branch(branch::Args),
    /// What `rerun` would share and compute.
    Rerun(branch::RerunArgs),
}

pub fn perform(verb: &Verb, context: &Context<'_>) -> Result<Report, Failure> {
    let intent = match verb {
        Verb::Submit(args) => {
            let (problem, name) = args.problem()?;
            Intent::Submit(Box::new(problem), name)
        }
        Verb::Resume(args) => Intent::Resume(args.run().clone()),
        Verb::Branch(args) => Intent::Derive(Box::new(args.wish()), Scope::Branch),
        Verb::Rerun(args) => Intent::Derive(Box::new(args.wish()), Scope::Rerun),
    };
    run::plan(context, &intent)
}
