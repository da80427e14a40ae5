//! A model between planner and vehicle: bounded, faded, counted.

use bicycle::lanes::Instructions;
use bicycle::{Command, ImuSample};
use serde::{Deserialize, Serialize};

use crate::architecture::SPEED_MAX_MPS;
use crate::checkpoint::{Checkpoint, CheckpointError, Sidecar};
use crate::history::{ImuCounts, ImuFault, ImuHistory, ImuRange};
use crate::model::{Desired, InverseModel};

/// How far a correction may go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CorrectionConfig {
    /// Largest change of the curvature [1/m].
    pub curvature_change_max_per_m: f32,
    /// Age of the unit's newest sample from which on nothing is corrected [ns].
    pub age_max_ns: u64,
    /// Speeds below this are commanded as planned [m/s].
    pub speed_min_mps: f32,
    /// Largest change of the share that the correction has, between two commands: it comes and goes without a jump.
    pub share_step_max: f32,
    /// Range of the unit.
    pub imu_range: ImuRange,
}

impl Default for CorrectionConfig {
    /// The paper's filters keep differences up to 0.2 1/m: a model has never been taught more. The rest fits 10 to 20 Hz.
    fn default() -> Self {
        Self {
            curvature_change_max_per_m: 0.25,
            age_max_ns: 50_000_000,
            speed_min_mps: 0.2,
            share_step_max: 0.25,
            imu_range: ImuRange::default(),
        }
    }
}

/// A setting out of range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("correction, {field}: expected {expected}, found {found}")]
pub struct CorrectionConfigError {
    /// Which.
    pub field: &'static str,
    /// What would do.
    pub expected: &'static str,
    /// What is there.
    pub found: f64,
}

impl CorrectionConfig {
    /// Refuses what bounds nothing.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn validate(&self) -> Result<(), CorrectionConfigError> {
        let settings = [
            ("curvature_change_max_per_m", self.curvature_change_max_per_m, 0.0..=2.0, "from 0 to 2 1/m"),
            ("speed_min_mps", self.speed_min_mps, 0.0..=SPEED_MAX_MPS, "from 0 to 3 m/s"),
            ("share_step_max", self.share_step_max, 1e-3..=1.0, "from 0.001 to 1"),
        ];
        match settings.into_iter().find(|(_, found, allowed, _)| !allowed.contains(found)) {
            Some((field, found, _, expected)) => {
                Err(CorrectionConfigError { field, expected, found: f64::from(found) })
            }
            None => Ok(()),
        }
    }
}

/// Why a command went to the vehicle as planned, or nearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uncorrected {
    /// Too slow, or backwards: nothing of that was learned.
    Slow,
    /// The unit says nothing.
    Imu(ImuFault),
    /// Unlike anything that was learned from.
    Unfamiliar,
    /// The command or the model's answer is not finite.
    NonFinite,
}

/// A command on its way to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// What goes to the vehicle.
    pub command: Command,
    /// Share that the correction had, 0 to 1.
    pub share: f32,
    /// Curvature that it added [1/m].
    pub curvature_change_per_m: f32,
    /// Why it had none of its own, if so; what is left of the last one may still fade.
    pub uncorrected: Option<Uncorrected>,
}

/// Commands by what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CorrectionCounts {
    /// Commands in all.
    pub commands: u64,
    /// Changed.
    pub corrected: u64,
    /// Changed by as much as is allowed.
    pub bounded: u64,
    /// As planned: too slow.
    pub slow: u64,
    /// As planned: the unit said nothing.
    pub imu: u64,
    /// As planned: unlike the training.
    pub unfamiliar: u64,
    /// As planned: not finite.
    pub non_finite: u64,
}

/// A model with the history of the unit that it listens to.
#[derive(Clone, Debug)]
pub struct Corrector {
    model: InverseModel,
    config: CorrectionConfig,
    history: ImuHistory,
    wheelbase_m: f32,
    steering_max_rad: f32,
    share: f32,
    counts: CorrectionCounts,
}

