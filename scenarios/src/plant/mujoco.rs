//! The plant in MuJoCo.
//!
//! A free body with the description's mass, inertia and underside; four struts (slide joints with spring, damper and
//! stops), on the front ones steered hinges under position actuators, on all of them wheels that turn; anti-roll bars and
//! differential as tendons. Tyres are MuJoCo's contacts: stiff ellipsoids with an elliptic friction cone, whose
//! coefficient is what the ground under the wheel holds at the tread's slip speed. Brakes and rolling resistance are dry
//! friction of the axles. The ground is a height field of the world's triangles.
//!
//! What the built-in plant has and this one does not: a tread that bends before it slides (slip stiffness, relaxation
//! length), a tyre that yields as the description says, loose ground, deviations.

mod contact;
mod model;

use std::sync::Arc;

use bicycle::{Command, Limits, Vehicle};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector2, Vector3};
use terrain::Pose;

use self::contact::{Touch, touches};
use self::model::{WHEELS, depth_m, free_joint, model, stance, told};
use super::collision::Collisions;
use super::drivetrain::{Drivetrain, WheelTorque};
use super::ground::Ground;
use super::linkage::Linkage;
use super::receiver::Receiver;
use super::rest::{Rest, Stance};
use super::servo::SteeringServo;
use super::start::{check_start, standing};
use super::vegetation::{Immersion, Stems, plants_above_m};
use super::{
    Collision, CommandError, GRAVITY_MPS2, Physics, PlantError, ROLLED_OVER_COSINE, SETTLING_S, WheelState,
    limited,
};
use crate::friction::{holding, load_factor};
use crate::{Motion, World};

/// Length of a step [s], a whole part of the inertial unit's period.
const STEP_S: f64 = 1.25e-3;

/// Where the parts of one wheel are in MuJoCo's arrays.
#[derive(Clone, Copy, Debug)]
struct Place {
    body: usize,
    strut_position: usize,
    axle_velocity: usize,
}

/// What a wheel met in the last step.
#[derive(Clone, Copy, Debug, Default)]
struct Met {
    load_n: f64,
    force_n: Vector3<f64>,
    heaviest: Option<Touch>,
}

/// The machine in its world.
pub(super) struct MujocoPlant {
    vehicle: Vehicle,
    limits: Limits,
    stance: Stance,
    reference_load_n: f64,
    ground: Ground,
    data: MjData<Box<MjModel>>,
    /// A second copy of the model: in it friction is set for the next step, then the two change places.
    spare: Option<Box<MjModel>>,
    ground_geom: usize,
    wheel_geoms: [usize; 4],
    places: [Place; 4],
    met: [Met; 4],
    stems: [Stems; 4],
    drivetrain: Drivetrain,
    servo: SteeringServo,
    receiver: Receiver,
    command: Command,
    specific_force_mps2: Vector3<f64>,
    n_steps: u64,
    left_world: bool,
    collisions: Collisions,
}

impl MujocoPlant {
    pub(super) fn new(vehicle: &Vehicle, world: Arc<World>, start: [f64; 3]) -> Result<Self, PlantError> {
        vehicle.validate()?;
        if start.iter().any(|value| !value.is_finite()) {
            return Err(PlantError::NonFiniteStart(start));
        }
        let (ground, rest, stance) = (Ground::new(world), Rest::new(vehicle), stance(vehicle));
        check_start(&stance, &ground, start)?;
        let model = Box::new(model(vehicle, &rest, &stance, &ground, STEP_S)?);
        let mut plant = Self::parked(vehicle, (&rest, stance), ground, model)?;
        plant.set_down(start);
        for _ in 0..(SETTLING_S / STEP_S).round() as u64 {
            plant.step();
        }
        plant.n_steps = 0;
        plant.collisions = Collisions::default();
        Ok(plant)
    }

