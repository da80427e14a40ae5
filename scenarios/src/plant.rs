//! The plant: the machine as it is, in rigid-body and tyre physics.
//!
//! Two engines simulate the same vehicle on the same ground. In the built-in one rapier carries the body and its contact
//! with the ground, on four wheels of our own. In the other, behind the feature `mujoco`, body, struts, wheels and
//! contacts are MuJoCo's. They share the vehicle's own controllers (speed servo, steering servo, transport delay) and
//! the laws of the ground (friction by class, resistance of plants), and no mechanics.
//!
//! Deterministic: the same engine, vehicle, world, start and commands give the same bits.

mod chassis;
mod collision;
mod drivetrain;
mod envelope;
mod error;
mod ground;
mod linkage;
mod load;
mod machine;
#[cfg(feature = "mujoco")]
mod mujoco;
mod rapier;
mod receiver;
mod rest;
mod ruts;
mod servo;
mod start;
mod strut;
mod trailer;
mod tyre;
mod vegetation;
mod wheel;

use std::sync::Arc;

use bicycle::{Command, Limits, Vehicle};
use terrain::Pose;

use crate::{Deviation, Motion, World};
pub use collision::Collision;
pub(crate) use drivetrain::LIMITED_SLIP_S_PER_M;
pub use error::{CommandError, PlantError};
pub(crate) use load::AIR_KGPM3;
use rapier::RapierPlant;
pub use tyre::steady_friction;
pub(crate) use vegetation::vegetation_resistance;

/// Acceleration of gravity [m/s2].
pub(crate) const GRAVITY_MPS2: f64 = 9.81;

/// Time the vehicle is given to sink into its springs before the first command [s].
const SETTLING_S: f64 = 1.5;
/// Below this cosine of the body's tilt (70 degrees) it has rolled over.
const ROLLED_OVER_COSINE: f64 = 0.342;

/// Which physics engine simulates the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// rapier's rigid body on wheels and tyres of our own.
    #[default]
    Rapier,
    /// MuJoCo, in builds with the feature `mujoco`.
    Mujoco,
}

impl Engine {
    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rapier => "rapier",
            Self::Mujoco => "mujoco",
        }
    }

    /// Refuses an engine that this build does not have.
    pub fn check(self) -> Result<(), PlantError> {
        match self {
            Self::Mujoco if !cfg!(feature = "mujoco") => Err(PlantError::NoMujoco),
            Self::Rapier | Self::Mujoco => Ok(()),
        }
    }
}

/// How one wheel stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelState {
    /// Normal force of the ground, zero in the air [N].
    pub load_n: f64,
    /// Normal and friction force of the ground on it, in the map frame [N].
    pub force_n: [f64; 3],
    /// Centre of its contact in the map frame, of the heavier one where it has two, if it touches the ground [m].
    pub contact_m: Option<[f64; 3]>,
    /// Hub in the map frame [m].
    pub hub_m: [f64; 3],
    /// Circumferential speed [m/s].
    pub speed_mps: f64,
    /// Travel of the strut from rest, upwards [m].
    pub travel_m: f64,
}

/// What an engine makes of a machine.
trait Physics: Send + Sync {
    fn set_command(&mut self, command: Command) -> Result<(), CommandError>;
    fn step(&mut self);
    fn step_s(&self) -> f64;
    fn time_s(&self) -> f64;
    fn motion(&self) -> Motion;
    fn wheels(&self) -> [WheelState; 4];
    fn rolled_over(&self) -> bool;
    fn collision(&self) -> Option<Collision>;
    fn is_in_water(&self) -> bool;
    fn left_world(&self) -> bool;
    fn is_finite(&self) -> bool;
}

/// The machine in its world.
pub struct Plant(Box<dyn Physics>);

impl Plant {
    /// Length of a step of the built-in engine [s]. Over 6 m of hills the end of the drive is off by 2 mm (full size) or
    /// 8 mm (RC car) from that of eight times finer steps, and the error halves with the step.
    pub const STEP_S: f64 = 1e-3;

    /// Puts the vehicle on the ground with its rear axle's centre at `start` = (x [m], y [m], yaw [rad]),
    /// parked, and lets it sink into its springs.
    pub fn new(vehicle: &Vehicle, world: Arc<World>, start: [f64; 3]) -> Result<Self, PlantError> {
        Self::deviating(vehicle, &[], world, start)
    }

