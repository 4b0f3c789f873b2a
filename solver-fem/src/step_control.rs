//! Automatic step size: fractions of the current increment of the load programme.
//!
//! Halve on failure down to a floor, grow by a quarter after easy steps, never beyond the whole
//! increment. Beside that, halve where the overdamped motion took too much work out of the body, down to a quarter, and
//! double where it took next to none: what a step applied at once overshoots falls faster than the step.
//! The state is stored with every commit, so that a resumed run takes the same steps.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How the step size follows success and failure.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct StepControlSettings {
    /// Smallest fraction of an increment; 1/64: six halvings. Below it the obstacle is not the
    /// step size (measured down to 6e-5 of strain).
    pub floor: f64,
    /// Factor after a failure; ½, so that cut steps end where an uncut one would.
    pub cut: f64,
    /// Factor after an easy step.
    pub growth: f64,
    /// A step is easy when it took no more sweeps than this.
    pub easy_sweeps: usize,
    /// Share of the work put into the body that the overdamped motion may take; 0.01. Steps follow half of it, as the first
    /// one that is above has been taken already. From 1 on they do not follow it.
    pub damped_work: f64,
    /// Part of an increment below which no share of work shortens a step; ¼, but no less than the floor. What is left then
    /// is set free by instabilities.
    pub gentlest: f64,
}

impl Default for StepControlSettings {
    fn default() -> Self {
        StepControlSettings {
            floor: 1.0 / 64.0,
            cut: 0.5,
            growth: 1.25,
            easy_sweeps: 4,
            damped_work: 0.01,
            gentlest: 0.25,
        }
    }
}

/// The step cannot be cut further.
#[derive(Error, Clone, Copy, PartialEq, Debug)]
#[error("cut the step: it is already at {factor:.4} of the increment, the floor is {floor:.4}")]
pub struct StepTooSmall {
    /// The factor that failed.
    pub factor: f64,
    /// The smallest one allowed.
    pub floor: f64,
}

/// What a committed step took.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Taken {
    /// Its sweeps.
    pub sweeps: usize,
    /// Work of the stresses on its strains.
    pub work: f64,
    /// Work of the unbalanced forces in the overdamped motion.
    pub damped: f64,
}

/// Step size control within the increments of a load programme.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct StepControl {
    settings: StepControlSettings,
    factor: f64,
    position: f64,
    /// Largest part of an increment for the sake of the damped work.
    #[serde(default = "whole")]
    gentle: f64,
    /// |Work| of all steps.
    #[serde(default)]
    work: f64,
    /// The increments that it was done in.
    #[serde(default)]
    done: f64,
}

fn whole() -> f64 {
    1.0
}

impl StepControl {
    /// Starts with whole increments. Settings out of range are pulled into it: floor to (0, 1],
    /// cut to [0.1, 0.9], growth to at least 1, the share of work to at least 0, and the gentlest step to (0, 1].
    pub fn new(settings: StepControlSettings) -> Self {
        let sane = |value: f64, low: f64, high: f64, fallback: f64| {
            if value.is_finite() {
                value.clamp(low, high)
            } else {
                fallback
            }
        };
        let settings = StepControlSettings {
            floor: sane(settings.floor, 1e-9, 1.0, 1.0 / 64.0),
            cut: sane(settings.cut, 0.1, 0.9, 0.5),
            growth: sane(settings.growth, 1.0, 1e3, 1.25),
            easy_sweeps: settings.easy_sweeps,
            damped_work: sane(settings.damped_work, 0.0, f64::MAX, 0.01),
            gentlest: sane(settings.gentlest, 1e-9, 1.0, 0.25),
        };
        StepControl {
            settings,
            factor: 1.0,
            position: 0.0,
            gentle: 1.0,
            work: 0.0,
            done: 0.0,
        }
    }

    /// The next step as (from, to), fractions of the current increment; `None` at its end.
    pub fn interval(&self) -> Option<(f64, f64)> {
        if self.position >= 1.0 {
            return None;
        }
        let to = self.position + self.factor();
        // A sliver shorter than half the floor is not worth a step of its own.
        let to = if to > 1.0 - 0.5 * self.settings.floor {
            1.0
        } else {
            to
        };
        Some((self.position, to))
    }

    /// Size of the next step as a fraction of an increment.
    pub fn factor(&self) -> f64 {
        self.factor.min(self.gentle)
    }

    /// The step was committed.
    pub fn accept(&mut self, taken: Taken) {
        if let Some((from, to)) = self.interval() {
            self.position = to;
            self.follow_work(taken, to - from);
        }
        if taken.sweeps <= self.settings.easy_sweeps {
            self.factor = (self.factor * self.settings.growth).min(1.0);
        }
    }

    /// The share is that in the work of the step or, where that is small, as on the way back from a load, in the mean work
    /// of steps of its size.
    fn follow_work(&mut self, taken: Taken, size: f64) {
        /// A step of twice the size does about four times the share.
        const LITTLE: f64 = 0.25;

        self.work += taken.work.abs();
        self.done += size;
        let usual = size * self.work / self.done;
        let aim = 0.5 * self.settings.damped_work * taken.work.abs().max(usual);
        if self.settings.damped_work >= 1.0 {
            self.gentle = 1.0;
        } else if taken.damped > aim {
            let least = self.settings.gentlest.max(self.settings.floor);
            self.gentle = (0.5 * self.gentle).max(least.min(self.gentle));
        } else if taken.damped < LITTLE * aim && size >= self.gentle {
            self.gentle = (2.0 * self.gentle).min(1.0);
        }
    }

