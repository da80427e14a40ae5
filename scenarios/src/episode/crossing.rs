//! People in the vehicle's way, and whether a stop would have spared one who was struck.

use std::sync::Arc;

use bicycle::{Command, Vehicle};

use super::referee::STANDING_MPS;
use super::{EpisodeConfig, EpisodeError, TraceRow};
use crate::walker::clearance_m;
use crate::{IMU_PERIOD_NS, Motion, Plant, Task, Walker};

/// Returns of a sweep by which somebody is seen.
const RETURNS_MIN: usize = 3;
/// How far ahead a conflict is looked for [s].
const CONFLICT_S: f64 = 4.0;
/// Steps of that look.
const CONFLICT_STEPS: u32 = 80;
/// Longest that a vehicle takes to stop [s].
const BRAKING_MAX_S: f64 = 10.0;

/// The moving vehicle touched somebody. One that stands and is walked into has struck nobody.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strike {
    /// When, since the start [s].
    pub time_s: f64,
    /// Number of the walker in [`EpisodeConfig::walkers`], from 0.
    pub walker: usize,
    /// Where the walker's centre was [m].
    pub at_m: [f64; 2],
    /// Speed of the vehicle then [m/s].
    pub speed_mps: f64,
    /// The first time at which the walker was seen and in conflict [s]: two sweeps in a row show him by three returns
    /// each, and if both go on as they do they touch within 4 s.
    pub foreseen_at_s: Option<f64>,
    /// Whether the plant, told to stand still from that time on, would have stood before it touched him.
    pub was_avoidable: bool,
}

/// The walkers of an episode, and what is remembered of them.
pub(super) struct Crossing {
    vehicle: Vehicle,
    walkers: Vec<Walker>,
    /// Whether somebody touches the standing vehicle.
    is_touched: Vec<bool>,
    /// As they were at the beginning of every cycle.
    history: Vec<Vec<Walker>>,
    /// Of the last sweep, and of the one before it, by walker.
    is_seen: Vec<[bool; 2]>,
    /// The first cycle that began with the walker seen and in conflict.
    foreseen: Vec<Option<usize>>,
    strike: Option<Strike>,
    n_walked_into: u64,
}

impl Crossing {
    pub fn new(vehicle: &Vehicle, walkers: Vec<Walker>) -> Self {
        let n = walkers.len();
        Self {
            vehicle: vehicle.clone(),
            walkers,
            is_touched: vec![false; n],
            history: Vec::new(),
            is_seen: vec![[false; 2]; n],
            foreseen: vec![None; n],
            strike: None,
            n_walked_into: 0,
        }
    }

    pub fn walkers(&self) -> &[Walker] {
        &self.walkers
    }

    pub fn strike(&self) -> Option<Strike> {
        self.strike
    }

    pub fn n_walked_into(&self) -> u64 {
        self.n_walked_into
    }

    /// Notes how a cycle begins.
    pub fn begin_cycle(&mut self) {
        if !self.walkers.is_empty() {
            self.history.push(self.walkers.clone());
        }
    }

    /// Notes a sweep that was taken before the cycle of this number: how many returns came from each walker.
    pub fn note_sweep(&mut self, n_returns: &[usize], motion: &Motion, cycle: usize) {
        for (place, &n_returns) in n_returns.iter().enumerate() {
            let is_seen = [n_returns >= RETURNS_MIN, self.is_seen[place][0]];
            self.is_seen[place] = is_seen;
            if is_seen == [true; 2] && self.foreseen[place].is_none() && self.conflicts(place, motion) {
                self.foreseen[place] = Some(cycle);
            }
        }
    }

