//! How long a run will still take, judged by the steps it has done.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Steps that the estimate looks back on: later steps cost more than early ones, so only the last ones count.
const WINDOW: usize = 5;

/// The times of the last steps.
#[derive(Debug)]
pub struct Remaining {
    since: Instant,
    last: VecDeque<Duration>,
}

impl Remaining {
    /// From now on.
    pub fn new() -> Self {
        Self {
            since: Instant::now(),
            last: VecDeque::new(),
        }
    }

    /// A step begins now, if none is in progress since the last one ended.
    pub fn restart(&mut self) {
        self.since = Instant::now();
    }

    /// A step is done; returns the time it took.
    pub fn step_done(&mut self) -> Duration {
        let took = self.since.elapsed();
        self.restart();
        self.record(took);
        took
    }

    fn record(&mut self, took: Duration) {
        if self.last.len() == WINDOW {
            self.last.pop_front();
        }
        self.last.push_back(took);
    }

    /// The time for `steps` more steps; unknown before the first one is done.
    pub fn estimate(&self, steps: u64) -> Option<Duration> {
        let count = u32::try_from(self.last.len())
            .ok()
            .filter(|&count| count > 0)?;
        let mean = self.last.iter().sum::<Duration>() / count;
        Some(mean.mul_f64(steps as f64))
    }
}

/// `8 s`, `3 min`, `2 h 10 min`, `3 d 4 h`.
pub fn in_words(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    let (minutes, hours, days) = ((seconds + 30) / 60, seconds / 3600, seconds / 86_400);
    match seconds {
        0..100 => format!("{seconds} s"),
        100..6000 => format!("{minutes} min"),
        6000..172_800 => format!("{hours} h {} min", seconds % 3600 / 60),
        _ => format!("{days} d {} h", seconds % 86_400 / 3600),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_estimate_follows_the_last_steps_not_the_first() {
        let mut remaining = Remaining::new();
        assert_eq!(remaining.estimate(3), None);
        for seconds in [1, 1, 1, 10, 10, 10, 10, 10] {
            remaining.record(Duration::from_secs(seconds));
        }
        assert_eq!(remaining.estimate(3), Some(Duration::from_secs(30)));
    }

    #[test]
    fn times_read_like_times() {
        let words = [0, 99, 100, 5999, 6000, 7800, 172_799, 172_800, 604_800];
        let words: Vec<String> = words
            .into_iter()
            .map(|s| in_words(Duration::from_secs(s)))
            .collect();
        assert_eq!(
            words,
            [
                "0 s",
                "99 s",
                "2 min",
                "100 min",
                "1 h 40 min",
                "2 h 10 min",
                "47 h 59 min",
                "2 d 0 h",
                "7 d 0 h"
            ]
        );
    }
}
