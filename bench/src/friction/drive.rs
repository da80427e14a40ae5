//! Drives of the plant over grounds whose friction only the plant knows.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bicycle::{Column, Command, DriveLog, DriveRow, Vehicle};
use friction::FrictionCurve;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::{
    GroundKind, Imu, ImuConfig, OdometryConfig, OdometrySensor, Patch, Plant, Stribeck, World,
    steady_friction, stream,
};
use terrain::{GridGeometry, Pose};

use super::FrictionBenchError;

/// Length of a drive [s], and the shortest that counts where one ends on its roof or off the map.
const DRIVE_S: f64 = 120.0;
const DRIVE_MIN_S: f64 = 40.0;
/// Rows a second [Hz], and driving before the first.
pub(super) const LOG_HZ: f64 = 50.0;
pub(super) const RUN_UP_S: f64 = 2.0;
/// Starts of a drive, at most.
const ATTEMPTS: u64 = 20;
/// Width of a stripe of one ground and half of the side of the world, over the wheelbase.
const STRIPE_WHEELBASES: f64 = 20.0;
const HALF_SIDE_WHEELBASES: f64 = 90.0;
/// Steepest slope of the ground [-].
const SLOPE: f64 = 0.04;
/// A wheel that uses this share of what its ground holds is at its limit.
const LIMIT_SHARE: f64 = 0.92;
/// What friction is multiplied with, so that no published number is the answer.
const SCALES: std::ops::Range<f64> = 0.6..1.4;
/// Grounds of a drive that are driven hard.
const AGGRESSIVE_SHARE: f64 = 0.65;

/// One ground of a drive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    /// Its class.
    pub name: &'static str,
    pub published: FrictionCurve,
    pub stribeck: Stribeck,
    pub is_aggressive: bool,
    /// Friction at a sliding speed of 1 m/s on the plant's test bench [-].
    pub friction: f64,
    /// The most at any speed of sliding up to that [-].
    pub most_friction: f64,
    /// Time that an axle was at its limit, by the plant's forces [s].
    pub at_limit_s: f64,
}

/// What a vehicle recorded, and what nobody told it.
pub(super) struct TestDrive {
    pub log: DriveLog,
    /// Index of the ground under the vehicle, by row.
    pub classes: Vec<usize>,
    pub grounds: [Ground; 3],
    /// As whoever seeks friction knows it: its inertia is wrong.
    pub described: Vehicle,
}

/// Three grounds, each with a friction of its own, and how hard each is driven.
fn grounds(vehicle: &Vehicle, rng: &mut Xoshiro256PlusPlus) -> [Ground; 3] {
    let plant = GroundKind::ALL.map(GroundKind::friction);
    let mut left: Vec<usize> = (0..plant.len()).collect();
    std::array::from_fn(|_| {
        let kind = left.swap_remove(rng.random_range(0..left.len()));
        let (name, published) = FrictionCurve::PUBLISHED[kind];
        let stribeck = plant[kind].scaled(rng.random_range(SCALES) as f32);
        let at = |sliding_mps: f64| steady_friction(vehicle, stribeck, 0.05, [0.0, sliding_mps])[1].abs();
        let friction = at(1.0);
        let most_friction = [0.05, 0.1, 0.2, 0.35, 0.5, 0.75].map(at).into_iter().fold(friction, f64::max);
        let is_aggressive = rng.random_bool(AGGRESSIVE_SHARE);
        Ground { name, published, stribeck, is_aggressive, friction, most_friction, at_limit_s: 0.0 }
    })
}

impl Ground {
    /// Friction of the whole ground at a speed of sliding, on the plant's test bench [-].
    pub(super) fn at(&self, vehicle: &Vehicle, sliding_mps: f64) -> f64 {
        steady_friction(vehicle, self.stribeck, 0.05, [0.0, sliding_mps])[1].abs()
    }
}

fn class_at(x_m: f64, wheelbase_m: f64) -> usize {
    ((x_m / (STRIPE_WHEELBASES * wheelbase_m)).floor() as i64).rem_euclid(3) as usize
}

/// Stripes of three grounds over gentle waves.
fn world(grounds: &[Ground; 3], wheelbase_m: f64) -> Result<World, FrictionBenchError> {
    let cell_m = 0.5 * wheelbase_m;
    let n = (2.0 * HALF_SIDE_WHEELBASES * wheelbase_m / cell_m) as usize;
    let geometry = GridGeometry::centred(cell_m, n, n, 0.0, 0.0);
    let per_m = TAU / (40.0 * wheelbase_m);
    let height_m = |x_m: f64, y_m: f64| SLOPE / per_m * (per_m * x_m).sin() * (per_m * y_m).cos();
    let patch = |x_m: f64, _: f64| Patch::open(grounds[class_at(x_m, wheelbase_m)].stribeck);
    Ok(World::from_fn("stripes", geometry, height_m, patch)?)
}

