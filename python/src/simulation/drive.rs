//! One vehicle under way, and what it knows of the ground.

use std::path::Path;

use bench::closed_loop::true_surface;
use bicycle::{Command, Decision, Odometry, Vehicle};
use navigator::{Config, NavigatorError, Surface, Surveyor};
use pyo3::prelude::*;
use scenarios::{
    Episode, EpisodeConfig, EpisodeError, ImuConfig, OdometryConfig, RangeSensorConfig, Rules, Task,
};
use serde::{Deserialize, Serialize};
use terrain::{PatchSample, PatchShape, TerrainClass, WheelLayout};

use super::recording::Recording;
use crate::failure::{refused, refused_value};

/// Layers of the patch of ground.
pub const N_CHANNELS: usize = 4;
/// Numbers of the measured motion.
pub const N_MEASURED: usize = 7;
/// Numbers that say where the goal is.
pub const N_GOAL: usize = 2;
/// Samples of a patch, along and across.
const PATCH_MAX: usize = 512;

/// What can be set of a simulation.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    control_hz: f64,
    cycles_per_scan: u64,
    rules: Rules,
    odometry: OdometryConfig,
    imu: ImuConfig,
    range_sensor: RangeSensorConfig,
    pub patch: PatchShape,
}

impl Settings {
    /// Those of `surefoot drive`, and a patch from a length behind the vehicle to six ahead, two to either side.
    pub fn for_vehicle(vehicle: &Vehicle) -> Self {
        let length_m = vehicle.geometry.length_m;
        let usual = EpisodeConfig::for_vehicle(vehicle);
        Self {
            control_hz: usual.control_hz,
            cycles_per_scan: usual.cycles_per_scan,
            rules: usual.rules,
            odometry: usual.odometry,
            imu: usual.imu,
            range_sensor: RangeSensorConfig::for_vehicle(vehicle),
            patch: PatchShape { n_rows: 48, n_cols: 32, spacing_m: 0.15 * length_m, rear_m: length_m },
        }
    }

    /// Refuses a patch of no samples, and one that nobody has room for.
    pub fn check_patch(&self) -> PyResult<()> {
        let PatchShape { n_rows, n_cols, spacing_m, rear_m } = self.patch;
        for (name, n) in [("n_rows", n_rows), ("n_cols", n_cols)] {
            if !(1..=PATCH_MAX).contains(&n) {
                return Err(refused(&format!("settings: patch.{name}"), format!("1 to {PATCH_MAX}"), n));
            }
        }
        if !(1e-3..=10.0).contains(&spacing_m) {
            return Err(refused("settings: patch.spacing_m", "a length from 0.001 to 10 m", spacing_m));
        }
        match (-1e3..=1e3).contains(&rear_m) {
            true => Ok(()),
            false => Err(refused("settings: patch.rear_m", "a length from -1000 to 1000 m", rear_m)),
        }
    }

    fn episode(&self, sight: Sight, vehicle: &Vehicle) -> EpisodeConfig {
        EpisodeConfig {
            control_hz: self.control_hz,
            cycles_per_scan: self.cycles_per_scan,
            rules: self.rules,
            odometry: self.odometry,
            imu: self.imu,
            range_sensor: match sight {
                Sight::Sensed => Some(self.range_sensor),
                Sight::True => None,
            },
            ..EpisodeConfig::for_vehicle(vehicle)
        }
    }
}

/// What the vehicle knows of the ground.
#[derive(Clone, Copy)]
pub enum Sight {
    /// What its scans showed.
    Sensed,
    /// All of it.
    True,
}

