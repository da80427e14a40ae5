//! Drives of the plant over painted worlds, as a vehicle records them, and as they truly went.

use std::f64::consts::PI;
use std::sync::Arc;

use bicycle::{ImuSample, Vehicle};
use friction::{Chassis, Lesson, Moment, Recording, STEPS, State, View, wheels_m};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::{
    Imu, ImuConfig, Looks, OdometryConfig, OdometrySensor, PaintedConfig, PaintedWorld, Plant, painted_world,
    stream,
};

use super::super::FrictionBenchError;
use super::super::drive::{Driver, LOG_HZ, RUN_UP_S};

/// Edge of a pixel and length of a world's side [m].
pub(super) const PIXEL_M: f64 = 0.5;
const SIDE_M: f64 = 180.0;
/// The shortest drive that counts [s].
const DRIVE_MIN_S: f64 = 20.0;
const ATTEMPTS: u64 = 20;
/// Of ten spells of ten seconds, so many are driven hard.
const AGGRESSIVE_SPELLS: u64 = 7;
const SPELL_S: f64 = 10.0;

/// What sensors and descriptions err by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Domain {
    /// By nothing, as in the paper's simulator.
    Exact,
    /// Biased inertial unit, noisy wheel speeds and localisation, and what is wrong with a machine in all of its drives.
    Biased(Machine),
}

/// What descriptions and sensors of a machine say over what is [-].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Machine {
    pub inertia_factor: f64,
    pub wheel_scale: f64,
}

impl Machine {
    /// Inertia off by 30 %, wheel speed by 3 %, either way.
    pub(super) fn drawn(which: u64) -> Self {
        let mut rng = stream(which, &[0x1E7]);
        let mut either = |by: f64| if rng.random_bool(0.5) { 1.0 + by } else { 1.0 - by };
        Self { inertia_factor: either(0.3), wheel_scale: either(0.03) }
    }
}

/// Which drive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    pub seed: u64,
    pub looks: Looks,
    pub domain: Domain,
    pub duration_s: f64,
}

/// A recorded drive and the truth about it.
pub(super) struct SeenDrive {
    /// As recorded; without classes where nobody knows them.
    pub lesson: Lesson,
    /// States at the end of each step of each window, as they truly were.
    pub truth: Vec<Vec<State>>,
    /// Ground that most of each window lies on.
    pub grounds: Vec<u8>,
    /// The plant's own coefficients by pixel.
    pub coefficients: Vec<[f32; 4]>,
    /// True class by pixel.
    pub classes: Vec<u8>,
}

/// A drive, its windows numbered as those of recording `index`.
pub(super) fn seen_drive(vehicle: &Vehicle, job: Job, index: usize) -> Result<SeenDrive, FrictionBenchError> {
    let Job { seed, looks, domain, duration_s } = job;
    let painted = painted_world(&PaintedConfig { seed, looks, side_m: SIDE_M, cell_m: PIXEL_M })?;
    let mut rng = stream(seed, &[0x5EE4]);
    let mut vehicle = vehicle.clone();
    let fast_mps = (rng.random_range(2.0..3.5) * 9.81 * vehicle.geometry.wheelbase_m).sqrt();
    vehicle.limits.speed_max_mps = vehicle.limits.speed_max_mps.max(fast_mps);
    let world = Arc::new(painted.world.clone());
    for attempt in 0..ATTEMPTS {
        let mut rng = stream(seed, &[0x5EE5, attempt]);
        let start = [(); 2].map(|()| 40.0 * rng.random_range(-1.0..1.0));
        let start = [start[0], start[1], rng.random_range(-PI..PI)];
        let plant = Plant::new(&vehicle, Arc::clone(&world), start)?;
        let driver = Driver::new(&vehicle, fast_mps, 0.5 * SIDE_M, stream(seed, &[0x5EE6, attempt]));
        let length_m = vehicle.geometry.length_m;
        let mut run =
            Run { plant, driver, sensors: Sensors::new(domain, length_m, seed), moments: Vec::new() };
        run.drive(&world, duration_s)?;
        if run.moments.len() as f64 >= DRIVE_MIN_S * LOG_HZ {
            return Ok(put_together(&vehicle, &painted, run.moments, job, index));
        }
    }
    Err(FrictionBenchError::NoDrive { vehicle: vehicle.name, seed })
}

fn put_together(
    vehicle: &Vehicle,
    painted: &PaintedWorld,
    moments: Vec<[Moment; 2]>,
    job: Job,
    index: usize,
) -> SeenDrive {
    let chassis = Chassis::of(vehicle);
    let classes = painted.grounds.values().to_vec();
    let [exact, measured] = [0, 1].map(|which| moments.iter().map(|both| both[which]).collect());
    let told = (job.domain == Domain::Exact).then(|| classes.clone());
    let exact = Recording { view: view(painted), classes: None, moments: exact };
    let recording = Recording { view: exact.view.clone(), classes: told, moments: measured };
    let mut described = chassis.clone();
    if let Domain::Biased(machine) = job.domain {
        described.yaw_inertia_kgm2 *= machine.inertia_factor;
    }
    let lesson = Lesson::new(described, recording, index);
    let truth: Vec<Vec<State>> =
        lesson.windows.iter().map(|window| exact.window(&chassis, index, window.first).truth).collect();
    let grounds = truth.iter().map(|states| most_of(states, &chassis, &exact.view, &classes)).collect();
    let own = |patch: &scenarios::Patch| {
        let friction = patch.friction;
        [
            friction.static_friction,
            friction.dynamic_friction,
            friction.viscous_friction,
            friction.stribeck_speed_mps,
        ]
    };
    let coefficients = painted.world.patches.values().iter().map(own).collect();
    SeenDrive { lesson, truth, grounds, coefficients, classes }
}

