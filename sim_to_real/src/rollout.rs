//! Rollouts of a model from the measured states of a drive, sixteen or eight at a time, against what was measured.

use crate::drive::{Drive, HORIZONS, N_STEPS, STEP_S, VX, YAW};
use crate::evidence::{Evidence, SpeedInput, SpeedSource};
use bicycle::effect::Effect;
use bicycle::lanes::{Instructions, Lanes, Portable, Real, Scalar};
use bicycle::{Asked, GroundSample, LaneState, Limits, Model, Rates, SensorModel, Stepper};
use pulp::NullaryFnOnce;
#[cfg(target_arch = "x86_64")]
use pulp::{f32x8, f32x16};
use std::f64::consts::TAU;

/// Quantities compared: along, across [m], turn [rad], speed [m/s], yaw rate [rad/s].
pub(crate) const N_QUANTITIES: usize = 5;
/// Numbers per start: every quantity at every horizon.
pub(crate) const PER_START: usize = HORIZONS.len() * N_QUANTITIES;
/// Most lanes of any instruction set.
const WIDEST: usize = 16;

/// The effects of a model ready for rollouts of [`STEP_S`].
pub(crate) struct Simulator {
    stepper: Stepper,
    sensors: SensorModel,
}

impl Simulator {
    pub(crate) fn new(wheelbase_m: f64, effects: &[Effect]) -> Self {
        let model = Model { wheelbase_m, limits: UNLIMITED, effects: effects.to_vec() };
        Self {
            stepper: Stepper::new(&model, STEP_S, 1.0).with_instant_actuators(),
            sensors: SensorModel::of(effects),
        }
    }

    /// Predicted measurements of every start of a drive, [`PER_START`] numbers each, horizon by horizon.
    pub(crate) fn predict(&self, drive: &Drive) -> Vec<f32> {
        let rows = self.rows(drive);
        let roll_out = RollOut { simulator: self, drive, given: &rows };
        match Instructions::widest() {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(lanes) => lanes.vectorize(On(lanes, roll_out)),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(lanes) => lanes.vectorize(On(lanes, roll_out)),
            #[cfg(target_arch = "aarch64")]
            Instructions::Neon(lanes) => lanes.vectorize(On(lanes, roll_out)),
            Instructions::Portable => On(Portable, roll_out).call(),
        }
    }

    /// What every row of a drive gives to a rollout that starts there.
    fn rows(&self, drive: &Drive) -> Rows {
        let mut memory = vec![0.0; self.stepper.n_slots()];
        self.stepper.fill_steady_state(drive.commands[0], &mut memory);
        let mut rows = Rows { asked: Default::default(), held: vec![Vec::new(); self.stepper.n_held()] };
        for (row, command) in drive.commands.iter().enumerate() {
            let asked = self.asked(drive, (row, command), &mut memory);
            let asked_of = [asked.speed, asked.steering, asked.acceleration];
            rows.asked.iter_mut().zip(asked_of).for_each(|(all, value)| all.push(value.1 as f32));
            for (all, held) in rows.held.iter_mut().zip(self.stepper.held(&mut memory)) {
                all.push(*held as f32);
            }
            if self.stepper.n_held() > 0 && row + 1 < drive.commands.len() {
                self.observe(drive, row, asked, &mut memory);
            }
        }
        rows
    }

    fn asked(
        &self,
        drive: &Drive,
        (row, command): (usize, &bicycle::Command),
        memory: &mut [f64],
    ) -> Asked<Scalar> {
        // A speed that was measured is what the sensor made of it.
        let per_reading = match drive.evidence.speed_input {
            SpeedInput::Measured => 1.0 / self.sensors.velocity_ratio,
            SpeedInput::Commanded | SpeedInput::CommandedAcceleration => 1.0,
        };
        let speed_mps = f64::from(command.speed_mps) * per_reading;
        let command = [speed_mps, f64::from(command.steering_rad)].map(|value| Real(Scalar, value));
        self.stepper.asked(command, Real(Scalar, drive.smooth[VX][row]), memory, row)
    }

