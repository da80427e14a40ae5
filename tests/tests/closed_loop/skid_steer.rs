//! The planner with a skid-steered vehicle: another model of motion, nothing else.
//!
//! The plant here is a rigid body on four wheels that slide, by Coulomb's law: forces, where the model has a share of
//! what the wheels do.

use std::sync::Arc;

use bicycle::{Geometry, HoldReason, MotionModel, Odometry, SkidSteer, SkidSteerCommand, SkidSteerVehicle};
use navigator::{Belief, Config, Navigator, Setup, Surface};
use scenarios::{RangeSensor, RangeSensorConfig, RockFieldConfig, RockMap, Split, World, rock_field};
use terrain::{BodyBox, Pose};
use traversability::CvarLevel;

use crate::course::ground;

const CYCLE_S: f64 = 0.1;
const STEP_S: f64 = 0.001;
const GRAVITY_MPS2: f64 = 9.81;
const FRICTION: f64 = 0.65;
/// Sliding below this takes less than the whole of friction [m/s].
const CREEP_MPS: f64 = 0.05;
/// What a wheel's speed changes at most in a second [m/s2].
const WHEEL_MPS2: f64 = 4.0;
/// Radius of gyration about the vertical over the length of a box of these proportions.
const GYRATION: f64 = 0.39;
/// Of the track that commands are turned into wheel speeds with over the geometric one, as on Clearpath's vehicles.
const EFFECTIVE_TRACK: f64 = 1.875;

/// Motion of the middle between the axles, in the map frame.
struct Plant<'a> {
    world: &'a World,
    geometry: Geometry,
    position_m: [f64; 2],
    yaw_rad: f64,
    velocity_mps: [f64; 2],
    yaw_rate_radps: f64,
    /// Circumferential speed of the left and of the right wheels [m/s].
    sides_mps: [f64; 2],
}

