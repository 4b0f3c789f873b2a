//! The load programme: from named loads and stages to one pair of load values per load step.

mod stop;

use serde::{Deserialize, Serialize};

pub use stop::{Along, Bound, Measured, Stop};

use super::plain::Plain;

/// The most load steps of one programme.
pub const MOST_STEPS: u64 = 1_000_000;

/// How the loads change in the course of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Programme {
    /// What was gone before this programme begins, where it takes up a run at a later load step; otherwise empty.
    #[serde(default)]
    pub past: Vec<PastStage>,
    /// The values of all loads before the first step of `stages`, in the order of `Problem::loads`.
    pub initial: Vec<f64>,
    /// The stages, one after the other; never empty.
    pub stages: Vec<Stage>,
}

/// A stage of an earlier programme, as far as it was gone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PastStage {
    /// Its name.
    pub name: String,
    /// Increments of it that were gone, one that was left on the way included.
    pub increments: u64,
}

/// One stage of a programme: its ways, gone `times` times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Name, unique in the programme.
    pub name: String,
    /// One for a ramp or a hold, two for a cycle.
    pub ways: Vec<Way>,
    /// How often they are gone, at least once.
    pub times: u32,
    /// Load steps of each way, at least one.
    pub steps: u32,
    /// The stage ends before its last load step where one of these is met.
    #[serde(default)]
    pub until: Vec<Stop>,
}

/// Where some loads go; the others keep their value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// Index of each load and the value it is brought to.
    pub targets: Vec<(usize, f64)>,
    /// What is followed in place of a load, which adapts.
    #[serde(default)]
    pub control: Option<Control>,
}

/// What a way follows in place of a load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Control {
    /// Index of the load that adapts.
    pub load: usize,
    /// What is followed.
    pub path: Followed,
}

impl Control {
    /// What it says, `loads` being the names of the loads.
    pub fn words(&self, loads: &[String]) -> String {
        let name = loads.get(self.load).map_or("", String::as_str);
        match &self.path {
            Followed::Volume { boundary, to } => {
                format!("{name} by the volume of {boundary} to {}", Plain(*to))
            }
            Followed::ArcLength { length, sense } => {
                let sense = if *sense < 0.0 { "falling" } else { "rising" };
                let length = Plain(*length);
                format!("{name} along a path of {length}, {sense} at first")
            }
        }
    }
}

/// What a way may follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Followed {
    /// The volume of a cavity.
    Volume {
        /// The boundary that encloses it.
        boundary: String,
        /// V/V0 − 1 at the end of the way.
        to: f64,
    },
    /// The length of the deformation's path.
    ArcLength {
        /// Root mean squares of the nodes' displacements, added up over the load steps of the way.
        length: f64,
        /// Sign of the first change of the load.
        sense: f64,
    },
}

/// One increment of the programme: one load step, unless the solver has to cut it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Number of the step, from 1; 0 is the initial state.
    pub index: u64,
    /// Index of its stage.
    pub stage: usize,
    /// Number of the step within its stage, from 1.
    pub within: u64,
    /// The values of all loads at its beginning, as far as they are known beforehand: one that adapted in an earlier way is
    /// known again at the end of the next way that brings it to a value.
    pub from: Vec<Option<f64>>,
    /// The values of all loads at its end, likewise.
    pub to: Vec<Option<f64>>,
    /// Load steps left of its way, itself included.
    pub left: u32,
    /// Where its way leads.
    pub way: Way,
    /// Load steps of its way.
    pub of: u32,
}

impl Stage {
    /// Number of load steps of the stage.
    pub fn len(&self) -> u64 {
        // Saturates only for numbers that the input does not take.
        (self.ways.len() as u64)
            .saturating_mul(u64::from(self.times))
            .saturating_mul(u64::from(self.steps))
    }