    /// Goes the step that was driven, so that what is held follows it.
    fn observe(&self, drive: &Drive, row: usize, asked: Asked<Scalar>, memory: &mut [f64]) {
        let real = |value: f64| Real(Scalar, value);
        let zero = real(0.0);
        let speed_mps = |row: usize| drive.smooth[VX][row] / self.sensors.velocity_ratio;
        let turns = real((drive.smooth[YAW][row] - self.sensors.yaw_offset_rad) / TAU).wrap_turns();
        let mut state = LaneState { x: zero, y: zero, turns, speed: real(speed_mps(row)), steering: zero };
        let [east, north, class] =
            [&drive.gradient[0], &drive.gradient[1], &drive.class].map(|told| real(f64::from(told[row])));
        let ground = ground(Scalar, [east, north], class);
        self.follow(drive.evidence, &mut state, asked, &ground, memory);
        self.stepper.correct_held(memory, speed_mps(row + 1) - state.speed.1);
    }

    #[inline(always)]
    fn follow<L: Lanes>(
        &self,
        evidence: Evidence,
        state: &mut LaneState<L>,
        mut asked: Asked<L>,
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
    ) -> Rates<L> {
        if evidence.speed_input == SpeedInput::CommandedAcceleration {
            asked.speed = asked.speed.mul_add(state.x.0.real(STEP_S), state.speed);
        }
        if evidence.is_skid_steered() {
            self.stepper.follow_yaw_rate(state, asked, ground, memory)
        } else {
            self.stepper.follow(state, asked, ground, memory)
        }
    }
}

/// Firm ground of a slope and a class.
#[inline(always)]
fn ground<L: Lanes>(lanes: L, gradient: [Real<L>; 2], class: Real<L>) -> GroundSample<Real<L>> {
    let firm = lanes.real(1.0);
    GroundSample { linear_traction: firm, angular_traction: firm, gradient, class }
}

/// What the commands ask of the actuators at every row of a drive, and what the effects then hold.
struct Rows {
    /// Speed and steering angle, or what stands for them, and acceleration, row by row.
    asked: [Vec<f32>; 3],
    /// Row by row for each that is held [m/s2].
    held: Vec<Vec<f32>>,
}

pub(crate) const UNLIMITED: Limits = Limits {
    speed_max_mps: f64::MAX,
    reverse_speed_max_mps: f64::MAX,
    steering_max_rad: bicycle::lanes::STEERING_DOMAIN_RAD,
    steering_rate_max_radps: f64::MAX,
    acceleration_max_mps2: f64::MAX,
    lateral_acceleration_max_mps2: f64::MAX,
    roll_max_rad: f64::MAX,
    pitch_max_rad: f64::MAX,
};

/// Packs that can be filled from numbers and read.
trait Pack: Lanes {
    fn pack(values: &[f32; WIDEST]) -> Self::Value;
    fn unpack(value: Self::Value) -> [f32; WIDEST];
}

#[inline(always)]
fn first_eight(values: &[f32; WIDEST]) -> [f32; 8] {
    let mut eight = [0.0; 8];
    eight.copy_from_slice(&values[..8]);
    eight
}

#[inline(always)]
fn widened(values: [f32; 8]) -> [f32; WIDEST] {
    let mut wide = [0.0; WIDEST];
    wide[..8].copy_from_slice(&values);
    wide
}

/// What is told `step` rows after each lane's own: in a loop, which is compiled in place, as `array::map` is not always.
#[inline(always)]
fn packed<L: Pack>(lanes: L, (rows, step): (&[usize; WIDEST], usize), told: &[f32]) -> Real<L> {
    let told = &told[step..];
    let mut values = [0.0; WIDEST];
    for (value, row) in values.iter_mut().zip(rows).take(L::WIDTH) {
        *value = told[*row];
    }
    Real(lanes, L::pack(&values))
}