impl Plant<'_> {
    /// Where the wheels touch the ground, front before rear, left before right, in the body frame [m].
    fn wheels_m(&self) -> [[f64; 2]; 4] {
        let (ahead_m, left_m) = (0.5 * self.geometry.wheelbase_m, 0.5 * self.geometry.track_m);
        [[ahead_m, left_m], [ahead_m, -left_m], [-ahead_m, left_m], [-ahead_m, -left_m]]
    }

    fn turned(&self, [ahead, left]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = self.yaw_rad.sin_cos();
        [ahead * cosine - left * sine, ahead * sine + left * cosine]
    }

    /// Height of the plane through the wheels at the middle [m], and its rise to the front and to the left [-].
    fn plane(&self) -> [f64; 3] {
        let heights_m = self.wheels_m().map(|wheel_m| {
            let [east_m, north_m] = self.turned(wheel_m);
            self.world.height_m(self.position_m[0] + east_m, self.position_m[1] + north_m)
        });
        let [front_left, front_right, rear_left, rear_right] = heights_m;
        let rise = |up: f64, down: f64, length_m: f64| 0.5 * (up - down) / length_m;
        [
            0.25 * heights_m.iter().sum::<f64>(),
            rise(front_left + front_right, rear_left + rear_right, self.geometry.wheelbase_m),
            rise(front_left + rear_left, front_right + rear_right, self.geometry.track_m),
        ]
    }

    /// Pose of the rear axle's centre.
    fn pose(&self) -> Pose {
        let [height_m, ahead, left] = self.plane();
        let half_m = 0.5 * self.geometry.wheelbase_m;
        let [east_m, north_m] = self.turned([-half_m, 0.0]);
        Pose {
            x_m: self.position_m[0] + east_m,
            y_m: self.position_m[1] + north_m,
            z_m: height_m - half_m * ahead + self.geometry.wheel_radius_m,
            roll_rad: left.atan(),
            pitch_rad: -ahead.atan(),
            yaw_rad: self.yaw_rad,
        }
    }

    fn odometry(&self, valid_at_ns: u64) -> Odometry {
        let pose = self.pose();
        let [ahead_mps, left_mps] = self.body_velocity_mps();
        Odometry {
            valid_at_ns,
            position_m: [pose.x_m, pose.y_m, pose.z_m],
            attitude_rad: [pose.roll_rad, pose.pitch_rad, pose.yaw_rad],
            velocity_mps: [ahead_mps, left_mps - 0.5 * self.geometry.wheelbase_m * self.yaw_rate_radps],
            yaw_rate_radps: self.yaw_rate_radps,
            wheel_speed_mps: 0.5 * (self.sides_mps[0] + self.sides_mps[1]),
            steering_rad: 0.0,
        }
    }

    fn body_velocity_mps(&self) -> [f64; 2] {
        let (sine, cosine) = self.yaw_rad.sin_cos();
        let [east, north] = self.velocity_mps;
        [east * cosine + north * sine, north * cosine - east * sine]
    }

    fn advance(&mut self, command: SkidSteerCommand) {
        for _ in 0..(CYCLE_S / STEP_S) as usize {
            self.step(command);
        }
    }

    fn step(&mut self, command: SkidSteerCommand) {
        let half_m = 0.5 * EFFECTIVE_TRACK * self.geometry.track_m * f64::from(command.yaw_rate_radps);
        let asked_mps = [-half_m, half_m].map(|turning_mps| f64::from(command.speed_mps) + turning_mps);
        for (side_mps, asked_mps) in self.sides_mps.iter_mut().zip(asked_mps) {
            *side_mps += (asked_mps - *side_mps).clamp(-WHEEL_MPS2 * STEP_S, WHEEL_MPS2 * STEP_S);
        }
        let [_, ahead, left] = self.plane();
        let upright = 1.0 / (1.0 + ahead * ahead + left * left).sqrt();
        // Per mass: gravity along the slope, then what each wheel's quarter of the load holds.
        let mut push_mps2 = [ahead, left].map(|rise| -GRAVITY_MPS2 * upright * rise);
        let mut twist = 0.0;
        let [ahead_mps, left_mps] = self.body_velocity_mps();
        for [x_m, y_m] in self.wheels_m() {
            let side_mps = self.sides_mps[usize::from(y_m < 0.0)];
            let slip_mps =
                [side_mps - ahead_mps + self.yaw_rate_radps * y_m, -left_mps - self.yaw_rate_radps * x_m];
            let sliding_mps = slip_mps[0].hypot(slip_mps[1]).max(CREEP_MPS);
            let grip_mps2 = 0.25 * FRICTION * GRAVITY_MPS2 * upright / sliding_mps;
            let force = slip_mps.map(|slip_mps| grip_mps2 * slip_mps);
            push_mps2 = [push_mps2[0] + force[0], push_mps2[1] + force[1]];
            twist += x_m * force[1] - y_m * force[0];
        }
        let gyration_m = GYRATION * self.geometry.length_m;
        self.yaw_rate_radps += STEP_S * twist / (gyration_m * gyration_m);
        let [east, north] = self.turned(push_mps2);
        self.velocity_mps = [self.velocity_mps[0] + STEP_S * east, self.velocity_mps[1] + STEP_S * north];
        self.yaw_rad += STEP_S * self.yaw_rate_radps;
        self.position_m = [0, 1].map(|axis| self.position_m[axis] + STEP_S * self.velocity_mps[axis]);
    }
}

/// What a drive came to.
struct Driven {
    is_there: bool,
    time_s: f64,
    /// Largest |roll| and |pitch| [rad].
    tilt_rad: [f64; 2],
    /// Farthest from the straight line between start and goal [m].
    detour_m: f64,
    turned_rad: f64,
}

fn machine() -> SkidSteerVehicle {
    formats::read_skid_steer_vehicle("warthog").unwrap()
}

