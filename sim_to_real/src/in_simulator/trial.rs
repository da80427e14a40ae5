//! Real drives in a simulator with something moved, and how well that foretells them.

use super::reference::Reference;
use super::replay::{Setting, replayed};
use super::types::{RunSimulator, SimulatorDescription};
use crate::drive::Drive;
use crate::least_squares::mean_loss;
use crate::rollout::PER_START;

/// Starts of a stretch: five seconds, after which residuals have little to do with one another.
const STRETCH: usize = 25;

/// Real drives and the simulator that is on trial.
pub(super) struct Trial<'a, E> {
    simulator: &'a SimulatorDescription,
    pub(super) reference: &'a Reference,
    drives: &'a [Drive],
    run: &'a RunSimulator<'a, E>,
}

impl<'a, E> Trial<'a, E> {
    pub(super) fn new(
        simulator: &'a SimulatorDescription,
        reference: &'a Reference,
        drives: &'a [Drive],
        run: &'a RunSimulator<'a, E>,
    ) -> Self {
        Self { simulator, reference, drives, run }
    }

    /// Residuals of all drives under every setting.
    pub(super) fn residuals(&self, settings: &[Setting]) -> Result<Vec<Vec<Vec<f32>>>, E> {
        replayed(self.simulator, self.drives, settings, &self.reference.yardstick, self.run)
    }

    /// Mean robust loss of every stretch of the drives under every setting; infinite where a run has left all numbers.
    pub(super) fn losses(&self, settings: &[Setting]) -> Result<Vec<Vec<f64>>, E> {
        let of_drive = |residuals: &Vec<f32>| {
            let white = self.reference.whitening.applied(residuals);
            let n_starts = white.len() / PER_START;
            let n = n_stretches(n_starts);
            let ends: Vec<usize> = (0..=n).map(|i| i * n_starts / n * PER_START).collect();
            let losses = ends.windows(2).map(|ends| mean_loss(&white[ends[0]..ends[1]]));
            losses.map(|loss| if loss.is_finite() { loss } else { f64::INFINITY }).collect::<Vec<_>>()
        };
        let residuals = self.residuals(settings)?;
        Ok(residuals.iter().map(|drives| drives.iter().flat_map(of_drive).collect()).collect())
    }

    /// For every stretch the part of the drives that is left out with it: its drive; of a single drive, its half.
    pub(super) fn parts(&self) -> Vec<usize> {
        let n_of = |drive: &Drive| n_stretches(drive.starts.len());
        if let [alone] = self.drives {
            let n = n_of(alone);
            return (0..n).map(|stretch| 2 * stretch / n).collect();
        }
        let parts = self.drives.iter().enumerate();
        parts.flat_map(|(part, drive)| vec![part; n_of(drive)]).collect()
    }
}

fn n_stretches(n_starts: usize) -> usize {
    (n_starts / STRETCH).max(1)
}
