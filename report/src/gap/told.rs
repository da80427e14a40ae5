//! All that is told of one diagnosis: in words, as pictures, as a page, as a table of predictions.

use bicycle::DriveLog;
use sim_to_real::{Answer, Case, Diagnosis, Drives, Verification};

use super::{Page, Pictures, Reference, page, pictures, predictions, text};
use crate::Picture;
use crate::canvas::EncodeError;

/// A diagnosis with what it was made from.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a> {
    /// The drives.
    pub case: &'a Case,
    /// The held-out ones; none if there are none.
    pub heldout: &'a Drives,
    /// What they say; `None` without any.
    pub verification: Option<&'a Verification>,
    /// What the real drives have shown.
    pub diagnosis: &'a Diagnosis,
    /// The answer.
    pub answer: &'a Answer,
    /// What is doubtful about the drives.
    pub doubts: &'a [String],
}

impl Told<'_> {
    /// What the real drives were held against.
    pub fn reference(&self) -> Reference {
        if self.case.sim.logs.is_empty() { Reference::Bicycle } else { Reference::Simulator }
    }

    /// The answer in words.
    pub fn text(&self) -> String {
        text::text(self.answer, &self.drives())
    }

    /// Every picture that there is something to show on.
    ///
    /// # Errors
    /// The encoder refuses.
    pub fn pictures(&self) -> Result<Vec<Picture>, EncodeError> {
        let names = predictions::run_names(self.heldout);
        let strip = self
            .verification
            .and_then(|found| predictions::strip(&found.predictions, &self.heldout.logs, &names));
        pictures(&Pictures {
            reference: self.reference(),
            answer: self.answer,
            findings: &self.diagnosis.findings,
            heldout_residuals: self.verification.map_or(&[], |verification| &verification.residuals),
            ground: self.case.machine.ground.as_ref(),
            heldout: strip.as_ref(),
        })
    }

    /// The page with these pictures; `program` says who made it.
    pub fn page(&self, pictures: &[Picture], program: &str) -> String {
        page(&Page {
            answer: self.answer,
            drives: &self.drives(),
            doubts: self.doubts,
            pictures,
            reference: self.reference(),
            program,
        })
    }

    /// Every prediction of a held-out measurement as CSV; `None` without any.
    pub fn predictions_csv(&self) -> Option<String> {
        let names = predictions::run_names(self.heldout);
        self.verification.map(|found| predictions::csv(&found.predictions, &names))
    }

    /// `veh_b: 4 nominal drives, 2 real drives, 1 held-out drive`.
    fn drives(&self) -> String {
        let Case { machine, sim, real } = self.case;
        let kinds = [(&sim.logs, "nominal"), (&real.logs, "real"), (&self.heldout.logs, "held-out")];
        let counted = kinds.map(|(drives, what): (&Vec<DriveLog>, _)| match drives.len() {
            1 => format!("1 {what} drive"),
            n => format!("{n} {what} drives"),
        });
        format!("{}: {}", machine.name, counted.join(", "))
    }
}