fn sensor(geometry: &Geometry) -> RangeSensorConfig {
    RangeSensorConfig {
        n_azimuths: 120,
        n_beams: 24,
        elevation_rad: [-0.9, 0.14],
        origin_m: [0.5 * geometry.wheelbase_m, 0.0, 0.7],
        range_m: [0.3, 12.0],
        noise_m: 0.004,
        noise_per_range: 0.002,
        dropout: 0.02,
        class_confusion: 0.01,
        plant_extinction_per_m: 4.0,
        own_body: BodyBox::EMPTY,
    }
}

fn navigator(vehicle: &SkidSteerVehicle, goal_m: [f64; 2]) -> Navigator<SkidSteer> {
    let limits = vehicle.model.motion_limits();
    let mut config = Config::for_geometry(&vehicle.geometry, limits.high[0]);
    config.elevation.resolution_m = 0.2;
    (config.elevation.n_rows, config.elevation.n_cols) = (110, 110);
    (config.risk_map.n_rows, config.risk_map.n_cols, config.risk_map.n_yaws) = (80, 80, 8);
    (config.controller.n_rollouts, config.controller.n_steps) = (256, 30);
    config.controller.sampling.steering_std = 2.0;
    Navigator::new(Setup {
        geometry: &vehicle.geometry,
        model: vehicle.model.clone(),
        config,
        belief: Belief::Physics,
        surface: Surface::Sensed,
        level: CvarLevel::new(0.6).unwrap(),
        seed: 1,
        goal_m,
        tolerance_m: 0.6,
    })
    .unwrap()
}

fn drive(world: World, [x_m, y_m, yaw_rad]: [f64; 3], goal_m: [f64; 2], limit_s: f64) -> Driven {
    let (vehicle, world) = (machine(), Arc::new(world));
    let mut plant = Plant {
        world: &world,
        geometry: vehicle.geometry,
        position_m: [x_m, y_m],
        yaw_rad,
        velocity_mps: [0.0; 2],
        yaw_rate_radps: 0.0,
        sides_mps: [0.0; 2],
    };
    let eyes = RangeSensor::new(sensor(&vehicle.geometry), world.clone(), 1).unwrap();
    let mut navigator = navigator(&vehicle, goal_m);
    let mut driven =
        Driven { is_there: false, time_s: 0.0, tilt_rad: [0.0; 2], detour_m: 0.0, turned_rad: 0.0 };
    let (along, length_m) = ([goal_m[0] - x_m, goal_m[1] - y_m], (goal_m[0] - x_m).hypot(goal_m[1] - y_m));
    let mut last = SkidSteerCommand::default();
    for cycle in 0..(limit_s / CYCLE_S) as u64 {
        let now_ns = cycle * 100_000_000;
        let scan = eyes.scan(&plant.pose(), cycle, now_ns);
        navigator.observe(now_ns, &plant.odometry(now_ns), Some(&scan)).unwrap();
        let decision = navigator.decide(now_ns).unwrap();
        driven.time_s = cycle as f64 * CYCLE_S;
        driven.is_there = decision == bicycle::Decision::Hold(HoldReason::AtGoal);
        if driven.is_there {
            break;
        }
        last = decision.command(last);
        plant.advance(last);
        let pose = plant.pose();
        driven.tilt_rad =
            [driven.tilt_rad[0].max(pose.roll_rad.abs()), driven.tilt_rad[1].max(pose.pitch_rad.abs())];
        let aside_m = (along[0] * (pose.y_m - y_m) - along[1] * (pose.x_m - x_m)) / length_m;
        driven.detour_m = driven.detour_m.max(aside_m.abs());
        driven.turned_rad += (plant.yaw_rate_radps * CYCLE_S).abs();
    }
    driven
}