    /// The same with a machine that departs from its description.
    pub fn deviating(
        vehicle: &Vehicle,
        deviations: &[Deviation],
        world: Arc<World>,
        start: [f64; 3],
    ) -> Result<Self, PlantError> {
        Self::with_step(vehicle, deviations, world, start, Self::STEP_S)
    }

    /// The same with another step length [s], to see what the step does.
    pub fn with_step(
        vehicle: &Vehicle,
        deviations: &[Deviation],
        world: Arc<World>,
        start: [f64; 3],
        step_s: f64,
    ) -> Result<Self, PlantError> {
        Ok(Self(Box::new(RapierPlant::new(vehicle, deviations, world, start, step_s)?)))
    }

    /// The same in an engine of one's choice; MuJoCo simulates machines as described, without deviations.
    pub fn in_engine(
        engine: Engine,
        vehicle: &Vehicle,
        deviations: &[Deviation],
        world: Arc<World>,
        start: [f64; 3],
    ) -> Result<Self, PlantError> {
        match engine {
            Engine::Rapier => Self::deviating(vehicle, deviations, world, start),
            Engine::Mujoco => Self::in_mujoco(vehicle, deviations, world, start),
        }
    }

    #[cfg(feature = "mujoco")]
    fn in_mujoco(
        vehicle: &Vehicle,
        deviations: &[Deviation],
        world: Arc<World>,
        start: [f64; 3],
    ) -> Result<Self, PlantError> {
        if !deviations.is_empty() {
            return Err(PlantError::DeviationsInMujoco { n_found: deviations.len() });
        }
        Ok(Self(Box::new(mujoco::MujocoPlant::new(vehicle, world, start)?)))
    }

    #[cfg(not(feature = "mujoco"))]
    fn in_mujoco(_: &Vehicle, _: &[Deviation], _: Arc<World>, _: [f64; 3]) -> Result<Self, PlantError> {
        Err(PlantError::NoMujoco)
    }

    /// Takes a command; it is held until the next one and limited to what the vehicle may do.
    pub fn set_command(&mut self, command: Command) -> Result<(), CommandError> {
        self.0.set_command(command)
    }

    /// Runs for the nearest whole number of steps.
    pub fn advance(&mut self, duration_s: f64) {
        for _ in 0..(duration_s / self.0.step_s()).round() as u64 {
            self.0.step();
        }
    }

    /// Runs for one step.
    pub fn step(&mut self) {
        self.0.step();
    }
}

/// What can be seen of the plant.
impl Plant {
    /// Time since the start [s].
    pub fn time_s(&self) -> f64 {
        self.0.time_s()
    }

    /// Pose of the rear axle's centre.
    pub fn pose(&self) -> Pose {
        self.0.motion().pose
    }

    /// How the vehicle moves; the specific force is the mean over the last step.
    pub fn motion(&self) -> Motion {
        self.0.motion()
    }

    /// How the wheels stand: front left, front right, rear left, rear right.
    pub fn wheels(&self) -> [WheelState; 4] {
        self.0.wheels()
    }

    /// Whether the body lies on its side or its roof.
    pub fn rolled_over(&self) -> bool {
        self.0.rolled_over()
    }

    /// What obstacles have done to the vehicle, if it has touched one.
    pub fn collision(&self) -> Option<Collision> {
        self.0.collision()
    }

    /// Whether a wheel stands in water.
    pub fn is_in_water(&self) -> bool {
        self.0.is_in_water()
    }

    /// Whether a wheel has ever been beyond the border of the world, where the ground is made up.
    pub fn left_world(&self) -> bool {
        self.0.left_world()
    }

    /// Whether every number of the state is one.
    pub fn is_finite(&self) -> bool {
        self.0.is_finite()
    }
}

/// A command within what the vehicle may do.
fn limited(command: Command, limits: &Limits) -> Result<Command, CommandError> {
    let Command { speed_mps, steering_rad } = command;
    if !(speed_mps.is_finite() && steering_rad.is_finite()) {
        return Err(CommandError { speed_mps, steering_rad });
    }
    let fastest_mps = limits.speed_max_mps as f32;
    let reverse_mps = limits.reverse_speed_max_mps as f32;
    Ok(Command { speed_mps: speed_mps.clamp(-reverse_mps, fastest_mps), steering_rad })
}