    fn parked(
        vehicle: &Vehicle,
        (rest, stance): (&Rest, Stance),
        ground: Ground,
        model: Box<MjModel>,
    ) -> Result<Self, PlantError> {
        let spare = Some(model.clone());
        let geom = |name| number(&model, MjtObjBase::mjOBJ_GEOM, name);
        let (ground_geom, wheel_geoms) =
            (geom("ground")?, [geom(WHEELS[0])?, geom(WHEELS[1])?, geom(WHEELS[2])?, geom(WHEELS[3])?]);
        let place = |name| Place::of(&model, name);
        let places = [place(WHEELS[0])?, place(WHEELS[1])?, place(WHEELS[2])?, place(WHEELS[3])?];
        Ok(Self {
            vehicle: vehicle.clone(),
            limits: vehicle.limits,
            stance,
            reference_load_n: 0.25 * rest.mass_kg * GRAVITY_MPS2,
            ground,
            data: MjData::try_new(model).map_err(|error| told(&error))?,
            spare,
            ground_geom,
            wheel_geoms,
            places,
            met: [Met::default(); 4],
            stems: [Stems::default(); 4],
            drivetrain: Drivetrain::new(vehicle, rest, &stance),
            servo: SteeringServo::new(vehicle, Linkage::new(&[])),
            receiver: Receiver::new(&vehicle.servo, &[], STEP_S),
            command: Command::default(),
            specific_force_mps2: Vector3::z() * GRAVITY_MPS2,
            n_steps: 0,
            left_world: false,
            collisions: Collisions::default(),
        })
    }

    fn set_down(&mut self, start: [f64; 3]) {
        let (radius_m, width_m) = (self.vehicle.geometry.wheel_radius_m, self.vehicle.wheel.width_m);
        let pose = standing(&self.stance, &self.ground, start, |_, hub_m, left| {
            [depth_m(&self.ground, radius_m, width_m, hub_m, left), 0.0]
        });
        self.data.qpos_mut()[..7].copy_from_slice(&free_joint(&pose));
    }