/// The picture of a world.
pub(super) fn view(painted: &PaintedWorld) -> View {
    let geometry = painted.world.geometry();
    let colours = painted.colours.values();
    let channel = |which: usize| colours.iter().map(move |colour| colour[which]);
    let values = (0..3).flat_map(channel).chain(painted.seen_heights_m.values().iter().copied()).collect();
    View {
        resolution_m: geometry.resolution_m,
        south_west_m: geometry.south_west_m(),
        n_rows: geometry.n_rows,
        n_cols: geometry.n_cols,
        values,
    }
}

fn most_of(states: &[State], chassis: &Chassis, view: &View, classes: &[u8]) -> u8 {
    let mut counts = [0; 7];
    for state in &states[..STEPS] {
        for at_m in wheels_m(chassis, state) {
            let [row, col] = view.pixel(at_m);
            counts[usize::from(classes[row * view.n_cols + col])] += 1;
        }
    }
    let most = counts.iter().enumerate().max_by_key(|(_, count)| **count);
    most.map_or(0, |(ground, _)| ground as u8)
}

/// What measures, and errs.
struct Sensors {
    domain: Domain,
    imu: Imu,
    odometry: OdometrySensor,
    rng: Xoshiro256PlusPlus,
}

impl Sensors {
    fn new(domain: Domain, length_m: f64, seed: u64) -> Self {
        let (imu, odometry) = match domain {
            Domain::Exact => {
                let none = ImuConfig {
                    acceleration_noise_mps2: 0.0,
                    rate_noise_radps: 0.0,
                    acceleration_bias_mps2: 0.0,
                    rate_bias_radps: 0.0,
                    vibration_per_m_s: 0.0,
                    ..ImuConfig::for_length(length_m)
                };
                (none, OdometryConfig::PERFECT)
            }
            Domain::Biased(_) => {
                let biased = ImuConfig {
                    acceleration_bias_mps2: 0.3,
                    rate_bias_radps: 0.01,
                    ..ImuConfig::for_length(length_m)
                };
                (biased, OdometryConfig::for_length(length_m))
            }
        };
        Self {
            domain,
            imu: Imu::new(imu, seed),
            odometry: OdometrySensor::new(odometry, seed),
            rng: stream(seed, &[0x5E45]),
        }
    }

    fn edges_mps(&mut self, edges_mps: [f64; 4]) -> [f64; 4] {
        match self.domain {
            Domain::Exact => edges_mps,
            Domain::Biased(machine) => edges_mps.map(|edge_mps| {
                machine.wheel_scale * edge_mps + 0.15 * self.rng.sample::<f64, _>(StandardNormal)
            }),
        }
    }
}

/// A drive under way; moments are true and measured.
struct Run {
    plant: Plant,
    driver: Driver,
    sensors: Sensors,
    moments: Vec<[Moment; 2]>,
}

impl Run {
    fn drive(&mut self, world: &scenarios::World, duration_s: f64) -> Result<(), FrictionBenchError> {
        let n_before = (RUN_UP_S * LOG_HZ) as u64;
        for cycle in 0..n_before + (duration_s * LOG_HZ) as u64 {
            let time_s = cycle as f64 / LOG_HZ;
            let is_aggressive = (time_s / SPELL_S) as u64 % 10 < AGGRESSIVE_SPELLS;
            let command = self.driver.command(time_s, &self.plant.pose(), is_aggressive);
            self.plant.set_command(command)?;
            let mut felt = [0.0; 3];
            for part in 1..=4 {
                self.plant.advance(0.25 / LOG_HZ);
                let at_ns = ((time_s + 5e-3 * f64::from(part)) * 1e9) as u64;
                let sample: ImuSample = self.sensors.imu.sample(&self.plant.motion(), world, at_ns);
                felt[0] += 0.25 * f64::from(sample.acceleration_mps2[0]);
                felt[1] += 0.25 * f64::from(sample.acceleration_mps2[1]);
                felt[2] += 0.25 * f64::from(sample.angular_rate_radps[2]);
            }
            if self.plant.rolled_over() || self.plant.left_world() || !self.plant.is_finite() {
                break;
            }
            if cycle >= n_before {
                self.record(time_s, felt);
            }
        }
        Ok(())
    }

    fn record(&mut self, time_s: f64, felt: [f64; 3]) {
        let motion = self.plant.motion();
        let edge_mps = self.plant.wheels().map(|wheel| wheel.speed_mps);
        let last_rad = self.moments.last().map_or(motion.pose.yaw_rad, |both| both[0].yaw_rad);
        let turned_rad = (motion.pose.yaw_rad - last_rad + PI).rem_euclid(2.0 * PI) - PI;
        let exact = Moment {
            time_s,
            at_m: [motion.pose.x_m, motion.pose.y_m],
            yaw_rad: last_rad + turned_rad,
            velocity_mps: [motion.velocity_mps[0], motion.velocity_mps[1]],
            yaw_radps: motion.angular_rate_radps[2],
            edge_mps,
            steering_rad: motion.steering_rad,
            felt,
        };
        let told = self.sensors.odometry.measure(&motion, (time_s * 1e9) as u64);
        let measured = Moment {
            at_m: [told.position_m[0], told.position_m[1]],
            yaw_rad: exact.yaw_rad + told.attitude_rad[2] - motion.pose.yaw_rad,
            velocity_mps: told.velocity_mps,
            yaw_radps: told.yaw_rate_radps,
            edge_mps: self.sensors.edges_mps(edge_mps),
            steering_rad: told.steering_rad,
            ..exact
        };
        self.moments.push([exact, measured]);
    }
}