impl Corrector {
    /// A corrector of this checkpoint.
    ///
    /// # Errors
    /// Settings or weights that make none; see [`Checkpoint::require_vehicle`] for another vehicle's.
    pub fn new(
        checkpoint: &Checkpoint,
        config: CorrectionConfig,
        instructions: Instructions,
    ) -> Result<Self, CheckpointError> {
        config.validate().map_err(|error| CheckpointError::Mismatch {
            what: format!("correction, {}", error.field),
            expected: error.expected.to_owned(),
            found: error.found.to_string(),
        })?;
        let Sidecar { vehicle, .. } = checkpoint.sidecar();
        Ok(Self {
            model: InverseModel::new(checkpoint, instructions)?,
            config,
            history: ImuHistory::new(config.imu_range),
            wheelbase_m: vehicle.wheelbase_m as f32,
            steering_max_rad: vehicle.steering_max_rad as f32,
            share: 0.0,
            counts: CorrectionCounts::default(),
        })
    }

    /// Takes in what the unit measured, in the order of time.
    pub fn sense(&mut self, samples: &[ImuSample]) {
        for sample in samples {
            self.history.push(sample);
        }
    }

    /// What became of the commands so far.
    pub fn counts(&self) -> CorrectionCounts {
        self.counts
    }

    /// What came of the unit so far.
    pub fn imu_counts(&self) -> ImuCounts {
        self.history.counts()
    }

    /// The command for the vehicle in place of a planned one. Does not allocate.
    pub fn correct(&mut self, planned: Command, now_ns: u64) -> Corrected {
        self.counts.commands += 1;
        let wish = self.wish(planned, now_ns);
        let (target, change_per_m, uncorrected) = match wish {
            Ok((share, change_per_m)) if share > 0.0 => (share, change_per_m, None),
            Ok((_, change_per_m)) => (0.0, change_per_m, Some(Uncorrected::Unfamiliar)),
            Err(reason) => (0.0, 0.0, Some(reason)),
        };
        self.count(uncorrected);
        let step = self.config.share_step_max;
        self.share = target.clamp(self.share - step, self.share + step);
        // Where there is no answer there is nothing to fade.
        if wish.is_err() {
            return Corrected { command: planned, share: 0.0, curvature_change_per_m: 0.0, uncorrected };
        }
        let most = self.config.curvature_change_max_per_m;
        let bounded = change_per_m.clamp(-most, most);
        self.counts.bounded += u64::from(bounded != change_per_m && self.share > 0.0);
        let added = self.share * bounded;
        let command = self.steered(planned, added);
        self.counts.corrected += u64::from(added != 0.0);
        Corrected { command, share: self.share, curvature_change_per_m: added, uncorrected }
    }

    /// How far the model is trusted, and by how much it would change the curvature.
    fn wish(&mut self, planned: Command, now_ns: u64) -> Result<(f32, f32), Uncorrected> {
        let Command { speed_mps, steering_rad } = planned;
        if !(speed_mps.is_finite() && steering_rad.is_finite()) {
            return Err(Uncorrected::NonFinite);
        }
        if speed_mps < self.config.speed_min_mps {
            return Err(Uncorrected::Slow);
        }
        let desired = Desired { speed_mps, curvature_per_m: libm::tanf(steering_rad) / self.wheelbase_m };
        if self.model.senses() {
            let samples = self.history.window(now_ns, self.config.age_max_ns).map_err(Uncorrected::Imu)?;
            self.model.sense(samples);
        }
        let share = self.model.familiarity(desired);
        let change_per_m = self.model.command(desired).curvature_per_m - desired.curvature_per_m;
        if change_per_m.is_finite() { Ok((share, change_per_m)) } else { Err(Uncorrected::NonFinite) }
    }

    fn steered(&self, planned: Command, added_per_m: f32) -> Command {
        if added_per_m == 0.0 {
            return planned;
        }
        let curvature = libm::tanf(planned.steering_rad) / self.wheelbase_m + added_per_m;
        let most = self.steering_max_rad.max(planned.steering_rad.abs());
        let steering_rad = libm::atanf(curvature * self.wheelbase_m).clamp(-most, most);
        Command { steering_rad, ..planned }
    }

    fn count(&mut self, uncorrected: Option<Uncorrected>) {
        let count = match uncorrected {
            None => return,
            Some(Uncorrected::Slow) => &mut self.counts.slow,
            Some(Uncorrected::Imu(_)) => &mut self.counts.imu,
            Some(Uncorrected::Unfamiliar) => &mut self.counts.unfamiliar,
            Some(Uncorrected::NonFinite) => &mut self.counts.non_finite,
        };
        *count += 1;
    }
}

#[cfg(test)]
mod tests;