    fn origin_m(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.data.qpos()[..3])
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        let qpos = self.data.qpos();
        Unit::new_normalize(Quaternion::new(qpos[3], qpos[4], qpos[5], qpos[6]))
    }

    /// Velocity of the rear axle's centre in map coordinates [m/s].
    fn velocity_mps(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.data.qvel()[..3])
    }

    fn spin_radps(&self) -> [f64; 4] {
        self.places.map(|place| self.data.qvel()[place.axle_velocity])
    }

    fn hub_m(&self, i: usize) -> Vector3<f64> {
        let travel_m = self.data.qpos()[self.places[i].strut_position];
        self.origin_m() + self.rotation() * (self.stance.hub_m[i] + Vector3::z() * travel_m)
    }

    /// Velocity of the hub in map coordinates [m/s], and of the tread over the ground.
    fn hub_and_tread_mps(&self, i: usize) -> [Vector3<f64>; 2] {
        let body = self.places[i].body;
        let Ok([turn_x, turn_y, turn_z, x, y, z]) =
            self.data.try_object_velocity(MjtObjBase::mjOBJ_XBODY, body, false)
        else {
            return [Vector3::zeros(); 2];
        };
        let (hub_mps, turn_radps) = (Vector3::new(x, y, z), Vector3::new(turn_x, turn_y, turn_z));
        let tread_mps = self.met[i].heaviest.map_or(Vector3::zeros(), |touch| {
            let velocity_mps =
                hub_mps + turn_radps.cross(&(touch.point_m - Vector3::from(self.data.xpos()[body])));
            velocity_mps - touch.normal * velocity_mps.dot(&touch.normal)
        });
        [hub_mps, tread_mps]
    }

    /// Friction of the ground under a wheel at the speed at which its tread slides, under its load [-].
    fn friction(&self, i: usize, tread_mps: &Vector3<f64>) -> f64 {
        let at_m = self.met[i].heaviest.map_or_else(|| self.hub_m(i), |touch| touch.point_m);
        let soil = self.ground.patch(at_m.x, at_m.y);
        let load = self.met[i].load_n / self.reference_load_n;
        load_factor(self.vehicle.tyre.load_sensitivity, load) * holding(&soil.friction, tread_mps.norm())
    }

    /// Dry friction of an axle: its brake, and rolling resistance of tyre and ground [N m].
    fn dry_friction_nm(&self, i: usize, torque: &WheelTorque) -> f64 {
        let soil_of =
            |touch: Touch| f64::from(self.ground.patch(touch.point_m.x, touch.point_m.y).rolling_resistance);
        let resistance = self.vehicle.tyre.rolling_resistance + self.met[i].heaviest.map_or(0.0, soil_of);
        torque.brake_nm + resistance * self.met[i].load_n * self.vehicle.geometry.wheel_radius_m
    }

    /// Resistance of plants against a wheel, east and north [N].
    fn stems_n(&mut self, i: usize, hub_mps: &Vector3<f64>, steering_rad: f64) -> Vector2<f64> {
        let geometry = &self.vehicle.geometry;
        let forward = self.rotation() * Vector3::new(steering_rad.cos(), steering_rad.sin(), 0.0);
        let hub_m = self.hub_m(i);
        // Plants are met at the leading edge of the wheel.
        let edge_m = hub_m + forward * geometry.wheel_radius_m.copysign(hub_mps.dot(&forward));
        let immersion = Immersion {
            height_m: plants_above_m(&self.ground, edge_m.xy(), hub_m.z - geometry.wheel_radius_m),
            diameter_m: 2.0 * geometry.wheel_radius_m,
            clearance_m: geometry.ground_clearance_m,
            density: 1.0,
        };
        self.stems[i].push_n(&immersion, hub_mps.xy(), self.reference_load_n, STEP_S)
    }

    /// Sets torques, friction and the resistance of plants for the next step.
    fn push(&mut self, torques: &[WheelTorque; 4], steering_rad: [f64; 4]) {
        let velocities_mps: [[Vector3<f64>; 2]; 4] = std::array::from_fn(|i| self.hub_and_tread_mps(i));
        for i in 0..4 {
            let place = self.places[i];
            let stems_n = self.stems_n(i, &velocities_mps[i][0], steering_rad[i]);
            self.data.xfrc_applied_mut()[place.body][..2].copy_from_slice(stems_n.as_slice());
            self.data.qfrc_applied_mut()[place.axle_velocity] = torques[i].drive_nm;
        }
        self.data.ctrl_mut().copy_from_slice(&steering_rad[..2]);
        if let Some(mut spare) = self.spare.take() {
            for i in 0..4 {
                spare.geom_friction_mut()[self.wheel_geoms[i]][0] = self.friction(i, &velocities_mps[i][1]);
                spare.dof_frictionloss_mut()[self.places[i].axle_velocity] =
                    self.dry_friction_nm(i, &torques[i]);
            }
            self.spare = Some(self.data.swap_model(spare));
        }
    }

    /// Notes what the ground did in the step that has just been taken.
    fn note_touches(&mut self) {
        self.met = [Met::default(); 4];
        let touches = touches(&self.data, self.ground_geom, &self.wheel_geoms);
        for touch in &touches {
            let Some(met) = touch.wheel.map(|wheel| &mut self.met[wheel]) else { continue };
            met.load_n += touch.load_n;
            met.force_n += touch.force_n;
            if met.heaviest.is_none_or(|heaviest| heaviest.load_n < touch.load_n) {
                met.heaviest = Some(*touch);
            }
        }
        self.count_collision(&touches);
    }

    fn count_collision(&mut self, touches: &[Touch]) {
        if !self.ground.has_obstacles() {
            return;
        }
        let ground = &self.ground;
        let of_obstacles = touches.iter().filter(|touch| {
            // A contact lies on the face that pushes; what stands there lies behind it.
            let place_m = touch.point_m - touch.normal * (0.5 * ground.resolution_m());
            ground.is_obstacle(place_m.x, place_m.y)
        });
        let impulse_ns = of_obstacles.map(|touch| touch.force_n.xy()).sum::<Vector2<f64>>() * STEP_S;
        let (velocity_mps, at_m) = (self.velocity_mps().xy(), self.origin_m().xy().into());
        let time_s = self.n_steps as f64 * STEP_S;
        self.collisions.count(velocity_mps, at_m, time_s, || impulse_ns);
    }
}

