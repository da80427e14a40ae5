//! The plant: the machine as it is, in rigid-body and tyre physics.
//!
//! rapier carries the body, its contact with the ground and the integration; on it stand four wheels of our own.
//! What no model of ours knows: load that moves between the wheels, friction that falls with load, forces that
//! build up over a distance, wheels that wrap around rocks, per-cell friction, differentials, a speed servo.
//!
//! Simplified: the body carries the wheels' mass; along its strut a wheel has that mass once more, without weight,
//! so that it can hop. Struts are straight and upright in the body; gyroscopic torques of the wheels are left out.
//!
//! Deterministic: the same vehicle, world, start and commands give the same bits.

mod chassis;
mod collision;
mod drivetrain;
mod envelope;
mod error;
mod ground;
mod linkage;
mod load;
mod machine;
mod receiver;
mod rest;
mod ruts;
mod servo;
mod strut;
mod trailer;
mod tyre;
mod vegetation;
mod wheel;

use std::sync::Arc;

use bicycle::{Command, Vehicle};
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use terrain::Pose;

use crate::{Deviation, Motion, World};
use chassis::{BodyMotion, Chassis, Wrench};
pub use collision::Collision;
use collision::Collisions;
use drivetrain::Drivetrain;
pub(crate) use drivetrain::LIMITED_SLIP_S_PER_M;
use envelope::Disc;
pub use error::{CommandError, PlantError};
use ground::Ground;
use linkage::Linkage;
pub(crate) use load::AIR_KGPM3;
use load::Load;
use machine::Machine;
use receiver::Receiver;
use rest::{Rest, Stance};
use ruts::Ruts;
use servo::SteeringServo;
use strut::Strut;
pub use tyre::steady_friction;
pub(crate) use vegetation::vegetation_resistance;
use wheel::{RunningGear, Wheel, WheelInput};

/// Acceleration of gravity [m/s2].
pub(crate) const GRAVITY_MPS2: f64 = 9.81;

/// Time the vehicle is given to sink into its springs before the first command [s].
const SETTLING_S: f64 = 1.5;
/// Below this cosine of the body's tilt (70 degrees) it has rolled over.
const ROLLED_OVER_COSINE: f64 = 0.342;

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

/// The machine in its world.
pub struct Plant {
    ground: Ground,
    /// None where no ground gives way.
    ruts: Option<Ruts>,
    chassis: Chassis,
    gear: [RunningGear; 4],
    wheels: [Wheel; 4],
    struts: [Strut; 4],
    /// Force on each wheel of an axle per difference of travel [N/m], front and rear.
    anti_roll_n_per_m: [f64; 2],
    drivetrain: Drivetrain,
    servo: SteeringServo,
    receiver: Receiver,
    loads: Vec<Load>,
    limits: bicycle::Limits,
    rolling_radius_m: f64,
    command: Command,
    motion: BodyMotion,
    specific_force_mps2: Vector3<f64>,
    step_s: f64,
    n_steps: u64,
    left_world: bool,
    collisions: Collisions,
}

impl Plant {
    /// Length of a step [s]. Over 6 m of hills the end of the drive is off by 2 mm (full size) or 8 mm (RC car)
    /// from that of eight times finer steps, and the error halves with the step.
    pub const STEP_S: f64 = 1e-3;

    /// Puts the vehicle on the ground with its rear axle's centre at `start` = (x [m], y [m], yaw [rad]),
    /// parked, and lets it sink into its springs.
    pub fn new(vehicle: &Vehicle, world: Arc<World>, start: [f64; 3]) -> Result<Self, PlantError> {
        Self::with_step(vehicle, &[], world, start, Self::STEP_S)
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
        vehicle.validate()?;
        deviations.iter().try_for_each(Deviation::validate)?;
        if start.iter().any(|value| !value.is_finite()) {
            return Err(PlantError::NonFiniteStart(start));
        }
        let machine = Machine::new(vehicle, deviations);
        let ground = Ground::new(world);
        let gear = machine.gear(ground.resolution_m(), step_s);
        let stance = machine.rest.stance(&machine.body, &gear[0].envelope);
        let mut plant = Self::parked(&machine, gear, &stance, ground, (start, step_s))?;
        plant.advance(SETTLING_S);
        plant.n_steps = 0;
        plant.collisions = Collisions::default();
        Ok(plant)
    }