    /// Whether it has no load step; never, when it comes from an input.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Programme {
    /// Number of load steps of the whole programme, those of its past included.
    pub fn len(&self) -> u64 {
        self.stages
            .iter()
            .fold(self.offset(), |sum, stage| sum.saturating_add(stage.len()))
    }

    /// Number of load steps before the first one of `stages`.
    pub fn offset(&self) -> u64 {
        self.past
            .iter()
            .fold(0, |sum, stage| sum.saturating_add(stage.increments))
    }

    /// The boundaries whose enclosed volume it asks for.
    pub fn cavities(&self) -> impl Iterator<Item = &str> {
        self.stages.iter().flat_map(|stage| {
            let controls = stage.ways.iter().filter_map(|way| way.control.as_ref());
            let followed = controls.filter_map(|control| match &control.path {
                Followed::Volume { boundary, .. } => Some(boundary.as_str()),
                Followed::ArcLength { .. } => None,
            });
            let stops = stage.until.iter().filter_map(|stop| match stop {
                Stop::Volume(boundary, _) => Some(boundary.as_str()),
                _ => None,
            });
            followed.chain(stops)
        })
    }

    /// The names of the stages, past ones first.
    pub fn stage_names(&self) -> impl Iterator<Item = &str> {
        let past = self.past.iter().map(|stage| stage.name.as_str());
        past.chain(self.stages.iter().map(|stage| stage.name.as_str()))
    }

    /// The first `increments` load steps as the past of another programme.
    pub fn until(&self, increments: u64) -> Vec<PastStage> {
        let own = self.stages.iter().map(|stage| PastStage {
            name: stage.name.clone(),
            increments: stage.len(),
        });
        let mut left = increments;
        let mut past = Vec::new();
        for stage in self.past.iter().cloned().chain(own) {
            let increments = stage.increments.min(left);
            left -= increments;
            if increments > 0 {
                past.push(PastStage {
                    increments,
                    ..stage
                });
            }
        }
        past
    }

