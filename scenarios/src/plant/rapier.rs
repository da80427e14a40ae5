//! The built-in plant.
//!
//! rapier carries the body, its contact with the ground and the integration; on it stand four wheels of our own.
//! What no model of ours knows: load that moves between the wheels, friction that falls with load, forces that
//! build up over a distance, wheels that wrap around rocks, per-cell friction, differentials, a speed servo.
//!
//! Simplified: the body carries the wheels' mass; along its strut a wheel has that mass once more, without weight,
//! so that it can hop. Struts are straight and upright in the body; gyroscopic torques of the wheels are left out.

use std::sync::Arc;

use bicycle::{Command, Vehicle};
use nalgebra::{Rotation3, Vector3};
use terrain::Pose;

use super::chassis::{BodyMotion, Chassis, Wrench};
use super::collision::Collisions;
use super::drivetrain::Drivetrain;
use super::envelope::Disc;
use super::ground::Ground;
use super::linkage::Linkage;
use super::load::Load;
use super::machine::Machine;
use super::receiver::Receiver;
use super::rest::{Rest, Stance};
use super::ruts::Ruts;
use super::servo::SteeringServo;
use super::start::{check_start, standing};
use super::strut::Strut;
use super::wheel::{RunningGear, Wheel, WheelInput};
use super::{
    Collision, CommandError, GRAVITY_MPS2, Physics, PlantError, ROLLED_OVER_COSINE, SETTLING_S, WheelState,
    limited,
};
use crate::{Deviation, Motion, World};

/// The machine in its world.
pub(super) struct RapierPlant {
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

impl RapierPlant {
    pub(super) fn new(
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
        for _ in 0..(SETTLING_S / step_s).round() as u64 {
            plant.step();
        }
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
        let pose = standing(stance, &ground, start, |i, hub_m, left| {
            let envelope = &gear[i].envelope;
            let depth_m = Disc::new(hub_m, left).map_or(0.0, |disc| envelope.depth_m(&ground, &disc));
            [depth_m, envelope.radius_m() - stance.axle_height_m]
        });
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

    /// Pose of the rear axle's centre.
    fn pose(&self) -> Pose {
        let [ahead, left, up] = self.motion.axes;
        let rotation = Rotation3::from_basis_unchecked(&[ahead, left, up]);
        let (roll_rad, pitch_rad, yaw_rad) = rotation.euler_angles();
        let origin_m = self.motion.origin_m;
        Pose { x_m: origin_m.x, y_m: origin_m.y, z_m: origin_m.z, roll_rad, pitch_rad, yaw_rad }
    }

    fn count_collision(&mut self) {
        if !self.ground.has_obstacles() {
            return;
        }
        let (velocity_mps, at_m) = (self.motion.linear_mps.xy(), self.motion.origin_m.xy().into());
        let (chassis, ground, step_s) = (&self.chassis, &self.ground, self.step_s);
        let on_wheels =
            self.gear.iter().zip(&self.wheels).map(|(gear, wheel)| gear.obstacle_force_n(wheel, ground));
        let time_s = self.n_steps as f64 * step_s;
        self.collisions.count(velocity_mps, at_m, time_s, || {
            chassis.obstacle_impulse_ns(ground).xy() + on_wheels.sum::<Vector3<f64>>().xy() * step_s
        });
    }

    fn hub_m(&self, i: usize) -> Vector3<f64> {
        self.wheels[i].frame(&self.motion, 0.0).hub_m
    }
}

impl Physics for RapierPlant {
    fn set_command(&mut self, command: Command) -> Result<(), CommandError> {
        self.command = limited(command, &self.limits)?;
        Ok(())
    }

    fn step(&mut self) {
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
        self.count_collision();
    }

    fn step_s(&self) -> f64 {
        self.step_s
    }

    fn time_s(&self) -> f64 {
        self.n_steps as f64 * self.step_s
    }

    fn motion(&self) -> Motion {
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

    fn wheels(&self) -> [WheelState; 4] {
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

    fn rolled_over(&self) -> bool {
        self.motion.axes[2].z < ROLLED_OVER_COSINE
    }

    fn collision(&self) -> Option<Collision> {
        self.collisions.first()
    }

    fn is_in_water(&self) -> bool {
        let mut touches = self.wheels.iter().flat_map(Wheel::touches);
        touches.any(|touch| self.ground.patch(touch.contact.point_m.x, touch.contact.point_m.y).is_water())
    }

    fn left_world(&self) -> bool {
        self.left_world
    }

    fn is_finite(&self) -> bool {
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
