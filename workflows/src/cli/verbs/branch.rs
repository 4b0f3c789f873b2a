//! `femdem-flow branch RUN@STEP` and `femdem-flow rerun RUN@STEP`

use std::path::PathBuf;

use super::terms;
use crate::address::{RunAddress, RunName};
use crate::failure::Failure;
use crate::input::derive::{Request, Scope, Text};
use crate::report::Report;
use crate::run::{self, Computing, Context, Wish};

/// Another future.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The load step to go on from: `hollow@12`, `hollow@last`.
    #[arg(value_name = "RUN@STEP")]
    at: RunAddress,
    /// What follows: YAML with `programme`, `solver`, `output` as in an input, or a list of such under `branches`.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// The stages that follow, in YAML: `'back: { ramp: { shortening: 0 }, steps: 20 }'`.
    #[arg(long, value_name = "YAML", conflicts_with_all = ["ramp", "hold", "cycle"])]
    programme: Option<String>,
    /// Bring this load to this value in `--steps` load steps; once for each load.
    #[arg(long, value_name = "LOAD=VALUE", value_parser = ramp, requires = "steps")]
    ramp: Vec<(String, f64)>,
    /// Keep all loads for `--steps` load steps.
    #[arg(long, requires = "steps", conflicts_with_all = ["ramp", "cycle"])]
    hold: bool,
    /// Bring this load to the first value and on to the second, each way in `--steps` load steps.
    #[arg(long, value_name = "LOAD=A,B", value_parser = cycle, requires = "steps", conflicts_with = "ramp")]
    cycle: Vec<(String, f64, f64)>,
    /// Load steps of the stage; of a cycle, of each of its ways.
    #[arg(long, value_name = "N")]
    steps: Option<u32>,
    /// How often the cycle is gone.
    #[arg(long, value_name = "N", requires = "cycle")]
    times: Option<u32>,
    #[command(flatten)]
    common: Common,
}

/// The same programme once more.
#[derive(Debug, Clone, clap::Args)]
pub struct RerunArgs {
    /// The load step to go on from: `hollow@12`.
    #[arg(value_name = "RUN@STEP")]
    at: RunAddress,
    #[command(flatten)]
    common: Common,
}

/// What both take.
#[derive(Debug, Clone, clap::Args)]
struct Common {
    /// Change a setting, as in `solver.iterations=20`. A list makes one run of each value:
    /// `solver.force_tolerance=[1e-3, 1e-4]`; where the setting is a list itself, as `output.fields`, it is the value.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Name of the run; otherwise the parent's with what is new behind.
    #[arg(long, value_name = "RUN")]
    name: Option<RunName>,
    /// Only make the run; `resume` computes it.
    #[arg(long)]
    prepare_only: bool,
    #[command(flatten)]
    terms: terms::Args,
}

impl Args {
    /// How the verb is supervised.
    pub fn supervised(&self) -> &terms::Supervised {
        self.common.terms.supervised()
    }

    /// What is asked for.
    pub fn wish(&self) -> Wish {
        let programme = self.programme.clone().map(|yaml| Text {
            option: "--programme".to_owned(),
            yaml,
        });
        let programme = programme.or_else(|| self.stage());
        self.common.wish(&self.at, self.file.clone(), programme)
    }

    /// The one stage that options describe, in the words of the input.
    fn stage(&self) -> Option<Text> {
        let word = |load: &str| serde_json::Value::from(load).to_string();
        let (option, name, kind) = match (self.ramp.as_slice(), self.cycle.as_slice()) {
            ([first, ..], _) => {
                let targets: Vec<String> = self
                    .ramp
                    .iter()
                    .map(|(load, value)| format!("{}: {value:?}", word(load)))
                    .collect();
                let name = format!("{} to {}", first.0, first.1);
                (
                    "--ramp",
                    name,
                    format!("ramp: {{ {} }}", targets.join(", ")),
                )
            }
            (_, [first, ..]) => {
                let targets: Vec<String> = self
                    .cycle
                    .iter()
                    .map(|(load, a, b)| format!("{}: [{a:?}, {b:?}]", word(load)))
                    .collect();
                let name = format!("{} cycles", first.0);
                (
                    "--cycle",
                    name,
                    format!("cycle: {{ {} }}", targets.join(", ")),
                )
            }
            _ if self.hold => ("--hold", "hold".to_owned(), "hold: {}".to_owned()),
            _ => return None,
        };
        let times = self
            .times
            .map_or(String::new(), |n| format!(", times: {n}"));
        let steps = self.steps.unwrap_or(1);
        let yaml = format!("{{ name: {}, {kind}{times}, steps: {steps} }}", word(&name));
        let option = option.to_owned();
        Some(Text { option, yaml })
    }
}

impl RerunArgs {
    /// How the verb is supervised.
    pub fn supervised(&self) -> &terms::Supervised {
        self.common.terms.supervised()
    }

    /// What is asked for.
    pub fn wish(&self) -> Wish {
        self.common.wish(&self.at, None, None)
    }
}

impl Common {
    fn wish(&self, at: &RunAddress, file: Option<PathBuf>, programme: Option<Text>) -> Wish {
        Wish {
            at: at.clone(),
            request: Request {
                file,
                programme,
                sets: self.sets.clone(),
            },
            name: self.name.clone(),
            computing: if self.prepare_only {
                Computing::Later
            } else {
                Computing::Now
            },
        }
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let terms = args.common.terms.terms(context);
    run::derive(context, &args.wish(), Scope::Branch, &terms)
}

pub fn perform_rerun(args: &RerunArgs, context: &Context<'_>) -> Result<Report, Failure> {
    let terms = args.common.terms.terms(context);
    run::derive(context, &args.wish(), Scope::Rerun, &terms)
}

fn ramp(text: &str) -> Result<(String, f64), String> {
    let (load, value) = text
        .split_once('=')
        .ok_or("write LOAD=VALUE, as in `shortening=0`")?;
    Ok((load.trim().to_owned(), number(value)?))
}

fn cycle(text: &str) -> Result<(String, f64, f64), String> {
    const HELP: &str = "write LOAD=A,B, as in `shortening=-0.01,-0.02`";
    let (load, values) = text.split_once('=').ok_or(HELP)?;
    let (first, second) = values.split_once(',').ok_or(HELP)?;
    Ok((load.trim().to_owned(), number(first)?, number(second)?))
}

fn number(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.trim().parse().ok();
    value
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("`{}` is no number", text.trim()))
}