/// Somebody who drives each ground hard or gently and knows the friction of none.
pub(super) struct Driver {
    rng: Xoshiro256PlusPlus,
    fast_mps: f64,
    /// What the vehicle stands before it tips [m/s2].
    tipping_mps2: f64,
    wheelbase_m: f64,
    half_side_m: f64,
    steering_max_rad: f64,
    speed_mps: f64,
    wanted_mps: f64,
    lateral_mps2: f64,
    sway: [f64; 2],
    until_s: f64,
    is_returning: bool,
}

impl Driver {
    /// On a square of ground of half a side around the origin.
    pub(super) fn new(vehicle: &Vehicle, fast_mps: f64, half_side_m: f64, rng: Xoshiro256PlusPlus) -> Self {
        let height_m = vehicle.body.cog_height_m;
        Self {
            rng,
            fast_mps,
            tipping_mps2: 9.81 * vehicle.geometry.track_m / (2.0 * height_m),
            wheelbase_m: vehicle.geometry.wheelbase_m,
            half_side_m,
            steering_max_rad: vehicle.limits.steering_max_rad,
            speed_mps: 0.0,
            wanted_mps: 0.5 * fast_mps,
            lateral_mps2: 0.0,
            sway: [0.0; 2],
            until_s: 0.0,
            is_returning: false,
        }
    }

    fn change(&mut self, time_s: f64, is_aggressive: bool) {
        let rng = &mut self.rng;
        let (share, held_s, speeds) =
            if is_aggressive { (0.35..0.8, 1.0..3.0, 0.3..1.0) } else { (0.02..0.12, 3.0..6.0, 0.4..0.7) };
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        self.lateral_mps2 = side * rng.random_range(share) * self.tipping_mps2;
        self.wanted_mps = rng.random_range(speeds) * self.fast_mps;
        // Now and then as hard on the brakes as they go.
        if is_aggressive && rng.random_bool(0.2) {
            self.wanted_mps = 0.05 * self.fast_mps;
            self.lateral_mps2 *= 0.1;
        }
        let sway = if is_aggressive { 0.3 } else { 0.1 };
        self.sway = [sway * rng.random_range(0.0..1.0), TAU * rng.random_range(0.2..0.8)];
        self.until_s = time_s + rng.random_range(held_s);
    }

    pub(super) fn command(&mut self, time_s: f64, pose: &Pose, is_aggressive: bool) -> Command {
        let most_mps2 = if is_aggressive { 0.8 } else { 0.12 } * self.tipping_mps2;
        if time_s >= self.until_s || self.lateral_mps2.abs() > most_mps2 {
            self.change(time_s, is_aggressive);
        }
        let step_mps = if is_aggressive { f64::INFINITY } else { 0.05 * 9.81 / LOG_HZ };
        self.speed_mps += (self.wanted_mps - self.speed_mps).clamp(-step_mps, step_mps);
        let fast_mps = self.speed_mps.max(0.3 * self.fast_mps);
        let angle_rad = |lateral_mps2: f64| (lateral_mps2 * self.wheelbase_m / (fast_mps * fast_mps)).atan();
        let distance_share = pose.x_m.hypot(pose.y_m) / self.half_side_m;
        self.is_returning = distance_share > if self.is_returning { 0.35 } else { 0.5 };
        let wanted_rad = if self.is_returning {
            let error_rad = (-pose.y_m).atan2(-pose.x_m) - pose.yaw_rad;
            let most_rad = angle_rad(most_mps2.min(0.6 * self.tipping_mps2));
            (1.2 * ((error_rad + PI).rem_euclid(TAU) - PI)).clamp(-most_rad, most_rad)
        } else {
            let [sway, radps] = self.sway;
            angle_rad(self.lateral_mps2 * (1.0 + sway * (radps * time_s).sin()))
        };
        let steering_rad = wanted_rad.clamp(-self.steering_max_rad, self.steering_max_rad);
        Command { speed_mps: self.speed_mps as f32, steering_rad: steering_rad as f32 }
    }
}

/// The drive of a seed.
pub(super) fn test_drive(shipped: &Vehicle, seed: u64) -> Result<TestDrive, FrictionBenchError> {
    let mut rng = stream(seed, &[0xF41C]);
    let mut vehicle = shipped.clone();
    let wheelbase_m = vehicle.geometry.wheelbase_m;
    // By Froude's number, so that machines of every size slide alike.
    let fast_mps = (rng.random_range(2.0..3.5) * 9.81 * wheelbase_m).sqrt();
    vehicle.limits.speed_max_mps = vehicle.limits.speed_max_mps.max(fast_mps);
    let grounds = grounds(&vehicle, &mut rng);
    let world = Arc::new(world(&grounds, wheelbase_m)?);
    let mut described = vehicle.clone();
    described.body.inertia_kgm2[2] *= rng.random_range(0.7..1.3);
    let wheel_scale = rng.random_range(0.98..1.02);
    for attempt in 0..ATTEMPTS {
        let driver = Driver::new(
            &vehicle,
            fast_mps,
            HALF_SIDE_WHEELBASES * wheelbase_m,
            stream(seed, &[0xD21F, attempt]),
        );
        let mut run = Run::begin(&vehicle, &world, grounds, driver, seed ^ (attempt << 32))?;
        run.drive(wheel_scale)?;
        if run.log.n_rows() as f64 >= DRIVE_MIN_S * LOG_HZ {
            return Ok(TestDrive { log: run.log, classes: run.classes, grounds: run.grounds, described });
        }
    }
    Err(FrictionBenchError::NoDrive { vehicle: vehicle.name, seed })
}

