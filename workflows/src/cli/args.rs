//! The arguments: global options and verbs, with their help texts.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use super::display::Format;
use super::verbs::{
    bench, branch, completions, control, diff, export, import, keeping, plan, plot, queue, replay,
    resume, rev, show, status, store, submit, verify, watch,
};

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  the computation failed; what is committed is kept
    2  the command line or the input is wrong; nothing was touched
    3  the store is locked, damaged, full or missing
   75  stopped in order at the deadline of `--until`; `femdem-flow resume RUN` continues
  130  stopped by Ctrl-C in order (143: by SIGTERM or `cancel`); `femdem-flow resume RUN` continues

Signals to a command that computes:
    SIGINT, SIGTERM   stop in order; once more: at once
    SIGUSR1           checkpoint: what is journalled of the running step is brought onto the disk, and the run goes on

Addresses:
    hollow            a run
    hollow@12         its load step 12; 0 is the initial state
    hollow@last       its last committed load step
    hollow@12:e46.2   the REV of element 46, Gauss point 2, both counted from 0";

/// Multiscale simulation of granular media: finite elements with an assembly of grains at every Gauss point, as
/// restartable task graphs.
#[derive(Debug, Parser)]
#[command(name = "femdem-flow", version, after_long_help = EXIT_CODES)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub struct Cli {
    #[command(flatten)]
    pub global: Global,
    #[command(subcommand)]
    pub verb: Verb,
}

/// The store where none is named.
pub const DEFAULT_STORE: &str = "femdem-store";

/// Options of every verb.
#[derive(Debug, Args)]
pub struct Global {
    /// Folder of the store, which holds the runs.
    #[arg(
        long,
        global = true,
        value_name = "DIR",
        default_value = DEFAULT_STORE
    )]
    pub store: PathBuf,
    /// Worker threads; all cores where it is not given. The results do not depend on it, to the last bit.
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
    /// Report as JSON on stdout.
    #[arg(long, global = true)]
    pub json: bool,
    /// Show no progress. Errors are still shown.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

