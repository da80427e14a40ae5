//! A vehicle of its own: single-track dynamics with linear tyres by Runge and Kutta, a steering servo behind a queue, a
//! speed controller, sensors with noise. Nothing of the catalogue is in it.

use bicycle::{Column, Command, DriveLog, DriveRow};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

pub const WHEELBASE_M: f64 = 2.0;
const COG_AHEAD_M: f64 = 1.1;
const MASS_KG: f64 = 500.0;
const YAW_INERTIA_KGM2: f64 = 450.0;
const CORNERING_STIFFNESS_N: [f64; 2] = [42e3, 46e3];
const SERVO_S: f64 = 0.07;
const SPEED_GAIN: f64 = 2.2;
const ACCELERATION_MAX: f64 = 3.0;
/// Rows of a log and steps of the integration [s].
pub const ROW_S: f64 = 0.02;
const STEPS_PER_ROW: usize = 10;

/// What is wrong with a vehicle; the neutral one is nothing.
#[derive(Clone, Copy, Debug)]
pub struct Wrong {
    /// Angle of the wheels over the commanded one, to the left and to the right.
    pub ratio: [f64; 2],
    /// Age of the steering command when the servo gets it [rows].
    pub queue: usize,
}

pub const NOTHING: Wrong = Wrong { ratio: [1.0, 1.0], queue: 0 };

/// East, north of the rear axle, yaw, forward speed, leftward speed of the centre of gravity, yaw rate, wheel angle.
type State = [f64; 7];

fn rates(state: &State, speed_asked: f64, angle_asked: f64) -> State {
    let [_, _, yaw, speed, side, yaw_rate, angle] = *state;
    let rear = WHEELBASE_M - COG_AHEAD_M;
    let [front_arm, rear_arm] = [rear, COG_AHEAD_M];
    // Slip angles of a crawling wheel have no meaning.
    let rolling = speed.max(0.6);
    let front_force = CORNERING_STIFFNESS_N[0] * (angle - ((side + front_arm * yaw_rate) / rolling).atan());
    let rear_force = -CORNERING_STIFFNESS_N[1] * ((side - rear_arm * yaw_rate) / rolling).atan();
    let drive = (SPEED_GAIN * (speed_asked - speed)).clamp(-ACCELERATION_MAX, ACCELERATION_MAX);
    let rear_side = side - rear_arm * yaw_rate;
    let (sine, cosine) = yaw.sin_cos();
    [
        speed * cosine - rear_side * sine,
        speed * sine + rear_side * cosine,
        yaw_rate,
        drive - front_force * angle.sin() / MASS_KG + side * yaw_rate,
        (front_force * angle.cos() + rear_force) / MASS_KG - speed * yaw_rate,
        (front_arm * front_force * angle.cos() - rear_arm * rear_force) / YAW_INERTIA_KGM2,
        (angle_asked - angle) / SERVO_S,
    ]
}

fn stepped(state: &State, speed_asked: f64, angle_asked: f64, step_s: f64) -> State {
    let moved = |by: &State, share: f64| std::array::from_fn(|i| state[i] + share * step_s * by[i]);
    let rate = |state: &State| rates(state, speed_asked, angle_asked);
    let a = rate(state);
    let b = rate(&moved(&a, 0.5));
    let c = rate(&moved(&b, 0.5));
    let d = rate(&moved(&c, 1.0));
    std::array::from_fn(|i| state[i] + step_s / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

/// What is measured while commands are followed from standstill.
pub fn drive(commands: &[Command], wrong: Wrong, seed: u64) -> DriveLog {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut noisy = |value: f64, deviation: f64| {
        let drawn: f64 = StandardNormal.sample(&mut random);
        value + deviation * drawn
    };
    let mut state: State = [0.0; 7];
    let mut log = DriveLog::default();
    for (row, command) in commands.iter().enumerate() {
        let values = [
            (Column::X, noisy(state[0], 0.01)),
            (Column::Y, noisy(state[1], 0.01)),
            (Column::Yaw, noisy(state[2], 0.002)),
            (Column::Vx, noisy(state[3], 0.02)),
            (Column::Wz, noisy(state[5], 0.004)),
            (Column::CmdSpeed, f64::from(command.speed_mps)),
            (Column::CmdSteer, f64::from(command.steering_rad)),
        ];
        let empty = DriveRow::new(row as f64 * ROW_S);
        log.push("", &values.into_iter().fold(empty, |row, (column, value)| row.with(column, value)))
            .unwrap();
        let queued = f64::from(commands[row.saturating_sub(wrong.queue)].steering_rad);
        let angle = queued * wrong.ratio[usize::from(queued < 0.0)];
        for _ in 0..STEPS_PER_ROW {
            state = stepped(&state, f64::from(command.speed_mps), angle, ROW_S / STEPS_PER_ROW as f64);
        }
    }
    log
}

/// A lively driver: speeds and angles that change every one to three seconds, with a weave on top.
pub fn lively(duration_s: f64, seed: u64) -> Vec<Command> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
    let n = (duration_s / ROW_S) as usize;
    let mut commands = Vec::with_capacity(n);
    let (mut speed, mut angle, mut weave): (f64, f64, f64) = (2.0, 0.0, 0.0);
    let mut hold = 0;
    for row in 0..n {
        if hold == 0 {
            hold = random.random_range(50..150);
            speed = random.random_range(0.8..4.0);
            angle = random.random_range(-1.0..1.0) * (0.35_f64).min(4.0 / (speed * speed));
            weave = random.random_range(0.3..1.5);
        }
        hold -= 1;
        let steering = angle + 0.05 * (TAU * weave * row as f64 * ROW_S).sin();
        commands.push(Command { speed_mps: speed as f32, steering_rad: steering as f32 });
    }
    commands
}

/// A dull driver: one speed, a slow weave.
pub fn dull(duration_s: f64, phase: f64) -> Vec<Command> {
    let n = (duration_s / ROW_S) as usize;
    let at = |row: usize| Command {
        speed_mps: 2.5,
        steering_rad: (0.15 * (TAU * 0.08 * row as f64 * ROW_S + phase).sin()) as f32,
    };
    (0..n).map(at).collect()
}