    fn parked(
        machine: &Machine<'_>,
        gear: [RunningGear; 4],
        stance: &Stance,
        ground: Ground,
        (start, step_s): ([f64; 3], f64),
    ) -> Result<Self, PlantError> {
        let Machine { vehicle, body, rest, deviations, .. } = machine;
        check_tyre(vehicle, rest, &gear)?;
        check_start(stance, &ground, start)?;
        let pose = standing(stance, &gear, &ground, start);
        let chassis = Chassis::new(body, rest, stance, &ground, &pose, step_s);
        let track_m = vehicle.geometry.track_m;
        let axles = [vehicle.front, vehicle.rear];
        Ok(Self {
            motion: chassis.motion(),
            chassis,
            wheels: stance.hub_m.map(Wheel::at),
            struts: std::array::from_fn(|i| {
                Strut::new(axles[i / 2].suspension, rest.load_n[i], vehicle.wheel.mass_kg)
            }),
            anti_roll_n_per_m: axles.map(|axle| axle.anti_roll_nm_per_rad / (track_m * track_m)),
            drivetrain: machine.drivetrain(&ground),
            servo: SteeringServo::new(&machine.actuators, Linkage::new(deviations)),
            receiver: Receiver::new(&vehicle.servo, deviations, step_s),
            loads: deviations.iter().filter_map(|deviation| Load::of(deviation, rest.mass_kg)).collect(),
            limits: vehicle.limits,
            rolling_radius_m: stance.rolling_radius_m,
            command: Command::default(),
            specific_force_mps2: Vector3::z() * GRAVITY_MPS2,
            step_s,
            n_steps: 0,
            left_world: false,
            collisions: Collisions::default(),
            ruts: Ruts::new(&ground, vehicle.wheel.width_m),
            ground,
            gear,
        })
    }

    /// Takes a command; it is held until the next one and limited to what the vehicle may do.
    pub fn set_command(&mut self, command: Command) -> Result<(), CommandError> {
        let Command { speed_mps, steering_rad } = command;
        if !(speed_mps.is_finite() && steering_rad.is_finite()) {
            return Err(CommandError { speed_mps, steering_rad });
        }
        let fastest_mps = self.limits.speed_max_mps as f32;
        let reverse_mps = self.limits.reverse_speed_max_mps as f32;
        self.command = Command { speed_mps: speed_mps.clamp(-reverse_mps, fastest_mps), steering_rad };
        Ok(())
    }

    /// Runs for the nearest whole number of steps.
    pub fn advance(&mut self, duration_s: f64) {
        for _ in 0..(duration_s / self.step_s).round() as u64 {
            self.step();
        }
    }

    /// Runs for one step.
    pub fn step(&mut self) {
        let command = self.receiver.pass(self.command);
        self.servo.step(f64::from(command.steering_rad), self.front_lateral_n(), self.step_s);
        let spin_radps = self.wheels.map(|wheel| wheel.spin_radps);
        let torques = self.drivetrain.step(f64::from(command.speed_mps), spin_radps, self.step_s);
        let [left_rad, right_rad] = self.servo.wheel_angles_rad();
        let steering_rad = [left_rad, right_rad, 0.0, 0.0];
        let anti_roll_n = self.anti_roll_n();
        if let Some(ruts) = &mut self.ruts {
            ruts.press(&mut self.wheels, &self.ground);
        }
        let mut wrench = Wrench::default();
        for i in 0..4 {
            let input =
                WheelInput { steering_rad: steering_rad[i], torque: torques[i], anti_roll_n: anti_roll_n[i] };
            let wheel = (&mut self.wheels[i], &self.struts[i]);
            self.gear[i].step(wheel, &input, &self.motion, &self.ground, &mut wrench);
        }
        let [spin_radps, inertia_kgm2] =
            [self.wheels.map(|wheel| wheel.spin_radps), self.wheels.map(|wheel| wheel.inertia_kgm2)];
        let coupling_nm = self.drivetrain.coupling_nm(spin_radps, inertia_kgm2, self.step_s);
        for (wheel, torque_nm) in self.wheels.iter_mut().zip(coupling_nm) {
            wheel.couple(torque_nm, self.step_s, &mut wrench);
        }
        for load in &mut self.loads {
            load.push(&self.motion, &self.ground, self.step_s, &mut wrench);
        }
        self.move_body(&wrench);
        let (wheels, body) = ((&self.gear, &self.wheels), (&self.chassis, &self.ground));
        self.collisions.count(wheels, body, (self.time_s(), self.step_s));
    }