impl Pack for Portable {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> [f32; 8] {
        first_eight(values)
    }
    #[inline(always)]
    fn unpack(value: [f32; 8]) -> [f32; WIDEST] {
        widened(value)
    }
}

#[cfg(target_arch = "x86_64")]
impl Pack for pulp::x86::V3 {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> f32x8 {
        pulp::cast(first_eight(values))
    }
    #[inline(always)]
    fn unpack(value: f32x8) -> [f32; WIDEST] {
        widened(pulp::cast(value))
    }
}

#[cfg(target_arch = "aarch64")]
impl Pack for pulp::aarch64::Neon {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> [pulp::f32x4; 2] {
        pulp::cast(first_eight(values))
    }
    #[inline(always)]
    fn unpack(value: [pulp::f32x4; 2]) -> [f32; WIDEST] {
        widened(pulp::cast(value))
    }
}

#[cfg(target_arch = "x86_64")]
impl Pack for pulp::x86::V4 {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> f32x16 {
        pulp::cast(*values)
    }
    #[inline(always)]
    fn unpack(value: f32x16) -> [f32; WIDEST] {
        pulp::cast(value)
    }
}

/// Work on one instruction set.
struct On<L, W>(L, W);

struct RollOut<'a> {
    simulator: &'a Simulator,
    drive: &'a Drive,
    given: &'a Rows,
}

impl<L: Pack> NullaryFnOnce for On<L, RollOut<'_>> {
    type Output = Vec<f32>;
    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let Self(lanes, work) = self;
        let mut predicted = vec![0.0; work.drive.starts.len() * PER_START];
        let packs = work.drive.starts.chunks(L::WIDTH);
        for (starts, outcomes) in packs.zip(predicted.chunks_mut(L::WIDTH * PER_START)) {
            work.roll(lanes, starts, outcomes);
        }
        predicted
    }
}

/// Poses of a pack after every step, from the first: east, north [m] and turn [rad] from the start.
type Way = [[[f32; WIDEST]; 3]; N_STEPS + 1];