/// The plant itself: held by friction on a slope that friction holds, sliding on a steeper one.
#[test]
fn the_plant_stands_where_friction_holds_it() {
    for (slope, holds) in [(0.5, true), (0.8, false)] {
        let world = ground(|x_m, _| slope * x_m, |_, _| false);
        let mut plant = Plant {
            world: &world,
            geometry: machine().geometry,
            position_m: [12.0, 0.0],
            yaw_rad: 0.3,
            velocity_mps: [0.0; 2],
            yaw_rate_radps: 0.0,
            sides_mps: [0.0; 2],
        };
        (0..10).for_each(|_| plant.advance(SkidSteerCommand::default()));
        // Creeping below CREEP_MPS is what the law holds with.
        let slid_m = 12.0 - plant.position_m[0];
        assert_eq!(slid_m < CREEP_MPS, holds, "slope {slope}: {slid_m} m");
    }
}

/// Wheels that scrub sideways let a skid-steered machine turn by less than they say, and by nothing else than that.
#[test]
fn the_plant_turns_by_less_than_its_wheels_say() {
    let world = ground(|_, _| 0.0, |_, _| false);
    let mut plant = Plant {
        world: &world,
        geometry: machine().geometry,
        position_m: [12.0, 0.0],
        yaw_rad: 0.0,
        velocity_mps: [0.0; 2],
        yaw_rate_radps: 0.0,
        sides_mps: [0.0; 2],
    };
    let command = SkidSteerCommand { speed_mps: 0.0, yaw_rate_radps: 1.0 };
    (0..30).for_each(|_| plant.advance(command));
    let wheels_radps = (plant.sides_mps[1] - plant.sides_mps[0]) / plant.geometry.track_m;
    assert!((wheels_radps - EFFECTIVE_TRACK).abs() < 1e-9);
    let share = plant.yaw_rate_radps / wheels_radps;
    assert!((0.3..0.99).contains(&share), "{share}");
    assert!((plant.position_m[0] - 12.0).hypot(plant.position_m[1]) < 1e-6);
}

#[test]
fn a_goal_behind_a_skid_steered_vehicle_is_turned_to_and_reached() {
    let driven = drive(ground(|_, _| 0.0, |_, _| false), [12.0, 0.0, 0.0], [6.0, 0.0], 20.0);
    assert!(driven.is_there, "{} s", driven.time_s);
    // 6 m less half a metre at up to 2 m/s, and half a turn at up to 1.2 rad/s; or backwards at up to 1 m/s.
    assert!((3.0..14.0).contains(&driven.time_s), "{} s", driven.time_s);
}

#[test]
fn a_skid_steered_vehicle_drives_the_rock_field() {
    for seed in [3, 4] {
        let (start, goal_m) = ([6.0, 12.0, 0.0], [16.0, 12.0]);
        let config = RockFieldConfig {
            side_m: 24.0,
            resolution_m: 0.2,
            pad_radius_m: 2.0,
            ..RockFieldConfig::default()
        };
        let map = RockMap { seed, split: Split::Train, index: 0 };
        let world = rock_field(&config, map, &[[start[0], start[1]], goal_m]).unwrap();
        let driven = drive(world, start, goal_m, 30.0);
        let limits = machine().model.motion_limits();
        assert!(driven.is_there, "seed {seed}: {} s", driven.time_s);
        let [roll_rad, pitch_rad] = driven.tilt_rad;
        assert!(roll_rad < limits.roll_max_rad && pitch_rad < limits.pitch_max_rad, "{roll_rad} {pitch_rad}");
        assert!(roll_rad.max(pitch_rad) > 0.02, "rocks were driven over");
    }
}

/// A wall 6 m long across the way: it is seen, and driven around.
#[test]
fn a_skid_steered_vehicle_drives_around_a_wall() {
    let is_wall = |x_m: f64, y_m: f64| (11.0..11.6).contains(&x_m) && (-4.0..2.0).contains(&y_m);
    let driven = drive(ground(|_, _| 0.0, is_wall), [5.0, 0.0, 0.0], [17.0, 0.0], 40.0);
    assert!(driven.is_there, "{} s", driven.time_s);
    // Half of its width beside the end of the wall.
    assert!(driven.detour_m > 2.0 + 0.5 * machine().geometry.width_m - 0.3, "{} m", driven.detour_m);
    assert!(driven.turned_rad > 0.5, "{}", driven.turned_rad);
}
