//! Machines drawn at random around a described one, each on hills of its own.

use std::sync::Arc;

use bicycle::Vehicle;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::hills::Hills;
use crate::plant::{GRAVITY_MPS2, vegetation_resistance};
use crate::random::stream;
use crate::{Deviation, OdometryConfig, Stribeck, World, WorldError};

/// Share of machines whose motor controller has no integral, as cheap ones have none.
const DROOP_SHARE: f64 = 0.8;

/// A machine, its simulator's world and its sensors.
#[derive(Clone, Debug)]
pub struct TestMachine {
    /// As described; the simulator's plant is this.
    pub vehicle: Vehicle,
    /// What simulator and robot have in common beyond the description.
    pub peculiarities: Vec<Deviation>,
    /// Where both drive.
    pub world: Arc<World>,
    /// What both measure with.
    pub sensors: OdometryConfig,
    /// Slowest and fastest command [m/s].
    pub speeds_mps: [f64; 2],
    /// Largest angle that is commanded [rad].
    pub steering_max_rad: f64,
    hills: Hills,
}

impl TestMachine {
    /// The machine that belongs to a seed, of the kind of `base`.
    ///
    /// Errors: hills that make no world, as for a base that is no vehicle.
    pub fn draw(base: &Vehicle, name: &str, seed: u64) -> Result<Self, WorldError> {
        let mut rng = stream(seed, &[0xF1EE7]);
        let mut vehicle = varied(base, &mut rng);
        name.clone_into(&mut vehicle.name);
        let wheelbase_m = vehicle.geometry.wheelbase_m;
        // By Froude's number: machines of every size lean, slide and hop alike.
        let fast_mps = (rng.random_range(1.2..2.0) * GRAVITY_MPS2 * wheelbase_m).sqrt();
        vehicle.limits.speed_max_mps = 1.3 * fast_mps;
        let hills = Hills {
            wheelbase_m,
            friction: friction(fast_mps, &mut rng),
            vegetation_m: 2.0 * vehicle.geometry.wheel_radius_m * rng.random_range(0.2..0.4),
        };
        let world = Arc::new(hills.draw(&mut rng)?);
        let droop = rng.random_bool(DROOP_SHARE).then_some(Deviation::MotorDroop);
        Ok(Self {
            peculiarities: droop.into_iter().collect(),
            world,
            sensors: sensors(wheelbase_m),
            speeds_mps: [rng.random_range(0.15..0.35) * fast_mps, fast_mps],
            steering_max_rad: 0.42_f64.min(vehicle.limits.steering_max_rad),
            hills,
            vehicle,
        })
    }

    /// Half of the side of the square it drives in [m].
    pub fn half_side_m(&self) -> f64 {
        self.hills.half_side_m()
    }

    /// Most that the firm ground holds per mass [m/s2].
    pub(super) fn grip_mps2(&self) -> f64 {
        f64::from(self.hills.friction.static_friction) * GRAVITY_MPS2
    }

    /// Friction of the firm ground [-].
    pub(super) fn friction(&self) -> f64 {
        f64::from(self.hills.friction.static_friction)
    }

    /// Resistance of the meadows [m/s2].
    pub(super) fn vegetation_mps2(&self) -> f64 {
        GRAVITY_MPS2 * vegetation_resistance(&self.vehicle, self.hills.vegetation_m)
    }

    /// With its wheels [kg].
    pub(super) fn mass_kg(&self) -> f64 {
        self.vehicle.body.mass_kg + 4.0 * self.vehicle.wheel.mass_kg
    }

    /// Mass on the front axle [kg].
    pub(super) fn front_kg(&self) -> f64 {
        let Vehicle { body, wheel, geometry, .. } = &self.vehicle;
        body.mass_kg * body.cog_ahead_m / geometry.wheelbase_m + 2.0 * wheel.mass_kg
    }
}

/// Sizes, masses, stiffnesses and responses around those of a described vehicle.
fn varied(base: &Vehicle, rng: &mut Xoshiro256PlusPlus) -> Vehicle {
    let mut vehicle = base.clone();
    let mut factor = |low: f64, high: f64| rng.random_range(low..high);
    let (size, mass, spring) = (factor(0.85, 1.2), factor(0.75, 1.35), factor(0.85, 1.2));
    let longer = factor(0.94, 1.1);
    let geometry = &mut vehicle.geometry;
    geometry.wheelbase_m *= size * longer;
    geometry.length_m *= size * longer;
    for length_m in [
        &mut geometry.track_m,
        &mut geometry.width_m,
        &mut geometry.rear_overhang_m,
        &mut geometry.ground_clearance_m,
        &mut geometry.wheel_radius_m,
        &mut vehicle.wheel.width_m,
        &mut vehicle.body.cog_height_m,
        &mut vehicle.tyre.relaxation_length_m,
    ] {
        *length_m *= size;
    }
    vehicle.body.cog_ahead_m *= size * longer * factor(0.93, 1.07);
    vehicle.body.mass_kg *= mass;
    vehicle.body.inertia_kgm2 = vehicle.body.inertia_kgm2.map(|inertia| inertia * mass * size * size);
    vehicle.wheel.mass_kg *= mass;
    vehicle.wheel.spin_inertia_kgm2 *= mass * size * size;
    for axle in [&mut vehicle.front, &mut vehicle.rear] {
        axle.suspension.stiffness_n_per_m *= mass * spring;
        axle.suspension.damping_ns_per_m *= mass * spring.sqrt();
        axle.suspension.travel_m *= size;
        axle.anti_roll_nm_per_rad *= mass * spring * size * size;
    }
    vehicle.tyre.radial_stiffness_n_per_m *= mass * factor(0.85, 1.25);
    vehicle.tyre.rolling_resistance *= factor(0.6, 1.6);
    vehicle.tyre.load_sensitivity *= factor(0.5, 1.5);
    vehicle.tyre.slip_stiffness *= factor(0.85, 1.25);
    let drivetrain = &mut vehicle.drivetrain;
    drivetrain.drive_torque_max_nm *= mass * size * factor(1.0, 1.4);
    drivetrain.brake_torque_max_nm *= mass * size * factor(1.0, 1.4);
    drivetrain.power_max_w *= 3.0 * mass;
    drivetrain.response_s *= factor(0.6, 1.6);
    vehicle.servo.response_s *= factor(0.6, 1.6);
    vehicle.servo.delay_s *= factor(0.5, 1.5);
    vehicle.limits.steering_rate_max_radps *= factor(1.0, 1.6);
    vehicle.limits.acceleration_max_mps2 *= factor(1.0, 1.6);
    vehicle
}

/// Firm ground that holds alike at every slip speed.
fn friction(fast_mps: f64, rng: &mut Xoshiro256PlusPlus) -> Stribeck {
    let friction = rng.random_range(0.7..0.95) as f32;
    Stribeck {
        static_friction: friction,
        dynamic_friction: friction,
        viscous_friction: 0.0,
        stribeck_speed_mps: fast_mps as f32,
    }
}

/// Separate sensors for pose, velocity and yaw rate that do not drift; small machines carry finer ones.
fn sensors(wheelbase_m: f64) -> OdometryConfig {
    let share = (wheelbase_m / 0.5).clamp(0.4, 1.0);
    OdometryConfig {
        position_noise_m: 0.012 * share,
        attitude_noise_rad: 0.003,
        velocity_noise_mps: 0.03 * share,
        yaw_rate_noise_radps: 0.008,
        ..OdometryConfig::PERFECT
    }
}