    /// Whether it has no load step; never, when it comes from an input.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All load steps of `stages` in their order, numbered on from the past.
    ///
    /// On a way of n steps a load that goes from a to b has after step i the value a + (b − a)·i/n, and after the last
    /// one exactly b, whatever the rounding.
    pub fn steps(&self) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut now: Vec<Option<f64>> = self.initial.iter().copied().map(Some).collect();
        let offset = self.offset();
        for (number, stage) in self.stages.iter().enumerate() {
            let mut within = 0;
            // Where a stage may end early, no value is certain until a later way sets it.
            let certain = stage.until.is_empty();
            for _ in 0..stage.times {
                for way in &stage.ways {
                    let start = now.clone();
                    for i in 1..=stage.steps {
                        let from = now.clone();
                        for &(load, target) in &way.targets {
                            if let (Some(value), Some(a)) = (now.get_mut(load), start.get(load)) {
                                *value = if i == stage.steps {
                                    Some(target)
                                } else {
                                    let part = f64::from(i) / f64::from(stage.steps);
                                    a.map(|a| a + (target - a) * part)
                                };
                            }
                        }
                        if let Some(control) = &way.control
                            && let Some(value) = now.get_mut(control.load)
                        {
                            *value = None;
                        }
                        within += 1;
                        let index = offset + steps.len() as u64 + 1;
                        steps.push(Step {
                            index,
                            stage: number,
                            within,
                            from,
                            to: now.clone(),
                            left: stage.steps - i + 1,
                            way: way.clone(),
                            of: stage.steps,
                        });
                    }
                }
            }
            if !certain {
                let moved = stage.ways.iter().flat_map(|way| &way.targets);
                for &(load, _) in moved {
                    if let Some(value) = now.get_mut(load) {
                        *value = None;
                    }
                }
            }
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(name: &str, ways: &[f64], times: u32, steps: u32) -> Stage {
        let ways = ways
            .iter()
            .map(|&target| Way {
                targets: vec![(0, target)],
                control: None,
            })
            .collect();
        Stage {
            name: name.into(),
            ways,
            times,
            steps,
            until: Vec::new(),
        }
    }

    fn known(values: &[Option<f64>]) -> Vec<f64> {
        values.iter().map(|value| value.expect("known")).collect()
    }

    #[test]
    fn a_ramp_ends_exactly_on_its_target_and_the_steps_are_chained() {
        let programme = Programme {
            past: Vec::new(),
            initial: vec![0.1, 7.0],
            stages: vec![stage("a", &[0.7], 1, 3), stage("b", &[-0.3], 1, 7)],
        };
        let steps = programme.steps();
        assert_eq!(steps.len() as u64, programme.len());
        assert_eq!(known(&steps[2].to), [0.7, 7.0]);
        assert_eq!(known(&steps[9].to), [-0.3, 7.0]);
        assert_eq!(known(&steps[0].from), programme.initial);
        assert!(
            steps
                .windows(2)
                .all(|pair| pair[0].to == pair[1].from && pair[0].index + 1 == pair[1].index)
        );
    }

    #[test]
    fn what_takes_a_programme_up_counts_on_from_where_it_was_left() {
        let first = Programme {
            past: Vec::new(),
            initial: vec![0.0],
            stages: vec![stage("a", &[0.4], 1, 4), stage("b", &[0.8], 1, 4)],
        };
        let past = first.until(6);
        assert_eq!(past.iter().map(|stage| stage.increments).sum::<u64>(), 6);
        let second = Programme {
            past,
            initial: vec![0.6],
            stages: vec![stage("back", &[0.0], 1, 3)],
        };
        assert_eq!((second.len(), second.steps()[0].index), (9, 7));
        assert_eq!(known(&second.steps()[0].from), [0.6]);
        let third = second.until(7);
        let names: Vec<_> = third
            .iter()
            .map(|s| (s.name.as_str(), s.increments))
            .collect();
        assert_eq!(names, [("a", 4), ("b", 2), ("back", 1)]);
    }

    #[test]
    fn a_cycle_goes_both_ways_each_time() {
        let programme = Programme {
            past: Vec::new(),
            initial: vec![0.0],
            stages: vec![stage("c", &[-0.2, -0.1], 2, 2)],
        };
        let values: Vec<f64> = programme
            .steps()
            .iter()
            .map(|step| known(&step.to)[0])
            .collect();
        assert_eq!(values.len(), 8);
        assert_eq!(
            [values[1], values[3], values[5], values[7]],
            [-0.2, -0.1, -0.2, -0.1]
        );
        assert!((values[0] + 0.1).abs() < 1e-15 && (values[2] + 0.15).abs() < 1e-15);
    }

    #[test]
    fn a_load_that_adapted_is_known_again_when_a_way_has_brought_it_to_a_value() {
        let mut inflate = stage("inflate", &[], 1, 2);
        let followed = Followed::Volume {
            boundary: "inner".into(),
            to: 0.1,
        };
        inflate.ways.push(Way {
            targets: Vec::new(),
            control: Some(Control {
                load: 0,
                path: followed,
            }),
        });
        let programme = Programme {
            past: Vec::new(),
            initial: vec![1.0],
            stages: vec![inflate, stage("unload", &[0.0], 1, 3)],
        };
        let to: Vec<_> = programme.steps().iter().map(|step| step.to[0]).collect();
        assert_eq!(to, [None, None, None, None, Some(0.0)]);
        let mut early = stage("early", &[2.0], 1, 2);
        early.until.push(Stop::Load(0, Bound::Above(1.2)));
        let programme = Programme {
            stages: vec![early, stage("hold", &[3.0], 1, 2)],
            ..programme
        };
        let to: Vec<_> = programme.steps().iter().map(|step| step.to[0]).collect();
        assert_eq!(to, [Some(1.5), Some(2.0), None, Some(3.0)]);
    }
}
