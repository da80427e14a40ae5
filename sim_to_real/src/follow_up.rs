//! What follows the naming: what the drives could not show, what to drive next, and what a learned model would close.

use bicycle::DriveLog;

use crate::answer::Answer;
use crate::baseline::{Baseline, GapError};
use crate::diagnosis::Diagnosis;
use crate::drives::Case;
use crate::learned_bound::{LearnedBoundError, learned_bound};
use crate::manoeuvre::{Manoeuvre, design_manoeuvre};
use crate::unseen::unseen_effects;

/// A diagnosis with all that it was made from.
#[derive(Clone, Copy, Debug)]
pub struct Diagnosed<'a> {
    /// The drives.
    pub case: &'a Case,
    /// What nominal drives look like.
    pub baseline: &'a Baseline,
    /// What the real ones have shown.
    pub diagnosis: &'a Diagnosis,
}

impl Diagnosed<'_> {
    /// Adds to the answer what the real drives could not show and what to drive next, which is returned; `place` is where
    /// its commands will stand. `None` where no drive would help.
    ///
    /// # Errors
    /// Drives that could not be diagnosed either.
    pub fn advise(&self, answer: &mut Answer, place: &str) -> Result<Option<Manoeuvre>, GapError> {
        let Self { case: Case { machine, sim, real }, baseline, diagnosis } = *self;
        answer.advice.extend(unseen_effects(baseline, machine, diagnosis, &real.logs)?);
        let designed = design_manoeuvre(baseline, machine, diagnosis, (&sim.logs, &real.logs))?;
        answer.advice.extend(designed.as_ref().map(|manoeuvre| manoeuvre.advice(place)));
        Ok(designed)
    }

    /// Adds to the answer what a flexible learned correction closes of the held-out drives, where there is a gap.
    ///
    /// # Errors
    /// The correction cannot be learned.
    pub fn bound(&self, answer: &mut Answer, heldout: &[DriveLog]) -> Result<(), LearnedBoundError> {
        if heldout.is_empty() || answer.shrink.closed.is_none() {
            return Ok(());
        }
        let drives = (&self.case.real.logs[..], heldout);
        let bound = learned_bound(self.baseline, &self.case.machine, self.diagnosis, drives)?;
        answer.shrink.learned_bound_closed = bound.closed;
        Ok(())
    }
}