    /// The step failed: try a shorter one from the same committed state.
    ///
    /// # Errors
    /// The step is at the floor already.
    pub fn cut(&mut self) -> Result<(), StepTooSmall> {
        let floor = self.settings.floor;
        // What was tried may be shorter than the factor, at the end of an increment.
        let tried = self
            .interval()
            .map_or(self.factor(), |(from, to)| (to - from).min(self.factor()));
        if tried <= floor * (1.0 + 1e-12) {
            return Err(StepTooSmall {
                factor: tried,
                floor,
            });
        }
        self.factor = (tried * self.settings.cut).max(floor);
        Ok(())
    }

    /// Leaves the rest of the current increment undone; the step size is kept.
    pub fn end_increment(&mut self) {
        self.position = 1.0;
    }

    /// The same step size at the same place, following other settings from here on.
    pub fn with_settings(self, settings: StepControlSettings) -> Self {
        let settings = Self::new(settings).settings;
        let follows = settings.damped_work < 1.0;
        StepControl {
            settings,
            gentle: if follows { self.gentle } else { 1.0 },
            ..self
        }
    }

    /// Goes on to the next increment of the programme; the step size is kept.
    pub fn next_increment(&mut self) {
        self.position = 0.0;
    }
}

impl Default for StepControl {
    fn default() -> Self {
        Self::new(StepControlSettings::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_increment_ends_exactly_at_one_after_cuts_and_growth() {
        let mut control = StepControl::default();
        assert_eq!(control.interval(), Some((0.0, 1.0)));
        control.cut().expect("above the floor");
        control.cut().expect("above the floor");
        let mut steps = 0;
        let mut last = 0.0;
        while let Some((from, to)) = control.interval() {
            assert_eq!(from, last);
            assert!(to > from && to <= 1.0);
            last = to;
            control.accept(easy());
            steps += 1;
        }
        assert_eq!(last, 1.0);
        assert_eq!(steps, 4, "0.25, 0.3125, 0.390625 and the rest");
        assert!(control.factor() <= 1.0);
    }

    #[test]
    fn cutting_ends_at_the_floor_with_an_error() {
        let mut control = StepControl::default();
        for _ in 0..6 {
            control.cut().expect("above the floor");
        }
        assert_eq!(control.interval(), Some((0.0, 1.0 / 64.0)));
        assert!(control.cut().is_err());
        control.accept(Taken {
            sweeps: 20,
            ..easy()
        });
        assert_eq!(control.factor(), 1.0 / 64.0, "a hard step does not grow");
    }

    /// The share falls with the square of the step, here 2 % for a whole increment.
    #[test]
    fn steps_are_as_long_as_the_damped_work_allows() {
        let mut control = StepControl::default();
        let (mut work, mut damped) = (0.0, 0.0);
        let mut sizes = Vec::new();
        for _ in 0..10 {
            while let Some((from, to)) = control.interval() {
                let size = to - from;
                let taken = Taken {
                    sweeps: 20,
                    work: size,
                    damped: 0.02 * size.powi(3),
                };
                control.accept(taken);
                sizes.push(size);
                work += taken.work;
                damped += taken.damped;
            }
            control.next_increment();
        }
        assert_eq!(sizes[..4], [1.0, 0.5, 0.5, 0.5]);
        assert!(damped < 0.01 * work, "{damped} of {work}");
    }

    #[test]
    fn steps_that_may_not_be_cut_are_not_shortened_for_the_work() {
        let mut control = StepControl::new(StepControlSettings {
            floor: 1.0,
            ..StepControlSettings::default()
        });
        control.accept(Taken {
            damped: 0.5,
            ..easy()
        });
        assert_eq!(control.factor(), 1.0);
    }

    #[test]
    fn a_step_that_does_no_work_is_judged_by_the_usual_one() {
        let mut control = StepControl::default();
        for damped in [0.0, 1e-4] {
            let work = if damped == 0.0 { 1.0 } else { 1e-9 };
            control.accept(Taken {
                sweeps: 20,
                work,
                damped,
            });
            control.next_increment();
        }
        assert_eq!(control.factor(), 1.0, "1e-4 is little beside 0.5");
    }

    #[test]
    fn instabilities_shorten_steps_to_a_quarter_and_quiet_ones_lengthen_them_again() {
        let mut control = StepControl::default();
        let mut after = |damped: f64| {
            control.accept(Taken {
                sweeps: 20,
                work: 1.0,
                damped,
            });
            control.next_increment();
            control.factor()
        };
        assert_eq!([after(0.1), after(0.1), after(0.1)], [0.5, 0.25, 0.25]);
        assert_eq!([after(0.002), after(0.0), after(0.0)], [0.25, 0.5, 1.0]);
    }

    fn easy() -> Taken {
        Taken {
            sweeps: 3,
            work: 1.0,
            damped: 0.0,
        }
    }
}
