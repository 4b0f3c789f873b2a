//! The verbs, one file each: their arguments, and how these become a call of [`crate::run`].

pub mod bench;
pub mod branch;
pub mod completions;
pub mod control;
pub mod diff;
pub mod export;
pub mod import;
pub mod keeping;
pub mod plan;
pub mod plot;
pub mod queue;
pub mod replay;
pub mod resume;
pub mod rev;
pub mod schema;
pub mod show;
pub mod status;
pub mod store;
pub mod submit;
pub mod terms;
pub mod verify;
pub mod watch;

use std::io::Write;

use super::args::{Cli, Verb};
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context};

/// Does what the verb says.
pub fn perform(cli: &Cli, context: &Context<'_>, out: &mut dyn Write) -> Result<Report, Failure> {
    match &cli.verb {
        Verb::Submit(args) => submit::perform(args, context),
        Verb::Resume(args) => resume::perform(args, context),
        Verb::Branch(args) => branch::perform(args, context),
        Verb::Rerun(args) => branch::perform_rerun(args, context),
        Verb::Plan(verb) => plan::perform(verb, context),
        Verb::Prune(args) => keeping::prune(args, context),
        Verb::Delete(args) => keeping::delete(args, context),
        Verb::Rename(args) => keeping::rename(args, context),
        Verb::Note(args) => keeping::note(args, context),
        Verb::Log(args) => keeping::log(args, context),
        Verb::Runs => run::runs(context),
        Verb::Show(args) => show::perform(args, context),
        Verb::Status(args) => status::perform(args, context),
        Verb::Queue(args) => queue::perform(args, context),
        Verb::Watch(args) => watch::perform(args, context, cli.global.format(), out),
        Verb::Cancel(args) => control::cancel(args, context),
        Verb::Pause(args) => control::pause(args, context),
        Verb::Continue(args) => control::go_on(args, context),
        Verb::Export(args) => export::perform(args, context),
        Verb::Import(args) => import::perform(args, context),
        Verb::Plot(args) => plot::perform(args, context),
        Verb::Replay(args) => replay::perform(args, context),
        Verb::Verify(args) => verify::perform(args, context),
        Verb::Diff(args) => diff::perform(args, context),
        Verb::Bench(verb) => bench::perform(verb, context),
        Verb::Rev(verb) => rev::perform(verb, context),
        Verb::Store(verb) => store::perform(verb, context),
        Verb::Schema => Ok(schema::perform()),
        Verb::Completions(args) => Ok(completions::perform(args)),
    }
}

impl Verb {
    /// What is asked of a supervisor, where the verb computes and one is asked for.
    pub fn supervised(&self) -> Option<super::supervise::Order> {
        let terms = match self {
            Verb::Submit(args) => args.supervised(),
            Verb::Resume(args) => args.supervised(),
            Verb::Branch(args) => args.supervised(),
            Verb::Rerun(args) => args.supervised(),
            Verb::Queue(args) => args.supervised()?,
            _ => return None,
        };
        terms.order()
    }
}