impl RollOut<'_> {
    #[inline(always)]
    fn roll<L: Pack>(&self, lanes: L, starts: &[usize], outcomes: &mut [f32]) {
        // The last pack may be short: its spare lanes repeat the last start.
        let rows: [usize; WIDEST] = std::array::from_fn(|lane| starts[lane.min(starts.len() - 1)]);
        let origin = rows.map(|row| self.origin(row));
        let real = |values: [f32; WIDEST]| Real(lanes, L::pack(&values));
        let zero = lanes.real(0.0);
        let mut state = LaneState {
            x: zero,
            y: zero,
            turns: real(origin.map(|origin| origin.turns)),
            speed: real(origin.map(|origin| origin.speed_mps)),
            steering: zero,
        };
        let simulator = self.simulator;
        let mut memory = vec![zero.1; simulator.stepper.n_slots()];
        for (held, given) in simulator.stepper.held(&mut memory).iter_mut().zip(&self.given.held) {
            *held = packed(lanes, (&rows, 0), given).1;
        }
        let mut turned = zero;
        let mut way: Way = [[[0.0; WIDEST]; 3]; N_STEPS + 1];
        let mut next_horizon = 0;
        for step in 0..N_STEPS {
            let [speed, steering, acceleration] = &self.given.asked;
            let asked = Asked {
                speed: packed(lanes, (&rows, step), speed),
                steering: packed(lanes, (&rows, step), steering),
                acceleration: packed(lanes, (&rows, step), acceleration),
            };
            let ground = if simulator.stepper.uses_ground() {
                let [east, north] = &self.drive.gradient;
                let gradient = [packed(lanes, (&rows, step), east), packed(lanes, (&rows, step), north)];
                ground(lanes, gradient, packed(lanes, (&rows, step), &self.drive.class))
            } else {
                ground(lanes, [zero; 2], zero)
            };
            let rates = simulator.follow(self.drive.evidence, &mut state, asked, &ground, &mut memory);
            turned = rates.yaw_rate.mul_add(lanes.real(STEP_S), turned);
            way[step + 1] = [L::unpack(state.x.1), L::unpack(state.y.1), L::unpack(turned.1)];
            if step + 1 == HORIZONS[next_horizon] {
                let rates = [L::unpack(rates.speed.1), L::unpack(rates.yaw_rate.1)];
                self.sense(&way, next_horizon, (&origin, rates), outcomes);
                next_horizon += 1;
            }
        }
    }

    fn origin(&self, row: usize) -> Origin {
        let sensors = &self.simulator.sensors;
        let age_steps = sensors.pose_latency_s / STEP_S;
        let since = |sums: &[f64]| sums[row] - interpolated(|k| sums[k], row as f64 - age_steps);
        let way_m = since(&self.drive.travelled[0]) / sensors.velocity_ratio;
        let turn_rad = since(&self.drive.travelled[1]) - sensors.yaw_rate_bias_radps * sensors.pose_latency_s;
        let heading_rad = self.drive.smooth[YAW][row];
        let seen_yaw_rad = heading_rad - sensors.yaw_offset_rad;
        let (sine, cosine) = (seen_yaw_rad + 0.5 * turn_rad).sin_cos();
        let turns = (seen_yaw_rad + turn_rad) / TAU;
        let speed_mps = match self.drive.evidence.speed_source {
            SpeedSource::Command => self.given.asked[0][row],
            _ => (self.drive.smooth[VX][row] / sensors.velocity_ratio) as f32,
        };
        Origin {
            turns: (turns - turns.round()) as f32,
            speed_mps,
            seen_m: [-way_m * cosine, -way_m * sine],
            turn_rad,
            heading: heading_rad.sin_cos(),
        }
    }

    /// Writes what the sensors would say at a horizon.
    fn sense(
        &self,
        way: &Way,
        horizon: usize,
        (origin, rates): (&[Origin; WIDEST], [[f32; WIDEST]; 2]),
        outcomes: &mut [f32],
    ) {
        let sensors = &self.simulator.sensors;
        let seen_step = HORIZONS[horizon] as f64 - sensors.pose_latency_s / STEP_S;
        for (lane, outcomes) in outcomes.chunks_mut(PER_START).enumerate() {
            let start = &origin[lane];
            let at = |quantity: usize| interpolated(|k| f64::from(way[k][quantity][lane]), seen_step);
            let (dx, dy) = (at(0) - start.seen_m[0], at(1) - start.seen_m[1]);
            let (sine, cosine) = start.heading;
            let seen = [
                dx * cosine + dy * sine,
                dy * cosine - dx * sine,
                at(2) + start.turn_rad,
                f64::from(rates[0][lane]) * sensors.velocity_ratio,
                f64::from(rates[1][lane]) + sensors.yaw_rate_bias_radps,
            ];
            outcomes[horizon * N_QUANTITIES..][..N_QUANTITIES]
                .copy_from_slice(&seen.map(|value| value as f32));
        }
    }
}

/// Where a rollout starts. Places are relative to where the vehicle then is.
#[derive(Clone, Copy)]
struct Origin {
    /// True yaw [turns].
    turns: f32,
    /// True speed [m/s].
    speed_mps: f32,
    /// Where the pose that was measured then puts the vehicle: east, north [m].
    seen_m: [f64; 2],
    /// How far the vehicle has turned since that pose [rad].
    turn_rad: f64,
    /// Sine and cosine of the measured yaw.
    heading: (f64, f64),
}

/// Linear between whole places; before the first, the first.
fn interpolated(value: impl Fn(usize) -> f64, place: f64) -> f64 {
    let place = place.max(0.0);
    let (below, share) = (place as usize, place.fract());
    if share == 0.0 { value(below) } else { value(below) + share * (value(below + 1) - value(below)) }
}
