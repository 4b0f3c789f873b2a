//! Where a run is in its load programme.

use serde::{Deserialize, Serialize, Serializer, ser::SerializeStruct};
use solver_fem::{
    newton::{Control, Path},
    step_control::{StepControl, StepControlSettings, StepTooSmall, Taken},
};

use crate::input::{
    Problem, Step,
    programme::{Along, Followed, Measured, Stop},
};

/// The place in the programme: stored with every commit, so that a resumed run takes the same steps.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Place {
    /// Increments that are done.
    pub increments: u64,
    /// Step size within the current one.
    pub control: StepControl,
    /// Load values at the beginning of the present stage and at the ends of its latest increments, newest last, as far as
    /// its end may depend on them.
    #[serde(default)]
    pub latest: Vec<Vec<f64>>,
    /// The largest magnitude since the present stage began of what each of its conditions measures, 0 for those that look
    /// for no peak; empty where none does.
    #[serde(default)]
    pub peaks: Vec<f64>,
}

/// A place is stored as an array. What it has not is left out at the end of it, so that what a place in a plain programme
/// is stored as does not change with what others may have.
impl Serialize for Place {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let len = match (self.latest.as_slice(), self.peaks.as_slice()) {
            (_, [_, ..]) => 4,
            ([_, ..], []) => 3,
            ([], []) => 2,
        };
        let mut fields = serializer.serialize_struct("Place", len)?;
        fields.serialize_field("increments", &self.increments)?;
        fields.serialize_field("control", &self.control)?;
        if len > 2 {
            fields.serialize_field("latest", &self.latest)?;
        }
        if len > 3 {
            fields.serialize_field("peaks", &self.peaks)?;
        }
        fields.end()
    }
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
    stages: Vec<(String, Vec<Stop>)>,
    /// Names of the loads.
    loads: Vec<String>,
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
    /// Loads after; one that adapts begins its search there.
    pub to: Vec<f64>,
    /// What is followed in place of a load.
    pub control: Option<Control>,
}

/// What a load step may depend on beside the programme: the committed state.
pub trait Reached {
    /// Values of the loads.
    fn loads(&self) -> &[f64];
    /// V/V0 − 1 of the cavity behind a boundary.
    fn expansion(&self, boundary: &str) -> f64;
    /// Largest equivalent shear strain of a Gauss point.
    fn shear_strain(&self) -> f64;
    /// Mean displacement of the nodes there from their initial positions.
    fn displacement(&self, at: &Along) -> f64;
    /// Force that the supports there exert on the body.
    fn force(&self, at: &Along) -> f64;
}

/// The value of what may pass a peak.
fn measure(what: &Measured, now: &impl Reached) -> f64 {
    match what {
        Measured::Load(load) => now.loads().get(*load).copied().unwrap_or(f64::NAN),
        Measured::Force(at) => now.force(at),
    }
}

impl Schedule {
    /// The programme from its beginning, where it has no past.
    pub fn new(problem: &Problem, control: StepControlSettings) -> Self {
        let programme = &problem.programme;
        Self {
            loads: problem.loads.clone(),
            steps: programme.steps(),
            offset: programme.offset(),
            stages: programme
                .stages
                .iter()
                .map(|stage| (stage.name.clone(), stage.until.clone()))
                .collect(),
            place: Place {
                increments: 0,
                control: StepControl::new(control),
                latest: Vec::new(),
                peaks: Vec::new(),
            },
            cuts: 0,
        }
    }

