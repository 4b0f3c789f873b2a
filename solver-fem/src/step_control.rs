//! Automatic step size: fractions of the current increment of the load programme.
//!
//! Halve on failure down to a floor, grow by a quarter after easy steps, never beyond the whole
//! increment. The state is stored with every commit, so that a resumed run takes the same steps.

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
}

impl Default for StepControlSettings {
    fn default() -> Self {
        StepControlSettings {
            floor: 1.0 / 64.0,
            cut: 0.5,
            growth: 1.25,
            easy_sweeps: 4,
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

/// Step size control within the increments of a load programme.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct StepControl {
    settings: StepControlSettings,
    factor: f64,
    position: f64,
}

impl StepControl {
    /// Starts with whole increments. Settings out of range are pulled into it: floor to (0, 1],
    /// cut to [0.1, 0.9], growth to at least 1.
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
        };
        StepControl {
            settings,
            factor: 1.0,
            position: 0.0,
        }
    }

    /// The next step as (from, to), fractions of the current increment; `None` at its end.
    pub fn interval(&self) -> Option<(f64, f64)> {
        if self.position >= 1.0 {
            return None;
        }
        let to = self.position + self.factor;
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
        self.factor
    }

    /// The step was committed after this number of sweeps.
    pub fn accept(&mut self, sweeps: usize) {
        if let Some((_, to)) = self.interval() {
            self.position = to;
        }
        if sweeps <= self.settings.easy_sweeps {
            self.factor = (self.factor * self.settings.growth).min(1.0);
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
            .map_or(self.factor, |(from, to)| (to - from).min(self.factor));
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
        StepControl {
            factor: self.factor,
            position: self.position,
            ..Self::new(settings)
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
            control.accept(3);
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
        control.accept(20);
        assert_eq!(control.factor(), 1.0 / 64.0, "a hard step does not grow");
    }
}
