//! The car: its description, and how it departs from it.

use std::sync::Arc;

use bicycle::{Command, ImuSample, Odometry, Vehicle};
use scenarios::{
    CommandError, Deviation, IMU_PERIOD_NS, Imu, ImuConfig, OdometryConfig, OdometrySensor, Plant,
    PlantError, World, seed_of,
};

/// Name of the vehicle.
pub const VEHICLE: &str = "ut_automata";
/// Time between commands [s].
pub const TICK_S: f64 = 0.05;
/// Samples of the unit between commands.
const SAMPLES_PER_TICK: usize = 10;

/// How the car departs from its description: an axle that gives way under lateral force, as the servo saver of such cars
/// does. From 1 to 2.5 m/s it loses as large a part of its curvature as the real car of the drifting data on its floor, to
/// 0.76 (docs/kinodynamics.md). The linkage is set so that it drives the commanded curvature at a walking pace, where people
/// set it. Frozen before the first model was trained.
pub const DEVIATIONS: [Deviation; 2] = [
    Deviation::SteeringCompliance { rad_per_n: 0.008 },
    Deviation::SteeringRatio { left: 1.10, right: 1.10 },
];

/// The car on its ground, with its sensors.
pub(super) struct Machine {
    plant: Plant,
    world: Arc<World>,
    imu: Imu,
    odometry: OdometrySensor,
    wheelbase_m: f64,
    n_samples: u64,
    /// Newest samples, oldest first.
    samples: Vec<ImuSample>,
}

impl Machine {
    pub(super) fn new(
        vehicle: &Vehicle,
        world: Arc<World>,
        start: [f64; 3],
        seed: u64,
    ) -> Result<Self, PlantError> {
        let length_m = vehicle.geometry.length_m;
        Ok(Self {
            plant: Plant::deviating(vehicle, &DEVIATIONS, Arc::clone(&world), start)?,
            world,
            imu: Imu::new(ImuConfig::for_length(length_m), seed_of(seed, &[1])),
            odometry: OdometrySensor::new(OdometryConfig::for_length(length_m), seed_of(seed, &[2])),
            wheelbase_m: vehicle.geometry.wheelbase_m,
            n_samples: 0,
            samples: Vec::new(),
        })
    }

    /// Time since the start [ns].
    pub(super) fn now_ns(&self) -> u64 {
        self.n_samples * IMU_PERIOD_NS
    }

    pub(super) fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Where it thinks it is.
    pub(super) fn measure(&mut self) -> Odometry {
        let now_ns = self.now_ns();
        self.odometry.measure(&self.plant.motion(), now_ns)
    }

    /// Commands and drives on until the next command; `watch` sees the plant at every sample. The samples since the last
    /// command are kept for [`Machine::samples`].
    pub(super) fn drive(
        &mut self,
        [speed_mps, curvature_per_m]: [f32; 2],
        mut watch: impl FnMut(&Plant),
    ) -> Result<(), CommandError> {
        let steering_rad = (f64::from(curvature_per_m) * self.wheelbase_m).atan() as f32;
        self.plant.set_command(Command { speed_mps, steering_rad })?;
        self.samples.clear();
        for _ in 0..SAMPLES_PER_TICK {
            self.plant.advance(IMU_PERIOD_NS as f64 * 1e-9);
            self.n_samples += 1;
            let now_ns = self.now_ns();
            self.samples.push(self.imu.sample(&self.plant.motion(), &self.world, now_ns));
            watch(&self.plant);
        }
        Ok(())
    }

    /// What the unit measured since the last command.
    pub(super) fn samples(&self) -> &[ImuSample] {
        &self.samples
    }
}