    /// Friction of the ground on the front axle in the last step, left positive [N].
    fn front_lateral_n(&self) -> f64 {
        self.wheels[..2].iter().map(|wheel| wheel.friction_n().dot(&self.motion.axes[1])).sum()
    }

    fn anti_roll_n(&self) -> [f64; 4] {
        let travel_m = self.wheels.map(|wheel| wheel.travel_m);
        let [front, rear] = self.anti_roll_n_per_m;
        let front_n = front * (travel_m[0] - travel_m[1]);
        let rear_n = rear * (travel_m[2] - travel_m[3]);
        [front_n, -front_n, rear_n, -rear_n]
    }

    fn move_body(&mut self, wrench: &Wrench) {
        let before_mps = self.motion.velocity_at_mps(&self.motion.origin_m);
        self.chassis.step(wrench, &self.ground);
        self.motion = self.chassis.motion();
        let after_mps = self.motion.velocity_at_mps(&self.motion.origin_m);
        let acceleration_mps2 = (after_mps - before_mps) / self.step_s;
        self.specific_force_mps2 = self.motion.in_body(&(acceleration_mps2 + Vector3::z() * GRAVITY_MPS2));
        self.left_world |= (0..4).any(|i| {
            let hub_m = self.hub_m(i);
            !self.ground.contains(hub_m.x, hub_m.y)
        });
        self.n_steps += 1;
    }

    fn hub_m(&self, i: usize) -> Vector3<f64> {
        self.wheels[i].frame(&self.motion, 0.0).hub_m
    }
}

/// What can be seen of the plant.
impl Plant {
    /// Time since the start [s].
    pub fn time_s(&self) -> f64 {
        self.n_steps as f64 * self.step_s
    }

    /// Pose of the rear axle's centre.
    pub fn pose(&self) -> Pose {
        let [ahead, left, up] = self.motion.axes;
        let rotation = Rotation3::from_basis_unchecked(&[ahead, left, up]);
        let (roll_rad, pitch_rad, yaw_rad) = rotation.euler_angles();
        let origin_m = self.motion.origin_m;
        Pose { x_m: origin_m.x, y_m: origin_m.y, z_m: origin_m.z, roll_rad, pitch_rad, yaw_rad }
    }

    /// How the vehicle moves; the specific force is the mean over the last step.
    pub fn motion(&self) -> Motion {
        let body = &self.motion;
        let spin_radps = self.wheels.map(|wheel| wheel.spin_radps);
        Motion {
            pose: self.pose(),
            velocity_mps: body.in_body(&body.velocity_at_mps(&body.origin_m)).into(),
            angular_rate_radps: body.in_body(&body.angular_radps).into(),
            specific_force_mps2: self.specific_force_mps2.into(),
            wheel_speed_mps: self.drivetrain.speed_mps(&spin_radps),
            steering_rad: self.servo.steering_rad(),
        }
    }

    /// How the wheels stand: front left, front right, rear left, rear right.
    pub fn wheels(&self) -> [WheelState; 4] {
        std::array::from_fn(|i| {
            let wheel = &self.wheels[i];
            WheelState {
                load_n: wheel.load_n,
                force_n: wheel.force_n.into(),
                contact_m: wheel.heaviest().map(|contact| contact.point_m.into()),
                hub_m: self.hub_m(i).into(),
                speed_mps: wheel.spin_radps * self.rolling_radius_m,
                travel_m: wheel.travel_m,
            }
        })
    }

