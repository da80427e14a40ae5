//! Rollouts of a model from the measured states of drives, sixteen or eight at a time, against what was measured.

mod pack;
mod rows;
#[cfg(test)]
mod tests;

use crate::drive::{Drive, HORIZONS, N_QUANTITIES, N_STEPS, STEP_S, VX, VY, WZ, YAW};
use crate::evidence::{Evidence, SpeedInput, SpeedSource};
use bicycle::effect::Effect;
use bicycle::lanes::{Instructions, Lanes, Portable, Real};
use bicycle::{Asked, GroundSample, LaneState, Limits, Model, Rates, SensorModel, Stepper};
use pack::{Pack, packed};
use pulp::NullaryFnOnce;
use rows::Rows;
use std::f64::consts::TAU;

/// Numbers per start: every quantity at every horizon, along, across [m], turn [rad], speed [m/s], yaw rate [rad/s] and
/// speed to the left [m/s].
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

    /// Predicted measurements of every start of every drive, [`PER_START`] numbers each, horizon by horizon.
    pub(crate) fn predict(&self, drives: &[&Drive]) -> Vec<f32> {
        let roll_out = RollOuts { simulator: self, drives };
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

/// Work on one instruction set.
struct On<L, W>(L, W);

/// The rollouts of some drives.
struct RollOuts<'a> {
    simulator: &'a Simulator,
    drives: &'a [&'a Drive],
}

impl<L: Pack> NullaryFnOnce for On<L, RollOuts<'_>> {
    type Output = Vec<f32>;
    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let Self(lanes, RollOuts { simulator, drives }) = self;
        let n_starts: usize = drives.iter().map(|drive| drive.starts.len()).sum();
        let mut predicted = vec![0.0; n_starts * PER_START];
        let mut rest = &mut predicted[..];
        for alike in drives.chunk_by(|a, b| a.evidence == b.evidence) {
            for together in alike.chunks(L::WIDTH) {
                for (drive, given) in together.iter().zip(simulator.rows(lanes, together)) {
                    let (own, others) = rest.split_at_mut(drive.starts.len() * PER_START);
                    RollOut { simulator, drive, given }.roll_all(lanes, own);
                    rest = others;
                }
            }
        }
        predicted
    }
}

/// The rollouts of a drive.
struct RollOut<'a> {
    simulator: &'a Simulator,
    drive: &'a Drive,
    given: Rows,
}

/// Poses of a pack after every step, from the first: east, north [m] and turn [rad] from the start.
type Way = [[[f32; WIDEST]; 3]; N_STEPS + 1];

impl RollOut<'_> {
    #[inline(always)]
    fn roll_all<L: Pack>(&self, lanes: L, outcomes: &mut [f32]) {
        let packs = self.drive.starts.chunks(L::WIDTH).zip(outcomes.chunks_mut(L::WIDTH * PER_START));
        for (starts, outcomes) in packs {
            self.roll(lanes, starts, outcomes);
        }
    }

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
            *held = packed(lanes, |lane| given[rows[lane]]).1;
        }
        if simulator.stepper.carries_motion() {
            let motion = [0, 1, 2].map(|place| packed(lanes, |lane| self.motion(rows[lane])[place]).1);
            simulator.stepper.start_motion(&mut memory, motion);
        }
        let mut turned = zero;
        let mut way: Way = [[[0.0; WIDEST]; 3]; N_STEPS + 1];
        let mut next_horizon = 0;
        for step in 0..N_STEPS {
            let [speed, steering, acceleration] = &self.given.asked;
            let asked = Asked {
                speed: packed(lanes, |lane| speed[rows[lane] + step]),
                steering: packed(lanes, |lane| steering[rows[lane] + step]),
                acceleration: packed(lanes, |lane| acceleration[rows[lane] + step]),
            };
            let ground = if simulator.stepper.uses_ground() {
                let [east, north] = &self.drive.gradient;
                let gradient = [
                    packed(lanes, |lane| east[rows[lane] + step]),
                    packed(lanes, |lane| north[rows[lane] + step]),
                ];
                ground(lanes, gradient, packed(lanes, |lane| self.drive.class[rows[lane] + step]))
            } else {
                ground(lanes, [zero; 2], zero)
            };
            let rates = simulator.follow(self.drive.evidence, &mut state, asked, &ground, &mut memory);
            turned = rates.yaw_rate.mul_add(lanes.real(STEP_S), turned);
            way[step + 1] = [L::unpack(state.x.1), L::unpack(state.y.1), L::unpack(turned.1)];
            if step + 1 == HORIZONS[next_horizon] {
                let rates = [rates.speed, rates.yaw_rate, rates.side_speed].map(|rate| L::unpack(rate.1));
                self.sense(&way, next_horizon, (&origin, rates), outcomes);
                next_horizon += 1;
            }
        }
    }

    /// Speed to the left [m/s] and yaw rate [rad/s], and 1; where the former was not measured, 0.
    fn motion(&self, row: usize) -> [f32; 3] {
        let Drive { measured, smooth, .. } = self.drive;
        if measured[VY][row].is_nan() {
            return [0.0; 3];
        }
        let yaw_rate_radps = smooth[WZ][row] - self.simulator.sensors.yaw_rate_bias_radps;
        [smooth[VY][row] as f32, yaw_rate_radps as f32, 1.0]
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
        (origin, rates): (&[Origin; WIDEST], [[f32; WIDEST]; 3]),
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
                f64::from(rates[2][lane]),
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
