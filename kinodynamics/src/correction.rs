//! A model between planner and vehicle: bounded, faded, counted.

use bicycle::lanes::Instructions;
use bicycle::{Command, ImuSample, Odometry};
use serde::{Deserialize, Serialize};

use evidential::SettingError;

use crate::CheckpointError;
use crate::agreement::{Agreement, Moment};
use crate::architecture::{CURVATURE_MAX_PER_M, SPEED_MAX_MPS};
use crate::checkpoint::{Checkpoint, Sidecar};
use crate::history::{ImuCounts, ImuFault, ImuHistory, ImuRange};
use crate::model::{Desired, InverseModel};

/// Newest samples whose mean is held against the odometry: 40 ms.
const SAMPLES_OF_A_MOMENT: usize = 8;
/// What is left of a moment's weight at the next command: half of it after 7 s at 10 Hz [-].
const MOMENT_KEPT: f64 = 0.99;

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

impl CorrectionConfig {
    /// Refuses what bounds nothing.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        let settings = [
            ("curvature_change_max_per_m", self.curvature_change_max_per_m, 0.0..=2.0, "from 0 to 2 1/m"),
            ("speed_min_mps", self.speed_min_mps, 0.0..=SPEED_MAX_MPS, "from 0 to 3 m/s"),
            ("share_step_max", self.share_step_max, 1e-3..=1.0, "from 0.001 to 1"),
        ];
        match settings.into_iter().find(|(_, found, allowed, _)| !allowed.contains(found)) {
            Some((field, found, _, expected)) => {
                Err(SettingError { field, expected, found: f64::from(found) })
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

impl Uncorrected {
    /// Its kind, to be counted and recorded by.
    pub fn reason(&self) -> Reason {
        match self {
            Self::Slow => Reason::Slow,
            Self::Unfamiliar => Reason::Unfamiliar,
            Self::NonFinite => Reason::NonFinite,
            Self::Imu(fault) => match fault {
                ImuFault::Short { .. } => Reason::ImuShort,
                ImuFault::Late { .. } => Reason::ImuLate,
                ImuFault::FromFuture { .. } => Reason::ImuFromFuture,
                ImuFault::Rate { .. } => Reason::ImuRate,
                ImuFault::Saturated { .. } => Reason::ImuSaturated,
                ImuFault::Gravity { .. } => Reason::ImuGravity,
                ImuFault::Frozen => Reason::ImuFrozen,
                ImuFault::YawRate { .. } => Reason::ImuYawRate,
                ImuFault::Force { .. } => Reason::ImuForce,
            },
        }
    }
}

/// Kinds of [`Uncorrected`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Too slow, or backwards.
    Slow,
    /// Unlike anything that was learned from.
    Unfamiliar,
    /// Not finite.
    NonFinite,
    /// Not half a second of samples.
    ImuShort,
    /// The newest sample is old.
    ImuLate,
    /// The newest sample is of a time to come.
    ImuFromFuture,
    /// Another rate than 200 Hz.
    ImuRate,
    /// At the end of the unit's range.
    ImuSaturated,
    /// Gravity elsewhere.
    ImuGravity,
    /// Always the same.
    ImuFrozen,
    /// The upward rate is not the yaw rate.
    ImuYawRate,
    /// The force to the left is not what it takes to turn.
    ImuForce,
}

impl Reason {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 12] = [
        Self::Slow,
        Self::Unfamiliar,
        Self::NonFinite,
        Self::ImuShort,
        Self::ImuLate,
        Self::ImuFromFuture,
        Self::ImuRate,
        Self::ImuSaturated,
        Self::ImuGravity,
        Self::ImuFrozen,
        Self::ImuYawRate,
        Self::ImuForce,
    ];

    /// For a person.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slow => "too slow",
            Self::Unfamiliar => "unlike the training",
            Self::NonFinite => "not finite",
            Self::ImuShort => "IMU without half a second",
            Self::ImuLate => "IMU late",
            Self::ImuFromFuture => "IMU from the future",
            Self::ImuRate => "IMU of another rate",
            Self::ImuSaturated => "IMU saturated",
            Self::ImuGravity => "IMU with gravity elsewhere",
            Self::ImuFrozen => "IMU frozen",
            Self::ImuYawRate => "IMU not turning as the odometry",
            Self::ImuForce => "IMU with other sideways forces than the odometry's",
        }
    }
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Changed as the model says, or left because it says so.
    Corrected,
    /// Changed by as much as is allowed.
    Bounded,
    /// Of no new change; what is left of the last one may still fade.
    AsPlanned(Reason),
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
    /// Whether the model would have added more than is allowed.
    pub is_bounded: bool,
    /// Why it had none of its own, if so; what is left of the last one may still fade.
    pub uncorrected: Option<Uncorrected>,
}

impl Corrected {
    /// What became of the command.
    pub fn effect(&self) -> Effect {
        match self.uncorrected {
            Some(uncorrected) => Effect::AsPlanned(uncorrected.reason()),
            None if self.is_bounded => Effect::Bounded,
            None => Effect::Corrected,
        }
    }
}