    /// Whether the body lies on its side or its roof.
    pub fn rolled_over(&self) -> bool {
        self.motion.axes[2].z < ROLLED_OVER_COSINE
    }

    /// What obstacles have done to the vehicle, if it has touched one.
    pub fn collision(&self) -> Option<Collision> {
        self.collisions.first()
    }

    /// Whether a wheel stands in water.
    pub fn is_in_water(&self) -> bool {
        let mut touches = self.wheels.iter().flat_map(Wheel::touches);
        touches.any(|touch| self.ground.patch(touch.contact.point_m.x, touch.contact.point_m.y).is_water())
    }

    /// Whether a wheel has ever been beyond the border of the world, where the ground is made up.
    pub fn left_world(&self) -> bool {
        self.left_world
    }

    /// Whether every number of the state is one.
    pub fn is_finite(&self) -> bool {
        let wheels = self.wheels.iter().flat_map(|wheel| [wheel.travel_m, wheel.spin_radps]);
        self.pose().is_finite()
            && self.motion.linear_mps.iter().chain(self.motion.angular_radps.iter()).all(|v| v.is_finite())
            && wheels.into_iter().all(f64::is_finite)
    }
}

/// A tyre without air may go flat; the machine on four sound ones may not.
fn check_tyre(vehicle: &Vehicle, rest: &Rest, gear: &[RunningGear; 4]) -> Result<(), PlantError> {
    let most_m = vehicle.geometry.wheel_radius_m / 3.0;
    let load_n = 0.25 * rest.mass_kg * GRAVITY_MPS2;
    let found_m = gear.iter().map(|gear| gear.envelope.deflection_m(load_n)).fold(f64::INFINITY, f64::min);
    if found_m < most_m { Ok(()) } else { Err(PlantError::FlatTyre { most_m, found_m }) }
}

fn check_start(stance: &Stance, ground: &Ground, start: [f64; 3]) -> Result<(), PlantError> {
    let level = Isometry3::rotation(Vector3::z() * start[2]);
    for hub_m in stance.hub_m {
        let off_m = level * hub_m;
        let found_m = [start[0] + off_m.x, start[1] + off_m.y];
        if !ground.contains(found_m[0], found_m[1]) {
            return Err(PlantError::StartOutside { extent_m: ground.extent_m(), found_m });
        }
    }
    Ok(())
}

/// A pose in which the deepest wheel stands as deep as at rest and the body follows the ground under the wheels.
fn standing(stance: &Stance, gear: &[RunningGear; 4], ground: &Ground, start: [f64; 3]) -> Isometry3<f64> {
    let [x_m, y_m, yaw_rad] = start;
    let level = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
    let heights_m = stance.hub_m.map(|hub_m| {
        let off_m = level * hub_m;
        ground.height_m(x_m + off_m.x, y_m + off_m.y)
    });
    let [front_left, front_right, rear_left, rear_right] = heights_m;
    let wheelbase_m = stance.hub_m[0].x;
    let track_m = stance.hub_m[0].y - stance.hub_m[1].y;
    let pitch_rad = ((rear_left + rear_right - front_left - front_right) / (2.0 * wheelbase_m)).atan();
    let roll_rad = ((front_left + rear_left - front_right - rear_right) / (2.0 * track_m)).atan();
    let rotation = UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
    let left = rotation * Vector3::y();
    let lowest_m = 0.5 * (rear_left + rear_right);
    let height_m = stance.hub_m.iter().zip(gear).map(|(hub_m, gear)| {
        let hub_m = Vector3::new(x_m, y_m, lowest_m) + rotation * hub_m;
        let depth_m = Disc::new(hub_m, left).map_or(0.0, |disc| gear.envelope.depth_m(ground, &disc));
        lowest_m + depth_m - (gear.envelope.radius_m() - stance.axle_height_m)
    });
    let z_m = height_m.fold(f64::NEG_INFINITY, f64::max);
    Isometry3::from_parts(Translation3::new(x_m, y_m, z_m), rotation)
}
