//! A recorded drive to learn from: commands, odometry and the inertial measurement unit, run by run.

mod check;
mod file;

use bicycle::ImuSample;
use serde::{Deserialize, Serialize};

pub use check::{ImuCheckError, check_imu};
pub use file::RecordingFileError;

/// The vehicle of a recording or of a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleSummary {
    /// Name.
    pub name: String,
    /// Between the axles: what turns curvatures into steering angles [m].
    pub wheelbase_m: f64,
    /// Largest steering angle [rad].
    pub steering_max_rad: f64,
}

impl From<&bicycle::Vehicle> for VehicleSummary {
    fn from(vehicle: &bicycle::Vehicle) -> Self {
        Self {
            name: vehicle.name.clone(),
            wheelbase_m: vehicle.geometry.wheelbase_m,
            steering_max_rad: vehicle.limits.steering_max_rad,
        }
    }
}

/// A command as it was given, and what the vehicle measured then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// When the command was given, on the clock of the unit [ns].
    pub time_ns: u64,
    /// Commanded speed [m/s].
    pub speed_mps: f32,
    /// Commanded curvature, left positive [1/m].
    pub curvature_per_m: f32,
    /// Speed of the driven wheels [m/s].
    pub wheel_speed_mps: f32,
    /// Yaw rate by the localisation [rad/s].
    pub yaw_rate_radps: f32,
    /// Which ground the vehicle stood on, if somebody knows: an index of [`Recording::grounds`]. No model sees it.
    pub ground: Option<u32>,
}

/// One uninterrupted drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedRun {
    /// Commands at equal distances of time.
    pub ticks: Vec<Tick>,
    /// Samples in the order of time.
    pub imu: Vec<ImuSample>,
}

/// Drives of one vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Whose.
    pub vehicle: VehicleSummary,
    /// Time between commands [s].
    pub tick_s: f64,
    /// Names of the grounds that are known.
    pub grounds: Vec<String>,
    /// The drives.
    pub runs: Vec<RecordedRun>,
}

impl Recording {
    /// Number of commands.
    pub fn n_ticks(&self) -> usize {
        self.runs.iter().map(|run| run.ticks.len()).sum()
    }

    /// Grounds that at least one in a hundred commands was given on, by name; empty where nobody knows.
    pub fn grounds_driven(&self) -> Vec<&str> {
        let ticks = || self.runs.iter().flat_map(|run| &run.ticks);
        let share = |ground: usize| {
            let n = ticks().filter(|tick| tick.ground == Some(ground as u32)).count();
            n as f64 / self.n_ticks().max(1) as f64
        };
        let driven = (0..self.grounds.len()).filter(|ground| share(*ground) >= 0.01);
        driven.map(|ground| self.grounds[ground].as_str()).collect()
    }
}
