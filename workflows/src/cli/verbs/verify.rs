//! `femdem-flow verify RUN[@STEP]`

use crate::address::RunAddress;
use crate::failure::Failure;
use crate::report::Report;
use crate::run::{self, Context, Sample};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run, or one of its load steps: `hollow`, `hollow@12`, `hollow@last`.
    #[arg(value_name = "RUN[@STEP]")]
    address: RunAddress,
    /// Share of the REV tasks that are carried out again; one at least.
    #[arg(long, value_name = "SHARE", default_value = "1%", value_parser = share)]
    sample: f64,
    /// Decides which tasks those are: another seed, other tasks.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

/// `1%` or `0.01`.
fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), 100.0),
        None => (text, 1.0),
    };
    let share = number.parse::<f64>().map(|number| number / unit);
    match share {
        Ok(share) if share > 0.0 && share <= 1.0 => Ok(share),
        _ => Err("write a share above 0 and up to 100%, as in `1%` or `0.01`".to_owned()),
    }
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let sample = Sample {
        share: args.sample,
        seed: args.seed,
    };
    run::verify(context, &args.address, sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_that_is_none_is_refused() {
        assert_eq!(share("1%"), Ok(0.01));
        assert_eq!(share("100 %"), Ok(1.0));
        assert_eq!(share("0.25"), Ok(0.25));
        for wrong in ["0", "101%", "1.5", "-1%", "nan", "", "%", "all"] {
            assert!(share(wrong).is_err(), "{wrong}");
        }
    }
}
