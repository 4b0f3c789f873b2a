//! Where a run is in its load programme.

use serde::{Deserialize, Serialize};
use solver_fem::step_control::{StepControl, StepControlSettings, StepTooSmall};

use crate::input::{Programme, Step};

/// The place in the programme: stored with every commit, so that a resumed run takes the same steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Increments that are done.
    pub increments: u64,
    /// Step size within the current one.
    pub control: StepControl,
}

impl Place {
    /// Increments that are done, the present one included when it is at its end.
    pub fn done(&self) -> u64 {
        self.increments + u64::from(self.control.interval().is_none())
    }
}

impl Place {
    /// Increments that are done or begun: what another programme that takes over here has behind it.
    pub fn begun(&self) -> u64 {
        let untouched = matches!(self.control.interval(), Some((from, _)) if from <= 0.0);
        self.increments + u64::from(!untouched)
    }
}

/// The load programme and the place in it.
pub struct Schedule {
    steps: Vec<Step>,
    /// Increments before the first of `steps`.
    offset: u64,
    stages: Vec<String>,
    /// The place, as of the last commit or cut.
    pub place: Place,
    /// Attempts at the present step that failed.
    pub cuts: u32,
}

/// The load step to take.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// Increment of the programme, from 1.
    pub increment: u64,
    /// Stage of the programme.
    pub stage: String,
    /// Part of the increment that is covered.
    pub part: (f64, f64),
    /// Loads before.
    pub from: Vec<f64>,
    /// Loads after.
    pub to: Vec<f64>,
}

impl Schedule {
    /// The programme from its beginning, where it has no past.
    pub fn new(programme: &Programme, control: StepControlSettings) -> Self {
        Self {
            steps: programme.steps(),
            offset: programme.offset(),
            stages: programme
                .stages
                .iter()
                .map(|stage| stage.name.clone())
                .collect(),
            place: Place {
                increments: 0,
                control: StepControl::new(control),
            },
            cuts: 0,
        }
    }

    /// The programme at a stored place. A place in the past of the programme is that of the step which it takes up: what
    /// was left of the increment there is given up. Step-size control follows the given settings.
    pub fn at(programme: &Programme, control: StepControlSettings, place: Place) -> Self {
        let mut schedule = Self::new(programme, control);
        schedule.place = Place {
            control: place.control.with_settings(control),
            ..place
        };
        if let Some(last) = schedule
            .offset
            .checked_sub(1)
            .filter(|last| place.increments <= *last)
        {
            schedule.place.increments = last;
            schedule.place.control.end_increment();
        }
        schedule
    }

    /// Number of increments, those before the programme included.
    pub fn increments(&self) -> u64 {
        self.offset + self.steps.len() as u64
    }

    /// The next load step; `None` at the end of the programme.
    pub fn next(&mut self) -> Option<Interval> {
        let part = match self.place.control.interval() {
            Some(part) => part,
            None => {
                self.place.increments += 1;
                self.place.control.next_increment();
                self.place.control.interval()?
            }
        };
        let index = self.place.increments.checked_sub(self.offset)?;
        let step = self.steps.get(usize::try_from(index).ok()?)?;
        let at = |x: f64| -> Vec<f64> {
            let ends = step.from.iter().zip(&step.to);
            ends.map(|(a, b)| if x >= 1.0 { *b } else { a + (b - a) * x })
                .collect()
        };
        Some(Interval {
            increment: step.index,
            stage: self.stages.get(step.stage).cloned().unwrap_or_default(),
            part,
            from: at(part.0),
            to: at(part.1),
        })
    }

    /// The step is solved in this number of sweeps.
    pub fn accept(&mut self, sweeps: usize) {
        self.place.control.accept(sweeps);
        self.cuts = 0;
    }

    /// The step failed; the next attempt is shorter.
    ///
    /// # Errors
    /// It is as short as it may be.
    pub fn cut(&mut self) -> Result<(), StepTooSmall> {
        self.place.control.cut()?;
        self.cuts += 1;
        Ok(())
    }
}