impl Place {
    fn of(model: &MjModel, name: &str) -> Result<Self, PlantError> {
        let joint = |kind: &str| number(model, MjtObjBase::mjOBJ_JOINT, &format!("{kind}_{name}"));
        Ok(Self {
            body: number(model, MjtObjBase::mjOBJ_BODY, name)?,
            strut_position: model.jnt_qposadr()[joint("strut")?] as usize,
            axle_velocity: model.jnt_dofadr()[joint("axle")?] as usize,
        })
    }
}

/// Number of a part of the model.
fn number(model: &MjModel, kind: MjtObjBase, name: &str) -> Result<usize, PlantError> {
    let missing = || PlantError::Mujoco { told: format!("the model has no {name}") };
    model.name_to_id(kind, name).ok_or_else(missing)
}

impl Physics for MujocoPlant {
    fn set_command(&mut self, command: Command) -> Result<(), CommandError> {
        self.command = limited(command, &self.limits)?;
        Ok(())
    }

    fn step(&mut self) {
        let command = self.receiver.pass(self.command);
        self.servo.step(f64::from(command.steering_rad), 0.0, STEP_S);
        let torques = self.drivetrain.step(f64::from(command.speed_mps), self.spin_radps(), STEP_S);
        let [left_rad, right_rad] = self.servo.wheel_angles_rad();
        self.push(&torques, [left_rad, right_rad, 0.0, 0.0]);
        let before_mps = self.velocity_mps();
        self.data.step();
        let acceleration_mps2 = (self.velocity_mps() - before_mps) / STEP_S;
        let specific_mps2 = acceleration_mps2 + Vector3::z() * GRAVITY_MPS2;
        self.specific_force_mps2 = self.rotation().inverse_transform_vector(&specific_mps2);
        self.n_steps += 1;
        self.note_touches();
        self.left_world |= (0..4).any(|i| {
            let hub_m = self.hub_m(i);
            !self.ground.contains(hub_m.x, hub_m.y)
        });
    }

    fn step_s(&self) -> f64 {
        STEP_S
    }

    fn time_s(&self) -> f64 {
        self.n_steps as f64 * STEP_S
    }

    fn motion(&self) -> Motion {
        let (origin_m, rotation) = (self.origin_m(), self.rotation());
        let (roll_rad, pitch_rad, yaw_rad) = rotation.euler_angles();
        let pose = Pose { x_m: origin_m.x, y_m: origin_m.y, z_m: origin_m.z, roll_rad, pitch_rad, yaw_rad };
        let qvel = self.data.qvel();
        Motion {
            pose,
            velocity_mps: rotation.inverse_transform_vector(&self.velocity_mps()).into(),
            angular_rate_radps: [qvel[3], qvel[4], qvel[5]],
            specific_force_mps2: self.specific_force_mps2.into(),
            wheel_speed_mps: self.drivetrain.speed_mps(&self.spin_radps()),
            steering_rad: self.servo.steering_rad(),
        }
    }

    fn wheels(&self) -> [WheelState; 4] {
        let spin_radps = self.spin_radps();
        std::array::from_fn(|i| WheelState {
            load_n: self.met[i].load_n,
            force_n: self.met[i].force_n.into(),
            contact_m: self.met[i].heaviest.map(|touch| touch.point_m.into()),
            hub_m: self.hub_m(i).into(),
            speed_mps: spin_radps[i] * self.stance.rolling_radius_m,
            travel_m: self.data.qpos()[self.places[i].strut_position],
        })
    }

    fn rolled_over(&self) -> bool {
        (self.rotation() * Vector3::z()).z < ROLLED_OVER_COSINE
    }

    fn collision(&self) -> Option<Collision> {
        self.collisions.first()
    }

    fn is_in_water(&self) -> bool {
        let touches = self.met.iter().filter_map(|met| met.heaviest);
        touches.into_iter().any(|touch| self.ground.patch(touch.point_m.x, touch.point_m.y).is_water())
    }

    fn left_world(&self) -> bool {
        self.left_world
    }

    fn is_finite(&self) -> bool {
        self.data.qpos().iter().chain(self.data.qvel()).all(|value| value.is_finite())
    }
}