/// Commands by what became of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CorrectionCounts {
    /// Commands in all.
    pub commands: u64,
    /// As the model says.
    pub corrected: u64,
    /// By as much as is allowed, which is less than the model says.
    pub bounded: u64,
    /// As planned, by reason, in the order of [`Reason::ALL`].
    as_planned: [u64; Reason::ALL.len()],
}

impl CorrectionCounts {
    /// Counts a command.
    pub fn count(&mut self, effect: Effect) {
        self.commands += 1;
        *match effect {
            Effect::Corrected => &mut self.corrected,
            Effect::Bounded => &mut self.bounded,
            Effect::AsPlanned(reason) => &mut self.as_planned[reason as usize],
        } += 1;
    }

    /// Reasons for which commands went as planned, with how many did; none that never came.
    pub fn reasons(&self) -> impl Iterator<Item = (Reason, u64)> {
        Reason::ALL.into_iter().zip(self.as_planned).filter(|(_, n)| *n > 0)
    }

    /// Commands that went as planned for a reason.
    pub fn as_planned(&self, reason: Reason) -> u64 {
        self.as_planned[reason as usize]
    }
}

impl std::fmt::Display for CorrectionCounts {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { commands, corrected, bounded, .. } = self;
        write!(formatter, "{} of {commands} commands, {bounded} at the bound", corrected + bounded)?;
        let mut before = "; as planned: ";
        for (reason, n) in self.reasons() {
            write!(formatter, "{before}{} {n}x", reason.name())?;
            before = ", ";
        }
        Ok(())
    }
}

/// A model with the history of the unit that it listens to.
#[derive(Clone, Debug)]
pub struct Corrector {
    model: InverseModel,
    config: CorrectionConfig,
    history: ImuHistory,
    agreement: Agreement,
    odometry_at_ns: u64,
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
            agreement: Agreement::new(MOMENT_KEPT),
            odometry_at_ns: 0,
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

    /// Forgets what the unit has measured: messages of it were lost, or clocks were set back.
    pub fn forget(&mut self) {
        self.history.forget();
        self.agreement = Agreement::new(MOMENT_KEPT);
        self.odometry_at_ns = 0;
    }

    /// The vehicle is told to stand: the next correction comes in anew.
    pub fn rest(&mut self) {
        self.share = 0.0;
    }

    /// What became of the commands so far.
    pub fn counts(&self) -> &CorrectionCounts {
        &self.counts
    }

    /// What came of the unit so far.
    pub fn imu_counts(&self) -> ImuCounts {
        self.history.counts()
    }

    /// The command for the vehicle in place of a planned one. The odometry is what the unit's axes are held against. Does
    /// not allocate.
    pub fn correct(&mut self, planned: Command, odometry: &Odometry, now_ns: u64) -> Corrected {
        self.compare(odometry);
        let wish = self.wish(planned, now_ns);
        let (target, change_per_m, uncorrected) = match wish {
            Ok((share, change_per_m)) if share > 0.0 => (share, change_per_m, None),
            Ok((_, change_per_m)) => (0.0, change_per_m, Some(Uncorrected::Unfamiliar)),
            Err(reason) => (0.0, 0.0, Some(reason)),
        };
        let step = self.config.share_step_max;
        self.share = target.clamp(self.share - step, self.share + step);
        let most = self.config.curvature_change_max_per_m;
        // Where there is no answer there is nothing to fade.
        let share = if wish.is_ok() { self.share } else { 0.0 };
        let curvature_change_per_m = share * change_per_m.clamp(-most, most);
        let corrected = Corrected {
            command: self.steered(planned, curvature_change_per_m),
            share,
            curvature_change_per_m,
            is_bounded: change_per_m.abs() > most,
            uncorrected,
        };
        self.counts.count(corrected.effect());
        corrected
    }

    /// Holds the unit's newest samples against odometry that is new and of a vehicle that moves.
    fn compare(&mut self, odometry: &Odometry) {
        let [speed_mps, _] = odometry.velocity_mps;
        let is_new = odometry.valid_at_ns > self.odometry_at_ns;
        let is_moving = speed_mps.abs() >= f64::from(self.config.speed_min_mps);
        let newest = self.history.newest(SAMPLES_OF_A_MOMENT).filter(|_| is_new && is_moving);
        if let Some((rate_radps, force_mps2)) = newest {
            let yaw_rate_radps = odometry.yaw_rate_radps;
            self.odometry_at_ns = odometry.valid_at_ns;
            self.agreement.note(&Moment { rate_radps, force_mps2, yaw_rate_radps, speed_mps });
        }
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
        // The networks see such wishes as those at the end of their range, which were never wanted here.
        if speed_mps > SPEED_MAX_MPS || desired.curvature_per_m.abs() > CURVATURE_MAX_PER_M {
            return Err(Uncorrected::Unfamiliar);
        }
        if self.model.senses() {
            let samples = self.history.window(now_ns, self.config.age_max_ns).map_err(Uncorrected::Imu)?;
            self.agreement.check().map_err(|disagreement| Uncorrected::Imu(disagreement.into()))?;
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
}

#[cfg(test)]
mod tests;