    /// Lets the walkers go on to the end of an inertial sample; who comes up against the standing vehicle turns round.
    /// Returns whether the moving vehicle struck one.
    pub fn advance(&mut self, motion: &Motion, time_s: f64) -> bool {
        let speed_mps = motion.velocity_mps[0].hypot(motion.velocity_mps[1]);
        for (place, walker) in self.walkers.iter_mut().enumerate() {
            walker.advance(IMU_PERIOD_NS as f64 * 1e-9);
            let touches = walker.clearance_m(&self.vehicle.geometry, &motion.pose) <= 0.0;
            let was_touched = std::mem::replace(&mut self.is_touched[place], touches);
            if touches && speed_mps > STANDING_MPS && self.strike.is_none() {
                let (at_m, foreseen_at_s) = (walker.position_m(), None);
                self.strike = Some(Strike {
                    time_s,
                    walker: place,
                    at_m,
                    speed_mps,
                    foreseen_at_s,
                    was_avoidable: false,
                });
            } else if touches && !was_touched {
                self.n_walked_into += 1;
                walker.turn_round();
            }
        }
        self.strike.is_some()
    }

    /// Settles whether a stop would have spared who was struck: the drive is done again up to the moment at which the
    /// conflict could be foreseen, with a new plant, and from there with the order to stand.
    pub fn judge(
        &mut self,
        task: &Task,
        config: &EpisodeConfig,
        trace: &[TraceRow],
    ) -> Result<(), EpisodeError> {
        let Some(Strike { walker: place, .. }) = self.strike else { return Ok(()) };
        let Some(cycle) = self.foreseen[place] else { return Ok(()) };
        let stands = self.would_stand(task, config, trace, (place, cycle))?;
        let at_s = trace.get(cycle).map(|row| row.time_s);
        if let Some(strike) = &mut self.strike {
            (strike.foreseen_at_s, strike.was_avoidable) = (at_s, stands);
        }
        Ok(())
    }

    fn would_stand(
        &self,
        task: &Task,
        config: &EpisodeConfig,
        trace: &[TraceRow],
        (place, cycle): (usize, usize),
    ) -> Result<bool, EpisodeError> {
        let (Some(row), Some(walkers)) = (trace.get(cycle), self.history.get(cycle)) else {
            return Ok(false);
        };
        let world = Arc::clone(&task.world);
        let mut plant =
            Plant::in_engine(config.engine, &self.vehicle, &config.deviations, world, task.start)?;
        let sample_s = IMU_PERIOD_NS as f64 * 1e-9;
        for pair in trace[..=cycle].windows(2) {
            plant.set_command(pair[0].command)?;
            let n_samples = ((pair[1].time_s - pair[0].time_s) / sample_s).round() as u64;
            (0..n_samples).for_each(|_| plant.advance(sample_s));
        }
        plant.set_command(Command { speed_mps: 0.0, ..row.command })?;
        let mut walker = walkers[place].clone();
        for _ in 0..(BRAKING_MAX_S / sample_s) as u64 {
            plant.advance(sample_s);
            walker.advance(sample_s);
            let Motion { pose, velocity_mps, .. } = plant.motion();
            if velocity_mps[0].hypot(velocity_mps[1]) <= STANDING_MPS {
                return Ok(true);
            }
            if walker.clearance_m(&self.vehicle.geometry, &pose) <= 0.0 {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// Whether both touch soon if they go on as they do.
    fn conflicts(&self, place: usize, motion: &Motion) -> bool {
        let walker = &self.walkers[place];
        let ([x_m, y_m], [east_mps, north_mps]) = (walker.position_m(), walker.velocity_mps());
        let mut pose = [motion.pose.x_m, motion.pose.y_m, motion.pose.yaw_rad];
        let step_s = CONFLICT_S / f64::from(CONFLICT_STEPS);
        (0..=CONFLICT_STEPS).any(|step| {
            let time_s = f64::from(step) * step_s;
            let at_m = [x_m + time_s * east_mps, y_m + time_s * north_mps];
            let touches = clearance_m(&self.vehicle.geometry, pose, at_m) <= 0.0;
            let (sin, cos) = pose[2].sin_cos();
            let [ahead_mps, left_mps, _] = motion.velocity_mps;
            pose[0] += step_s * (cos * ahead_mps - sin * left_mps);
            pose[1] += step_s * (sin * ahead_mps + cos * left_mps);
            pose[2] += step_s * motion.angular_rate_radps[2];
            touches
        })
    }
}
