//! The load steps that an export cannot show.

use store::{ReadError, StepHealth};

use super::ExportError;
use crate::{
    failure::{Failure, FailureKind},
    progress::Progress,
    report::Report,
    run::{error::RunError, text, view::StepView},
};

/// The load steps that an export leaves out, and why.
#[derive(Debug, Default)]
pub struct LeftOut {
    /// Given up on purpose.
    pruned: usize,
    /// Number, and what is wrong.
    damaged: Vec<(u32, String)>,
}

impl LeftOut {
    /// Whether nothing speaks against a step so far; it is noted where something does.
    pub fn admit(&mut self, step: &StepView) -> bool {
        let index = step.record.index.0;
        match &step.record.health {
            StepHealth::Sound => return true,
            StepHealth::Pruned => self.pruned += 1,
            StepHealth::Damaged(what) => self.damaged.push((index, what.clone())),
            StepHealth::Missing => self.damaged.push((index, "its pack is gone".to_owned())),
        }
        false
    }

    /// What was read of a step; `None`, and a note of it, where the step turns out to be damaged.
    ///
    /// # Errors
    /// Failures of another kind.
    pub fn unless_damaged<T>(
        &mut self,
        step: &StepView,
        read: Result<T, ExportError>,
    ) -> Result<Option<T>, ExportError> {
        match read {
            Ok(value) => Ok(Some(value)),
            Err(ExportError::Run(error)) if is_damage(&error) => {
                self.damaged.push((step.record.index.0, error.to_string()));
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// The damaged steps with what is wrong.
    pub fn damaged(&self) -> &[(u32, String)] {
        &self.damaged
    }

    /// Number of the steps that were given up.
    pub fn pruned(&self) -> usize {
        self.pruned
    }

    /// The end of an export: pruned steps are mentioned, damaged ones make it a failure, whose files are written all the
    /// same.
    ///
    /// # Errors
    /// A step is damaged.
    pub fn conclude(
        &self,
        run: &store::RunName,
        progress: &dyn Progress,
        report: Report,
    ) -> Result<Report, Failure> {
        if self.pruned > 0 {
            let steps = text::count(self.pruned, "pruned load step");
            progress.note(&format!("left out: {steps}"));
        }
        if self.damaged.is_empty() {
            return Ok(report);
        }
        for (step, what) in &self.damaged {
            progress.note(&format!("left out: load step {step}: failed to {what}"));
        }
        let steps = text::count(self.damaged.len(), "damaged load step");
        let what = format!("exported run `{run}` without {steps}");
        Err(Failure::new(FailureKind::Store, what)
            .hint("`femdem-flow store check --deep` says what is damaged and what to do")
            .with(report))
    }
}

fn is_damage(error: &RunError) -> bool {
    match error {
        RunError::Decode(_) => true,
        RunError::Read(read) => matches!(
            read,
            ReadError::Damaged(_) | ReadError::PackMissing { .. } | ReadError::NoSuchFrame { .. }
        ),
        _ => false,
    }
}
