//! Somebody who varies speed and curvature at random on open ground, as the paper gathers its data: thirty minutes, up to
//! 3 m/s and 1.35 1/m to either side.

use std::sync::Arc;

use bicycle::Vehicle;
use kinodynamics::{RecordedRun, Recording, Tick};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use scenarios::{seed_of, stream};

use super::KinodynamicsError;
use super::machine::{Machine, TICK_S};
use super::surfaces::{Coefficients, Layout, SURFACES};

/// Fastest command [m/s].
const SPEED_MAX_MPS: f64 = 3.0;
/// Tightest command [1/m].
pub(super) const CURVATURE_MAX_PER_M: f64 = 1.35;
/// Fastest changes of the stick [m/s2, 1/(m s)].
const SPEED_RATE_MPS2: f64 = 3.0;
const CURVATURE_RATE_PER_MS: f64 = 4.0;
/// Half of the ground's edge, and where the driver turns back [m].
const GROUND_M: f64 = 9.0;
const TURN_BACK_M: f64 = 5.5;
/// Length of a run [s].
const RUN_S: f64 = 60.0;

/// What to gather.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teleoperation {
    /// Minutes in all; every minute is a run on ground of its own.
    pub minutes: u32,
    /// One surface alone instead of all in patches.
    pub only: Option<usize>,
    /// Decides ground, commands and noise.
    pub seed: u64,
}

/// Drives; `on_run` is told every minute.
///
/// # Errors
/// A vehicle that cannot be.
pub fn teleoperate(
    vehicle: &Vehicle,
    asked: &Teleoperation,
    on_run: &(dyn Fn() + Sync),
) -> Result<Recording, KinodynamicsError> {
    teleoperate_knowing(vehicle, asked, on_run).map(|(recording, _)| recording)
}

/// The same with what the ground under the wheels was at every command of every run.
pub(super) fn teleoperate_knowing(
    vehicle: &Vehicle,
    asked: &Teleoperation,
    on_run: &(dyn Fn() + Sync),
) -> Result<(Recording, Vec<Vec<Coefficients>>), KinodynamicsError> {
    let runs = (0..asked.minutes).into_par_iter().map(|minute| {
        let run = drive(vehicle, asked, minute);
        on_run();
        run
    });
    let (runs, coefficients) = runs.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let grounds = SURFACES.iter().map(|surface| surface.name.to_owned()).collect();
    Ok((Recording { vehicle: vehicle.into(), tick_s: TICK_S, grounds, runs }, coefficients))
}

type KnownRun = (RecordedRun, Vec<Coefficients>);

fn drive(vehicle: &Vehicle, asked: &Teleoperation, minute: u32) -> Result<KnownRun, KinodynamicsError> {
    let seed = seed_of(asked.seed, &[0x7E1E, u64::from(minute)]);
    let layout = asked.only.map_or(Layout::Patches { seed }, Layout::One);
    let world = Arc::new(layout.world([-GROUND_M; 2], [GROUND_M; 2])?);
    let mut rng = stream(seed, &[1]);
    let mut machine = Machine::new(vehicle, world, [0.0, 0.0, rng.random_range(-3.1..3.1)], seed)?;
    let mut stick = Stick::default();
    let (mut run, mut coefficients) = KnownRun::default();
    for _ in 0..(RUN_S / TICK_S) as usize {
        if machine.plant().rolled_over() || machine.plant().left_world() {
            break;
        }
        let odometry = machine.measure();
        let pose = machine.plant().pose();
        let [speed_mps, curvature_per_m] = stick.next([pose.x_m, pose.y_m, pose.yaw_rad], &mut rng);
        run.ticks.push(Tick {
            time_ns: machine.now_ns(),
            speed_mps: speed_mps as f32,
            curvature_per_m: curvature_per_m as f32,
            wheel_speed_mps: odometry.wheel_speed_mps as f32,
            yaw_rate_radps: odometry.yaw_rate_radps as f32,
            ground: layout.surface_at(pose.x_m, pose.y_m),
        });
        coefficients.push(layout.coefficients_under(machine.plant()));
        machine.drive([speed_mps as f32, curvature_per_m as f32], |_| {})?;
        run.imu.extend_from_slice(machine.samples());
    }
    Ok((run, coefficients))
}

/// Where the driver holds the stick, and where it is going.
#[derive(Default)]
struct Stick {
    held: [f64; 2],
    aim: [f64; 2],
    left_s: [f64; 2],
}

impl Stick {
    /// Speed and curvature of the next tick: new aims now and then, and back towards the middle near the edge.
    fn next(&mut self, [x_m, y_m, yaw_rad]: [f64; 3], rng: &mut Xoshiro256PlusPlus) -> [f64; 2] {
        if self.left_s[0] <= 0.0 {
            (self.aim[0], self.left_s[0]) =
                (rng.random_range(0.0..SPEED_MAX_MPS), rng.random_range(1.0..3.0));
        }
        if self.left_s[1] <= 0.0 {
            (self.aim[1], self.left_s[1]) =
                (rng.random_range(-CURVATURE_MAX_PER_M..CURVATURE_MAX_PER_M), rng.random_range(0.5..2.0));
        }
        self.left_s = self.left_s.map(|left_s| left_s - TICK_S);
        let mut aim = self.aim;
        if x_m.abs().max(y_m.abs()) > TURN_BACK_M {
            let off_rad = (-y_m).atan2(-x_m) - yaw_rad;
            let off_rad = off_rad.sin().atan2(off_rad.cos());
            aim = [aim[0].clamp(0.8, 1.6), off_rad.clamp(-1.0, 1.0)];
        }
        for (axis, rate) in [SPEED_RATE_MPS2, CURVATURE_RATE_PER_MS].into_iter().enumerate() {
            let most = rate * TICK_S;
            self.held[axis] += (aim[axis] - self.held[axis]).clamp(-most, most);
        }
        self.held
    }
}