    /// The programme at a stored place. A place in the past of the programme is that of the step which it takes up: what
    /// was left of the increment there is given up. Step-size control follows the given settings.
    pub fn at(problem: &Problem, control: StepControlSettings, place: Place) -> Self {
        let mut schedule = Self::new(problem, control);
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
    ///
    /// A load whose value is not known beforehand goes from where it is towards its target: over the part b − a of the
    /// present increment, n increments being left of the way, by (b − a)/(n − a) of the distance. So does a volume.
    pub fn next(&mut self, now: &impl Reached) -> Option<Interval> {
        let part = match self.place.control.interval() {
            Some(part) => part,
            None => {
                let before = self.step().map(|step| step.stage);
                self.place.increments += 1;
                self.place.control.next_increment();
                if self.step().map(|step| step.stage) != before {
                    self.place.latest.clear();
                    self.place.peaks.clear();
                }
                self.place.control.interval()?
            }
        };
        let looks_back = self
            .step()
            .and_then(|step| self.stage(step))
            .is_some_and(|(_, until)| until.iter().any(|stop| stop.steps().is_some()));
        if looks_back && self.place.latest.is_empty() {
            self.place.latest.push(now.loads().to_vec());
        }
        self.mark_peaks(now);
        let step = self.step()?;
        let (a, b) = part;
        let towards = |value: f64, target: f64| {
            if step.left == 1 && b >= 1.0 {
                target
            } else {
                value + (target - value) * (b - a) / (f64::from(step.left) - a)
            }
        };
        let planned = |load: usize, x: f64| -> Option<f64> {
            let (from, to) = ((*step.from.get(load)?)?, (*step.to.get(load)?)?);
            Some(if x >= 1.0 { to } else { from + (to - from) * x })
        };
        let values = now.loads().iter().copied().enumerate();
        let from = values
            .clone()
            .map(|(k, value)| planned(k, a).unwrap_or(value));
        let from: Vec<f64> = from.collect();
        let to = values.map(|(k, value)| {
            let target = step.way.targets.iter().find(|(load, _)| *load == k);
            planned(k, b)
                .unwrap_or_else(|| target.map_or(value, |(_, target)| towards(value, *target)))
        });
        let control = step.way.control.as_ref().map(|control| Control {
            load: control.load,
            path: match &control.path {
                Followed::Volume { boundary, to } => Path::Expansion {
                    boundary: boundary.clone(),
                    to: towards(now.expansion(boundary), *to),
                },
                Followed::ArcLength { length, sense } => Path::ArcLength {
                    length: length * (b - a) / f64::from(step.of),
                    sense: (step.left == step.of && a <= 0.0).then_some(*sense),
                },
            },
        });
        Some(Interval {
            increment: step.index,
            stage: self
                .stage(step)
                .map(|(name, _)| name.clone())
                .unwrap_or_default(),
            part,
            from,
            to: to.collect(),
            control,
        })
    }

    /// The present increment of the programme.
    fn step(&self) -> Option<&Step> {
        let index = self.place.increments.checked_sub(self.offset)?;
        self.steps.get(usize::try_from(index).ok()?)
    }

    fn stage(&self, step: &Step) -> Option<&(String, Vec<Stop>)> {
        self.stages.get(step.stage)
    }

    /// Ends the present stage where one of its conditions is met, the step before being committed and accepted; returns
    /// which one, in words.
    pub fn stop(&mut self, now: &impl Reached) -> Option<String> {
        let step = self.step()?;
        let (number, (_, until)) = (step.stage, self.stage(step)?);
        let until = until.clone();
        if let Some(longest) = until.iter().filter_map(Stop::steps).max() {
            // Not on the way through an increment that was cut.
            if self.place.control.interval().is_none() {
                self.place.latest.push(now.loads().to_vec());
            }
            let surplus = self.place.latest.len().saturating_sub(longest as usize + 1);
            self.place.latest.drain(..surplus);
        }
        self.mark_peaks(now);
        let mut numbered = until.into_iter().enumerate();
        let (_, stop) = numbered.find(|(index, stop)| self.is_met(*index, stop, now))?;
        let last = self.steps.iter().rposition(|step| step.stage == number)?;
        self.place.increments = self.offset + last as u64;
        self.place.control.end_increment();
        Some(stop.words(&self.loads))
    }

    /// Raises the peaks of the present stage to what is reached now, the same state counting once however often it is looked at.
    fn mark_peaks(&mut self, now: &impl Reached) {
        let Some((_, until)) = self.step().and_then(|step| self.stage(step)) else {
            return;
        };
        let drops = until.iter().map(|stop| match stop {
            Stop::Drop(what, _) => Some(measure(what, now).abs()),
            _ => None,
        });
        let reached: Vec<Option<f64>> = drops.collect();
        if reached.iter().all(Option::is_none) {
            return;
        }
        let peaks = &mut self.place.peaks;
        peaks.resize(reached.len(), 0.0);
        for (peak, value) in peaks.iter_mut().zip(reached) {
            *peak = peak.max(value.unwrap_or(0.0));
        }
    }

    /// Whether the condition of this index in the present stage is met.
    fn is_met(&self, index: usize, stop: &Stop, now: &impl Reached) -> bool {
        match stop {
            Stop::Load(load, bound) => now
                .loads()
                .get(*load)
                .is_some_and(|value| bound.holds(*value)),
            Stop::Volume(boundary, bound) => bound.holds(now.expansion(boundary)),
            Stop::ShearStrain(most) => now.shear_strain() > *most,
            Stop::Displacement(at, bound) => bound.holds(now.displacement(at)),
            Stop::Force(at, bound) => bound.holds(now.force(at)),
            Stop::Drop(what, part) => {
                let peak = self.place.peaks.get(index).copied().unwrap_or(0.0);
                // Where nothing acted yet, nothing has dropped.
                peak > 0.0 && measure(what, now).abs() <= (1.0 - part) * peak
            }
            Stop::Settled { load, within, over } => {
                let latest = &self.place.latest;
                let Some(from) = latest.len().checked_sub(*over as usize + 1) else {
                    return false;
                };
                let values = latest[from..].iter().filter_map(|loads| loads.get(*load));
                let least = values.clone().copied().fold(f64::INFINITY, f64::min);
                let most = values.copied().fold(f64::NEG_INFINITY, f64::max);
                most - least <= within * least.abs().max(most.abs())
            }
        }
    }

    /// Name of a load.
    pub fn load(&self, load: usize) -> &str {
        self.loads.get(load).map_or("", String::as_str)
    }

    /// The step is solved.
    pub fn accept(&mut self, taken: Taken) {
        self.place.control.accept(taken);
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
