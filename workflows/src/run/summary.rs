//! What lists say about a committed step.

use std::fmt;

use serde::{Deserialize, Serialize};
use solver_dem::{Method, Report};
use solver_fem::newton::{Acceptance, SweepReport};

/// Figures of a committed step. Durations in it are measurements; they are no part of its digest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepSummary {
    /// Increment of the programme, from 1; 0 for the initial state.
    pub increment: u64,
    /// Stage of the programme; empty for the initial state.
    pub stage: String,
    /// Part of the increment reached.
    pub position: f64,
    /// Load values at the end.
    pub loads: Vec<f64>,
    /// Whether the residual is within the tolerance or only within the loose one.
    pub loosely_accepted: bool,
    /// ‖R_free‖/max(‖reactions‖, ‖external‖).
    pub residual: f64,
    /// Every sweep of the attempt that succeeded.
    pub sweeps: Vec<SweepReport>,
    /// Attempts that failed before it.
    pub cuts: u32,
    /// The REV solves of all attempts in this session.
    pub revs: RevFigures,
    /// Wall seconds of the step, pauses left out, sessions added up as far as known.
    pub wall_s: f64,
    /// CPU seconds of its tasks.
    pub cpu_s: f64,
    /// CPU seconds outside the tasks: assembly, linear solves, journal, and the commit of the step before, as no step
    /// can say what its own cost.
    pub director_s: f64,
    /// Work of the stresses on the strains of the step, over the body.
    #[serde(default)]
    pub work: f64,
    /// Work of the unbalanced forces between its iterates: what instabilities set free, and what the step overshot.
    #[serde(default)]
    pub released: f64,
    /// Gauss points whose grains do not touch at its end.
    #[serde(default)]
    pub voids: u32,
    /// Why its stage ended with it before the last increment; empty where it did not.
    #[serde(default)]
    pub ended: String,
    /// The part of `released` that the overdamped motion did.
    #[serde(default)]
    pub damped: f64,
}

impl StepSummary {
    /// How well the step was solved.
    pub fn accept(&mut self, acceptance: Acceptance, residual: f64) {
        self.loosely_accepted = matches!(acceptance, Acceptance::LooselyAccepted { .. });
        self.residual = residual;
    }
}

/// Work done on a body in some steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energy {
    /// Of the stresses on the strains.
    pub work: f64,
    /// The magnitude of that, step by step: what a body gives back counts as well.
    pub exchanged: f64,
    /// Of the unbalanced forces from iterate to iterate: what instabilities set free, and what a whole load step
    /// overshoots before the grains yield.
    pub released: f64,
    /// The part of that which the overdamped motion did.
    pub damped: f64,
}

impl Energy {
    /// Of one step.
    pub fn of(summary: &StepSummary) -> Self {
        Self {
            work: summary.work,
            exchanged: summary.work.abs(),
            released: summary.released,
            damped: summary.damped,
        }
    }

    /// That of both.
    pub fn plus(self, other: Self) -> Self {
        Self {
            work: self.work + other.work,
            exchanged: self.exchanged + other.exchanged,
            released: self.released + other.released,
            damped: self.damped + other.damped,
        }
    }
}

/// A stage that ended before its last increment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageEnd {
    /// The load step that it ended with.
    pub step: u32,
    /// The stage.
    pub stage: String,
    /// Which of its conditions was met.
    pub ended: String,
}

impl StageEnd {
    /// That of a committed step, where there is one.
    pub fn of(step: u32, summary: &StepSummary) -> Option<Self> {
        (!summary.ended.is_empty()).then(|| Self {
            step,
            stage: summary.stage.clone(),
            ended: summary.ended.clone(),
        })
    }
}

impl fmt::Display for StageEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, stage, ended } = self;
        write!(f, "stage `{stage}` ended with step {step}: {ended}")
    }
}

/// What the REV solvers did, added up. Stored field by field in this order: new ones come last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RevFigures {
    /// Solves.
    pub solves: u64,
    /// Cycles of all of them.
    pub cycles: u64,
    /// Solves that re-based their friction history.
    pub rebased: u64,
    /// Solves that fell back to the path solver.
    pub path: u64,
    /// Solves whose tangent is the affine one, for want of a regular network.
    pub affine_tangents: u64,
    /// The largest residual that was accepted as equilibrium.
    pub worst_residual: f64,
    /// Solves that found no equilibrium, in iterations that went on from what they came to.
    #[serde(default)]
    pub unsettled: u64,
    /// Solves that ended without any contact.
    #[serde(default)]
    pub gave_way: u64,
}

impl RevFigures {
    /// Counts one solve.
    pub fn add(&mut self, report: &Report) {
        self.solves += 1;
        self.cycles += u64::from(report.cycles);
        match report.method {
            Method::ReturnMapping => {}
            Method::Rebased => self.rebased += 1,
            Method::Path => self.path += 1,
            Method::Unsettled => {}
        }
        self.affine_tangents += u64::from(report.affine_tangent);
        if report.method == Method::Unsettled {
            self.unsettled += 1;
        } else {
            self.worst_residual = self.worst_residual.max(report.residual);
        }
        self.gave_way += u64::from(report.contacts == 0);
    }

    /// Both together.
    pub fn plus(self, other: &Self) -> Self {
        Self {
            solves: self.solves + other.solves,
            cycles: self.cycles + other.cycles,
            rebased: self.rebased + other.rebased,
            path: self.path + other.path,
            unsettled: self.unsettled + other.unsettled,
            gave_way: self.gave_way + other.gave_way,
            affine_tangents: self.affine_tangents + other.affine_tangents,
            worst_residual: self.worst_residual.max(other.worst_residual),
        }
    }
}
