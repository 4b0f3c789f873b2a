//! Setting a run back: the way out where a pack is damaged beyond repair.

use crate::database::Change;
use crate::error::SetBackError;
use crate::files;
use crate::id::{RunName, StepAddress, StepIndex};
use crate::label;
use crate::layout;
use crate::open;
use crate::run::{self, RunState};
use crate::source::Source;
use crate::step::StepRecord;
use crate::store::{Store, locked};

impl Store {
    /// Sets a run back to before one of its own steps: that step and all later ones are set aside (renamed,
    /// not deleted), their journals removed. The way out where a pack is damaged. Returns how many went.
    pub fn set_back(&self, run: &RunName, step: StepIndex) -> Result<usize, SetBackError> {
        self.refuse_while_computed(run)?;
        let mut own = self.inner.own_steps(run)?;
        own.retain(|record| record.index >= step);
        if own.first().is_none_or(|record| record.index != step) {
            let run = run.clone();
            let wanted = StepAddress { run, step };
            let shown = label::shown(&self.inner.layout, &wanted);
            return Err(SetBackError::NotOwnStep(shown));
        }
        if let Some(branch) = self.taken_up(run, step)? {
            return Err(branch.into());
        }
        self.forget(run, step, &own)?;
        Ok(own.len())
    }

    fn forget(
        &self,
        run: &RunName,
        step: StepIndex,
        own: &[StepRecord],
    ) -> Result<(), SetBackError> {
        let layout = &self.inner.layout;
        // What would call the steps missing forgets them first; the packs go from the last to the first,
        // so that a crash leaves a shorter run, never one with a hole.
        let drops = own.iter().map(|r| Change::DropStep(run.clone(), r.index));
        self.inner.record(drops.collect());
        if locked(&self.inner.database).is_none() {
            // A database that still lists them must not be believed again.
            open::remove_database(layout)?;
        }
        let mut state = run::read_state(layout, run).unwrap_or_else(|_| run::lost_state(None));
        let remaining = step.0.checked_sub(1).map(StepIndex);
        state.last_own = remaining.filter(|last| {
            let steps = locked(&self.inner.steps);
            steps.get(run).is_some_and(|own| own.contains_key(last))
        });
        // It is no longer at the end that it once reached.
        state.state = RunState::Interrupted;
        state.note = match remaining {
            Some(last) => format!("set back to load step {}", last.0),
            None => "set back to its beginning".to_owned(),
        };
        run::write_state(layout, run, &state)?;
        for record in own.iter().rev() {
            let pack = layout.pack(run, record.index);
            if pack.exists() {
                files::rename_durably(&pack, &layout::aside(&pack))?;
            }
            if let Some(own) = locked(&self.inner.steps).get_mut(run) {
                own.remove(&record.index);
            }
        }
        open::remove_parts(layout, run, |_| true)?;
        Ok(())
    }
}