impl Global {
    /// The form of what goes to stdout.
    pub fn format(&self) -> Format {
        if self.json {
            Format::Json
        } else {
            Format::Text
        }
    }
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Compute an input file as a new run.
    ///
    /// The input is checked first, completely; nothing is written before it is right. Each load step is committed to the
    /// store when it is done. A run that is interrupted or killed continues with `resume`, with the same results to the
    /// last bit.
    Submit(submit::Args),
    /// Continue a run where it stopped.
    ///
    /// Goes on after the last committed load step; of the step that was in progress, REV tasks that were finished are not
    /// computed again. A run that is complete is left as it is.
    Resume(resume::Args),
    /// Give a run another future from one of its load steps on: another load programme, other solver or output settings.
    ///
    /// The load steps up to there are shared with the run, not copied, and stay as they are. A branch with nothing
    /// changed gives the same bits as the run. What would change the past is refused. Several branches at once: a list in
    /// `--set`, or a file with `branches`.
    Branch(branch::Args),
    /// Compute a run again from one of its load steps on, as a new run, with the same or changed settings.
    ///
    /// Takes `solver`, `output` and the laws of materials: `materials.NAME.rev.friction`, `friction_scatter`,
    /// `cohesion_ratio`, `stiffness`, `tangential_stiffness`, `materials.NAME.elastic.young`, `poisson`. With another law the run is a new start from
    /// the states of that step, and says so. The history of the first run is left as it is.
    Rerun(branch::RerunArgs),
    /// Say what a verb would do before it does it: load steps reused and computed, and why; time; disk. Writes nothing.
    #[command(subcommand)]
    Plan(plan::Verb),
    /// List the runs of the store.
    Runs,
    /// Show a run, or one load step of it.
    ///
    /// Works while another process computes it. `--json` has everything, step by step.
    Show(show::Args),
    /// Tell what happened to a run: sessions, load steps, cuts, notes.
    Log(keeping::RunArgs),
    /// Give a run another name, also while it is computed.
    ///
    /// The new name stands in every list and address from then on. The name that the run was born with still finds it, and no
    /// other run can be given it; to go back to it, rename the run to it.
    Rename(keeping::RenameArgs),
    /// Write a note on a run, also while it is computed.
    Note(keeping::NoteArgs),
    /// Give the space of load steps back that are not needed any more.
    ///
    /// Their figures stay. The first and the last load step of the run always stay, and so do those that other runs take
    /// up: whatever is kept can be resumed, branched off and rerun.
    Prune(keeping::PruneArgs),
    /// Delete a run and give its space back. A run that others take up is refused.
    Delete(keeping::RunArgs),
    /// Say where a run that another process computes has got to.
    ///
    /// Reads files only, so that it works while the store is in use, and disturbs nobody.
    Status(status::Args),
    /// Follow a run live, from any terminal, until its session ends; the exit code is the session's.
    ///
    /// Reads the event log and the journal, and disturbs nobody. `--json` streams the events of the session, one a line.
    Watch(watch::Args),
    /// List what is queued, take entries back, or compute them.
    ///
    /// `submit`, `resume`, `branch` and `rerun` queue their work where another process computes in the store; that process
    /// takes it after its own, in order.
    Queue(queue::Args),
    /// Stop a run that another process computes, in order: what SIGTERM does, from any terminal or host.
    ///
    /// Tasks that run may end, then the run is `interrupted` and `resume` goes on with the same bits. Waits until the
    /// process has acted. The process goes on with what else it has to compute, unless `--process` is given.
    Cancel(control::CancelArgs),
    /// Hold a run up that another process computes: no new task starts, those that run end.
    ///
    /// The process stays and keeps the store. Waits until nothing runs. The run gives the same bits as one that was never
    /// paused, also where it is killed meanwhile and resumed.
    Pause(control::PauseArgs),
    /// Let a paused run go on.
    Continue(control::PauseArgs),
    /// Write the results of a run for other programs: curves as CSV, fields as VTU with a PVD for ParaView; or the run itself
    /// as one file.
    ///
    /// `curves.csv` has a row for each committed load step; its head says what the columns mean. `fields.pvd` opens the
    /// mesh in ParaView: displacement, stress, strain and shear_strain at the nodes (smoothed); means of the elements
    /// for the same and for void_ratio, coordination and rev_cost; with a second gradient also v (`gradient`), the
    /// multiplier, the double stress and how far v and the displacement gradient part. `points.pvd` has the Gauss points with the values as
    /// computed. Stress is positive in tension, strain is logarithmic and positive in extension. Works while another
    /// process computes the run.
    Export(export::Args),
    /// Take the runs of an archive, written by `export RUN --archive FILE`, into the store.
    ///
    /// All of them come in or none does, whatever is damaged or crashes. They resume, branch and replay with the bits that they
    /// had where they come from. Ancestors that the store has with the same load steps are shared.
    Import(import::Args),
    /// Draw a run: a quantity on its mesh, or its curves.
    ///
    /// `plot hollow@20` colours the deformed mesh by the shear strain; `--field` chooses another quantity.
    /// `plot hollow@12..20` shows what came about between two steps, the standard picture of shear bands.
    /// `plot hollow hollow-2 --curve=-uy_top,-fy_top` draws columns of `curves.csv` over one another, for several runs.
    /// Pictures are PNG or SVG; fonts are built in. Works while another process computes the run.
    Plot(plot::Args),
    /// Prepare, test, draw, import and export assemblies of grains (REVs).
    #[command(subcommand)]
    Rev(rev::Verb),
    /// Ask one REV again, alone, and compare its answer with the stored one.
    ///
    /// From the committed states before the load step and what each iteration asked of the REV, its last answer is
    /// computed again. Reports the solver's figures, how the residual fell and whether state and stress have the stored
    /// bits; exit code 1 where they do not. `--output` keeps the grains and contacts before and after. A task that failed
    /// leaves a file in the store's folder `failed`, which is replayed in the same way.
    Replay(replay::Args),
    /// Prove a run: check every hash, and carry out a sample of its REV tasks again.
    ///
    /// Exit code 3 where a step is damaged, 1 where a REV answers with other bits than those stored. Works while another
    /// process computes the run.
    Verify(verify::Args),
    /// Say where two runs part.
    ///
    /// Names the first load step, iteration and REV that differ and by how much; `--output` writes the mesh coloured by
    /// the difference, for ParaView.
    Diff(diff::Args),
    /// Measure what a REV or the store costs on this machine.
    #[command(subcommand)]
    Bench(bench::Verb),
    /// Look after the store.
    #[command(subcommand)]
    Store(store::Verb),
    /// Print the JSON Schema of the input, for editors.
    Schema,
    /// Print the completions of the command line for a shell.
    Completions(completions::Args),
}

/// The most worker threads: more than any machine this runs on has cores.
const MOST_THREADS: usize = 1024;

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let threads = text.parse().ok().and_then(NonZeroUsize::new);
    threads
        .filter(|threads| threads.get() <= MOST_THREADS)
        .ok_or_else(|| format!("write a whole number from 1 to {MOST_THREADS}"))
}
