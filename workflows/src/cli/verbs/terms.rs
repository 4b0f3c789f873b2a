//! On what terms a verb computes: the options that `submit`, `resume`, `branch` and `rerun` share.

use std::time::SystemTime;

use jiff::{Span, Timestamp, Zoned, civil};

use crate::cli::supervise::Order;
use crate::run::{Context, Sharing, Terms};

/// How long a process computes, and what happens where it dies.
#[derive(Debug, Clone, clap::Args)]
pub struct Supervised {
    /// Stop in order at this time: `18:30` (the next one), `2026-11-27T06:00`, both local time, or after a span, `7h 50m`.
    ///
    /// What is committed and journalled stays, `resume` goes on, and the exit code is 75.
    #[arg(long, value_name = "TIME", value_parser = until)]
    until: Option<SystemTime>,
    /// Start again, so often at most, where the computing process dies: of a signal that nobody ordered, as when memory runs
    /// out, or of a bug. A stop in order or a step that cannot be solved is no reason.
    #[arg(long, value_name = "N", default_value = "0")]
    max_restarts: u32,
}

/// The terms of verbs that bring work of their own.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    #[command(flatten)]
    supervised: Supervised,
    /// Do not queue the work where another process holds the store, but fail with exit code 3; and leave what is queued alone.
    #[arg(long)]
    alone: bool,
    /// Only queue the work; `queue run`, or whoever computes in the store next, does it.
    #[arg(long, conflicts_with_all = ["alone", "until", "max_restarts"])]
    queue: bool,
}

impl Supervised {
    /// In the words of [`crate::run`]. A supervised process is told its deadline: a span would begin anew in each life.
    pub fn terms(&self, context: &Context<'_>) -> Terms {
        Terms {
            deadline: match context.supervision {
                Some(supervision) => supervision.deadline,
                None => self.until,
            },
            sharing: Sharing::Queue,
            ticket: context.supervision.map(|told| told.ticket.clone()),
        }
    }

    /// What is asked of a supervisor, if one is asked for.
    pub fn order(&self) -> Option<Order> {
        (self.max_restarts > 0).then_some(Order {
            restarts: self.max_restarts,
            deadline: self.until,
        })
    }
}

impl Args {
    /// In the words of [`crate::run`].
    pub fn terms(&self, context: &Context<'_>) -> Terms {
        Terms {
            sharing: match (self.alone, self.queue) {
                (true, _) => Sharing::Alone,
                (_, true) => Sharing::Later,
                _ => Sharing::Queue,
            },
            ..self.supervised.terms(context)
        }
    }

    /// How the verb is supervised.
    pub fn supervised(&self) -> &Supervised {
        &self.supervised
    }
}

fn until(text: &str) -> Result<SystemTime, String> {
    instant(text, &Zoned::now()).map(SystemTime::from)
}

/// The instant that `text` means to somebody at `now`, in the time zone of `now`.
fn instant(text: &str, now: &Zoned) -> Result<Timestamp, String> {
    let text = text.trim();
    let zone = now.time_zone();
    let passed = |at: Timestamp| match at > now.timestamp() {
        true => Ok(at),
        false => Err("that time has passed".to_owned()),
    };
    let local = |at: civil::DateTime| {
        let zoned = at.to_zoned(zone.clone());
        zoned
            .map(|zoned| zoned.timestamp())
            .map_err(|error| error.to_string())
    };
    let far = |error: jiff::Error| error.to_string();
    // Of a date with a time, jiff would give the time.
    let time_of_day = text.contains(':') && !text.contains('-');
    if let (true, Ok(time)) = (time_of_day, text.parse::<civil::Time>()) {
        let today = local(now.date().to_datetime(time))?;
        if today > now.timestamp() {
            return Ok(today);
        }
        return local(now.date().tomorrow().map_err(far)?.to_datetime(time));
    }
    if let Ok(at) = text.parse::<Timestamp>() {
        return passed(at);
    }
    if let Ok(at) = text.parse::<civil::DateTime>() {
        return passed(local(at)?);
    }
    if let Ok(span) = text.parse::<Span>() {
        return passed(now.checked_add(span).map_err(far)?.timestamp());
    }
    Err("write a time of day (`18:30`), a date with time (`2026-11-27T06:00`) or a span (`8h`, `7h 50m`)".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Result<String, String> {
        let now: Zoned = "2026-11-26T17:00[Europe/Berlin]".parse().unwrap();
        instant(text, &now).map(|at| at.to_string())
    }

    #[test]
    fn times_are_local_and_ahead() {
        assert_eq!(at("18:30").unwrap(), "2026-11-26T17:30:00Z");
        assert_eq!(at("06:00").unwrap(), "2026-11-27T05:00:00Z");
        assert_eq!(at("17:00").unwrap(), "2026-11-27T16:00:00Z");
        assert_eq!(at("2026-11-27T06:00").unwrap(), "2026-11-27T05:00:00Z");
        assert_eq!(at("2026-11-27 06:00:30").unwrap(), "2026-11-27T05:00:30Z");
        assert_eq!(at("2026-11-27T06:00Z").unwrap(), "2026-11-27T06:00:00Z");
        // Summer time.
        assert_eq!(at("2027-07-01T06:00").unwrap(), "2027-07-01T04:00:00Z");
    }

    #[test]
    fn spans_count_from_now() {
        assert_eq!(at("8h").unwrap(), "2026-11-27T00:00:00Z");
        assert_eq!(at("7h 50m").unwrap(), "2026-11-26T23:50:00Z");
        assert_eq!(at("90min").unwrap(), "2026-11-26T17:30:00Z");
        assert_eq!(at("1.5s").unwrap(), "2026-11-26T16:00:01.5Z");
        assert_eq!(at("2 days").unwrap(), "2026-11-28T16:00:00Z");
    }

    #[test]
    fn what_is_no_time_or_has_passed_is_refused() {
        for text in [
            "",
            "soon",
            "25:00",
            "8",
            "2026-11-26T16:59",
            "-1h",
            "2026-13-01",
        ] {
            assert!(at(text).is_err(), "{text}");
        }
    }
}