/// A drive under way.
struct Run {
    plant: Plant,
    world: Arc<World>,
    driver: Driver,
    odometry: OdometrySensor,
    imu: Imu,
    load_sensitivity: f64,
    mean_load_n: f64,
    wheelbase_m: f64,
    grounds: [Ground; 3],
    log: DriveLog,
    classes: Vec<usize>,
}

impl Run {
    fn begin(
        vehicle: &Vehicle,
        world: &Arc<World>,
        grounds: [Ground; 3],
        mut driver: Driver,
        seed: u64,
    ) -> Result<Self, FrictionBenchError> {
        let wheelbase_m = vehicle.geometry.wheelbase_m;
        let mut place_m = || 20.0 * wheelbase_m * driver.rng.random_range(-1.0..1.0);
        let [x_m, y_m] = [place_m(), place_m()];
        let start = [x_m, y_m, driver.rng.random_range(-PI..PI)];
        let length_m = vehicle.geometry.length_m;
        let mass_kg = vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg;
        Ok(Self {
            plant: Plant::new(vehicle, Arc::clone(world), start)?,
            world: Arc::clone(world),
            driver,
            odometry: OdometrySensor::new(OdometryConfig::for_length(length_m), seed),
            imu: Imu::new(ImuConfig::for_length(length_m), seed),
            load_sensitivity: vehicle.tyre.load_sensitivity,
            mean_load_n: 0.25 * mass_kg * 9.81,
            wheelbase_m,
            grounds,
            log: DriveLog::default(),
            classes: Vec::new(),
        })
    }

    /// To the end, or until the vehicle lies on its side or leaves the map; what came right before is not kept.
    fn drive(&mut self, wheel_scale: f64) -> Result<(), FrictionBenchError> {
        let n_before = (RUN_UP_S * LOG_HZ) as u64;
        for cycle in 0..n_before + (DRIVE_S * LOG_HZ) as u64 {
            let time_s = cycle as f64 / LOG_HZ;
            let pose = self.plant.pose();
            let class = class_at(pose.x_m, self.wheelbase_m);
            let command = self.driver.command(time_s, &pose, self.grounds[class].is_aggressive);
            self.plant.set_command(command)?;
            let force_mps2 = self.advance(time_s);
            if self.plant.rolled_over() || self.plant.left_world() || !self.plant.is_finite() {
                break;
            }
            if cycle >= n_before {
                self.record(time_s, wheel_scale, force_mps2)?;
            }
        }
        Ok(())
    }

    /// A period, and the mean of what the inertial unit felt.
    fn advance(&mut self, time_s: f64) -> [f64; 2] {
        let n_samples = 4;
        let mut sum_mps2 = [0.0; 2];
        for index in 0..n_samples {
            self.plant.advance(1.0 / LOG_HZ / f64::from(n_samples));
            let at_ns = ((time_s + f64::from(index + 1) * 5e-3) * 1e9) as u64;
            let felt = self.imu.sample(&self.plant.motion(), &self.world, at_ns);
            for (sum, felt) in sum_mps2.iter_mut().zip(felt.acceleration_mps2) {
                *sum += f64::from(felt) / f64::from(n_samples);
            }
        }
        sum_mps2
    }

    fn record(
        &mut self,
        time_s: f64,
        wheel_scale: f64,
        force_mps2: [f64; 2],
    ) -> Result<(), FrictionBenchError> {
        let motion = self.plant.motion();
        let mut measured = self.odometry.measure(&motion, (time_s * 1e9) as u64);
        measured.wheel_speed_mps *= wheel_scale;
        let row = DriveRow::new(time_s)
            .with_odometry(&measured)
            .with(Column::Ax, force_mps2[0])
            .with(Column::Ay, force_mps2[1]);
        self.log.push("", &row)?;
        let class = class_at(motion.pose.x_m, self.wheelbase_m);
        self.classes.push(class);
        let friction = self.grounds[class].friction;
        if self.is_at_limit(friction) {
            self.grounds[class].at_limit_s += 1.0 / LOG_HZ;
        }
        Ok(())
    }

    /// Whether both wheels of an axle slide, by the ground's forces on them.
    fn is_at_limit(&self, friction: f64) -> bool {
        let uses = self.plant.wheels().map(|wheel| {
            let Some([x_m, y_m, _]) = wheel.contact_m else { return 0.0 };
            let force_n = nalgebra::Vector3::from(wheel.force_n);
            let along_n =
                (force_n.norm_squared() - force_n.dot(&self.world.normal(x_m, y_m)).powi(2)).max(0.0);
            let loaded = 1.0 - self.load_sensitivity * (wheel.load_n / self.mean_load_n - 1.0);
            along_n.sqrt() / (wheel.load_n.max(1e-3) * friction * loaded)
        });
        uses.chunks(2).any(|axle| axle[0].min(axle[1]) > LIMIT_SHARE)
    }
}
