//! What a diagnosis has seen besides its answer: the numbers behind a report.

use serde::{Deserialize, Serialize};

use crate::Condition;

/// What the real drives alone have shown, before any held-out drive is opened.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    /// Every condition that could be judged.
    pub conditions: Vec<ConditionTable>,
    /// Residuals by state and horizon on the real drives.
    pub residuals: Vec<ResidualCell>,
    /// Residuals over the ground, one per rollout.
    pub map: Vec<GroundResidual>,
    /// In which a swing stands out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
}

/// What something repeats itself over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SwingOver {
    /// Per second.
    Time,
    /// Per metre of the path.
    Way,
}

/// A yaw rate that swings, in every drive of the robot's and not in the simulator's, whatever is commanded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swing {
    /// Over the time or the way.
    pub over: SwingOver,
    /// How often [1/s] or [1/m].
    pub frequency: f64,
    /// By how much either way [rad/s].
    pub amplitude_radps: f64,
}

/// Power of the yaw rate that the commands leave unexplained, over what it is at the frequencies about [-].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spectrum {
    /// Over the time or the way.
    pub over: SwingOver,
    /// Frequencies [1/s] or [1/m].
    pub frequencies: Vec<f64>,
    /// Least of the robot's drives.
    pub real: Vec<f64>,
    /// Largest of the simulator's.
    pub nominal: Vec<f64>,
}

/// How much further the robot's body leans than the simulator's on the same ground under the same accelerations, in every
/// drive, for no cause that is announced.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leaning {
    /// Nose down; 0 where the drives do not agree [rad].
    pub pitch_rad: f64,
    /// Left side up; 0 where the drives do not agree [rad].
    pub roll_rad: f64,
}

/// How the residual depends on one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionTable {
    /// Condition.
    pub condition: Condition,
    /// Share of the squared normalised residual's variance that its bins explain, less the null's [-].
    pub share: f64,
    /// The share that the same bins explain of nominal drives [-].
    pub null_share: f64,
    /// The share of the residual's square that bins of this condition explain through what is announced, where that is all
    /// of the gap [-].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub announced_share: Option<f64>,
    /// The condition from low to high; empty bins are left out.
    pub bins: Vec<ConditionBin>,
}

/// One bin of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionBin {
    /// Lower end, in the condition's unit.
    pub low: f64,
    /// Upper end, in the condition's unit.
    pub high: f64,
    /// Number of rollouts.
    pub n: usize,
    /// Mean squared normalised residual of the real drives [-].
    pub mean_square: f64,
    /// The same of the nominal drives, NaN where they never were [-].
    pub null_mean_square: f64,
}

/// What is left of one quantity once the announced effects act: over the condition that it follows most, or everywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOver {
    /// Quantity.
    pub quantity: ResidualState,
    /// Condition.
    pub condition: Condition,
    /// Time since the rollout's start [s].
    pub horizon_s: f64,
    /// Share of the square of all that is left then, in standard deviations, that the means of the bins make beyond the
    /// mean of all, less what those of nominal drives make of theirs [-].
    pub share: f64,
    /// The condition from low to high; empty bins are left out. One where it is the same everywhere, its ends 0.
    pub bins: Vec<LeftBin>,
}

/// One bin of what is left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftBin {
    /// Lower end, in the condition's unit.
    pub low: f64,
    /// Upper end, in the condition's unit.
    pub high: f64,
    /// Number of rollouts.
    pub n: usize,
    /// Mean of what was measured less what was foretold, in the quantity's unit.
    pub mean: f64,
    /// The same of the nominal drives; absent where they never were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub null_mean: Option<f64>,
}

/// A predicted quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResidualState {
    /// Displacement along the heading at the rollout's start [m].
    Along,
    /// Displacement across it [m].
    Across,
    /// Yaw [rad].
    Yaw,
    /// Forward velocity [m/s].
    ForwardSpeed,
    /// Yaw rate [rad/s].
    YawRate,
    /// Speed to the left [m/s].
    SideSpeed,
}

/// Size of the residual of one quantity at one horizon, each divided by its standard deviation on the nominal drives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualCell {
    /// Quantity.
    pub state: ResidualState,
    /// Time since the rollout's start [s].
    pub horizon_s: f64,
    /// Root mean square under the calibrated nominal model [-].
    pub before: f64,
    /// Root mean square with the announced effects [-].
    pub after: f64,
    /// Root mean square of nominal drives that the model was not calibrated on [-].
    pub floor: f64,
}

/// Error of one predicted quantity on held-out drives, in the quantity's own unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuantityError {
    /// Quantity.
    pub quantity: ResidualState,
    /// Its unit.
    pub unit: String,
    /// Time since the rollout's start [s].
    pub horizon_s: f64,
    /// Root mean square under the calibrated nominal model.
    pub before: f64,
    /// The same with the announced effects.
    pub after: f64,
    /// The same on nominal drives that the model was not calibrated on.
    pub floor: f64,
}

impl ResidualState {
    /// Unit of the quantity.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Along | Self::Across => "m",
            Self::Yaw => "rad",
            Self::ForwardSpeed | Self::SideSpeed => "m/s",
            Self::YawRate => "rad/s",
        }
    }
}

/// The residual of one rollout, where it began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroundResidual {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Root mean square over quantities and horizons under the calibrated nominal model [-].
    pub before: f64,
    /// The same with the announced effects [-].
    pub after: f64,
}

/// Which model made a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PredictionModel {
    /// Calibrated nominal model.
    Nominal,
    /// The same with the announced effects.
    Repaired,
}

/// Measurements that a model foretells on a held-out drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Index of the held-out drive.
    pub log: usize,
    /// When the rollout starts, on the drive's own time axis [s].
    pub start_s: f64,
    /// How much later the measurement is [s].
    pub horizon_s: f64,
    /// Model.
    pub model: PredictionModel,
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Yaw [rad].
    pub yaw_rad: f64,
    /// Forward velocity [m/s].
    pub speed_mps: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
}