/// Why a drive cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum DriveFault {
    /// The plant left the numbers.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The mapping refused what was measured.
    #[error(transparent)]
    Navigator(#[from] NavigatorError),
    /// The recording could not be written.
    #[error(transparent)]
    Record(#[from] formats::RecordError),
}

/// What one vehicle measures.
pub struct Measured {
    pub ground: Vec<f32>,
    pub state: [f32; N_MEASURED],
    pub goal_m: [f32; N_GOAL],
    pub distance_m: f64,
    pub outcome: Option<String>,
}

/// A vehicle under way.
pub struct Drive {
    pub episode: Episode,
    pub surveyor: Surveyor,
    pub vehicle: Vehicle,
    patch: PatchShape,
    recording: Option<Recording>,
}

impl Drive {
    pub fn new(vehicle: Vehicle, task: Task, settings: &Settings, sight: Sight, seed: u64) -> PyResult<Self> {
        settings.check_patch()?;
        let config = Config::for_vehicle(&vehicle);
        let surface = match sight {
            Sight::Sensed => Surface::Sensed,
            Sight::True => Surface::Given(true_surface(&task.world, config.elevation.resolution_m)),
        };
        let surveyor = Surveyor::new(&vehicle.geometry, config.elevation, config.guard, surface);
        let episode = Episode::new(task, &vehicle, settings.episode(sight, &vehicle), seed);
        let mut drive = Self {
            episode: episode.map_err(refused_value)?,
            surveyor: surveyor.map_err(refused_value)?,
            vehicle,
            patch: settings.patch,
            recording: None,
        };
        drive.look().map_err(refused_value)?;
        Ok(drive)
    }

    /// Drives for a control cycle, if there is a command, and measures.
    pub fn step(&mut self, command: Option<[f32; 2]>) -> Result<Measured, DriveFault> {
        if let Some([speed_mps, steering_rad]) = command
            && self.episode.outcome().is_none()
        {
            self.advance(&Decision::Drive(Command { speed_mps, steering_rad }))?;
        }
        Ok(self.measured())
    }

    fn advance(&mut self, decision: &Decision) -> Result<(), DriveFault> {
        let before = self.recording.as_ref().map(|_| self.episode.observe().clone());
        self.episode.apply(decision)?;
        if let (Some(recording), Some(before)) = (&mut self.recording, before) {
            recording.cycle(&self.episode, self.surveyor.surface(), &before)?;
        }
        self.look()
    }

    /// Maps what the last cycle measured.
    fn look(&mut self) -> Result<(), DriveFault> {
        let observation = self.episode.observe();
        if let Ok(Some(jump)) = self.surveyor.admit(&observation.odometry) {
            self.surveyor.follow_jump(&observation.odometry, &jump)?;
        }
        if let Some(scan) = &observation.scan {
            self.surveyor.fuse(&observation.odometry, scan)?;
        }
        Ok(())
    }

    fn measured(&self) -> Measured {
        let odometry = &self.episode.observe().odometry;
        let pose = self.episode.motion().pose;
        Measured {
            ground: self.ground_around(odometry),
            state: measured_motion(odometry),
            goal_m: self.goal_from(odometry),
            distance_m: self.episode.task().distance_to_goal_m(pose.x_m, pose.y_m),
            outcome: self.outcome(),
        }
    }

    /// The patch of ground, layer by layer.
    fn ground_around(&self, odometry: &Odometry) -> Vec<f32> {
        let geometry = &self.vehicle.geometry;
        let layout = WheelLayout { wheelbase_m: geometry.wheelbase_m, track_m: geometry.track_m };
        let [x_m, y_m, _] = odometry.position_m;
        let pose = [x_m, y_m, odometry.attitude_rad[2]];
        let mut samples = vec![PatchSample::UNKNOWN; self.patch.n_samples()];
        self.patch.sample(self.surveyor.surface(), &layout, pose, &mut samples);
        let is_known = |sample: &PatchSample| !sample.relative_height_m.is_nan();
        let height =
            samples.iter().map(|sample| if is_known(sample) { sample.relative_height_m } else { 0.0 });
        let known = samples.iter().map(|sample| if is_known(sample) { 1.0 } else { 0.0 });
        let plants = samples.iter().map(|sample| sample.vegetation_height_m);
        let obstacle = samples.iter().map(|sample| sample.class_probability[TerrainClass::Obstacle as usize]);
        height.chain(known).chain(plants).chain(obstacle).collect()
    }

    /// The goal in the body frame [m].
    fn goal_from(&self, odometry: &Odometry) -> [f32; N_GOAL] {
        let [x_m, y_m, _] = odometry.position_m;
        let [goal_x_m, goal_y_m] = self.episode.task().goal_m;
        let (east_m, north_m) = (goal_x_m - x_m, goal_y_m - y_m);
        let (sine, cosine) = odometry.attitude_rad[2].sin_cos();
        [(cosine * east_m + sine * north_m) as f32, (cosine * north_m - sine * east_m) as f32]
    }

    /// How it ended, by the name that files have for it.
    pub fn outcome(&self) -> Option<String> {
        let outcome = toml::Value::try_from(self.episode.outcome()?).ok()?;
        outcome.as_str().map(str::to_owned)
    }

    /// True poses so far.
    pub fn poses(&self) -> Vec<[f64; 6]> {
        let driven = self.episode.trace().iter().map(|row| row.motion.pose);
        let poses = driven.chain([self.episode.motion().pose]);
        poses
            .map(|pose| [pose.x_m, pose.y_m, pose.z_m, pose.roll_rad, pose.pitch_rad, pose.yaw_rad])
            .collect()
    }

    /// Records from now on.
    pub fn record(&mut self, path: &Path) -> PyResult<()> {
        self.finish_recording()?;
        self.recording = Some(Recording::create(path, self)?);
        Ok(())
    }

    /// Completes the recording, if there is one.
    pub fn finish_recording(&mut self) -> PyResult<()> {
        self.recording.take().map_or(Ok(()), Recording::finish)
    }
}

fn measured_motion(odometry: &Odometry) -> [f32; N_MEASURED] {
    let [speed_mps, leftward_mps] = odometry.velocity_mps;
    let [roll_rad, pitch_rad, _] = odometry.attitude_rad;
    let (yaw_rate, steering, wheels) =
        (odometry.yaw_rate_radps, odometry.steering_rad, odometry.wheel_speed_mps);
    [speed_mps, leftward_mps, yaw_rate, roll_rad, pitch_rad, steering, wheels].map(|value| value as f32)
}
