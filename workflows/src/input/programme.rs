//! The load programme: from named loads and stages to one pair of load values per load step.

use serde::{Deserialize, Serialize};

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
}

/// Where some loads go; the others keep their value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// Index of each load and the value it is brought to.
    pub targets: Vec<(usize, f64)>,
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
    /// The values of all loads at its beginning.
    pub from: Vec<f64>,
    /// The values of all loads at its end.
    pub to: Vec<f64>,
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
        let mut now = self.initial.clone();
        let offset = self.offset();
        for (number, stage) in self.stages.iter().enumerate() {
            let mut within = 0;
            for _ in 0..stage.times {
                for way in &stage.ways {
                    let start = now.clone();
                    for i in 1..=stage.steps {
                        let from = now.clone();
                        for &(load, target) in &way.targets {
                            let (Some(value), Some(a)) = (now.get_mut(load), start.get(load))
                            else {
                                continue;
                            };
                            let last = i == stage.steps;
                            *value = if last {
                                target
                            } else {
                                a + (target - a) * (f64::from(i) / f64::from(stage.steps))
                            };
                        }
                        within += 1;
                        let index = offset + steps.len() as u64 + 1;
                        steps.push(Step {
                            index,
                            stage: number,
                            within,
                            from,
                            to: now.clone(),
                        });
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
            })
            .collect();
        Stage {
            name: name.into(),
            ways,
            times,
            steps,
        }
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
        assert_eq!(steps[2].to, [0.7, 7.0]);
        assert_eq!(steps[9].to, [-0.3, 7.0]);
        assert_eq!(steps[0].from, programme.initial);
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
        assert_eq!(second.steps()[0].from, [0.6]);
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
        let values: Vec<f64> = programme.steps().iter().map(|step| step.to[0]).collect();
        assert_eq!(values.len(), 8);
        assert_eq!(
            [values[1], values[3], values[5], values[7]],
            [-0.2, -0.1, -0.2, -0.1]
        );
        assert!((values[0] + 0.1).abs() < 1e-15 && (values[2] + 0.15).abs() < 1e-15);
    }
}
