//! A drive along a plan: the plant, whoever follows the line, and a referee.

use std::sync::Arc;

use bicycle::{Command, Vehicle};
use route::RoutePoint;
use scenarios::{CommandError, Landscape, Motion, Plant, PlantError, RouteTask};
use serde::Serialize;

use super::plan::Plan;

/// Control cycles per second [Hz].
pub(super) const CONTROL_HZ: f64 = 20.0;
/// So near to the goal counts as there [m].
pub(super) const ARRIVED_M: f64 = 2.0;
/// Farther than this from the line a drive is lost [m].
const LOST_M: f64 = 15.0;
/// Stuck is who moves no more than this in so long (AnyNav: 5 s) [m, s].
const STUCK: (f64, f64) = (0.5, 5.0);
/// Longest drive over what was expected, and beside it [-, s].
const TIME_LIMIT: (f64, f64) = (3.0, 30.0);
/// The foot is sought so far ahead of the last one [m].
const AHEAD_M: f64 = 12.0;

/// How a drive ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// At the goal.
    Goal,
    /// Nothing was found to drive along.
    NoRoute,
    /// On its side.
    RolledOver,
    /// In a tree.
    Collision,
    /// In the water.
    Water,
    /// It did not move for five seconds.
    Stuck,
    /// 15 m from the line, or off the map.
    OffRoute,
    /// Under way for far longer than expected.
    TimeLimit,
}

impl End {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Goal,
        Self::NoRoute,
        Self::RolledOver,
        Self::Collision,
        Self::Water,
        Self::Stuck,
        Self::OffRoute,
        Self::TimeLimit,
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Goal => "goal",
            Self::NoRoute => "no route",
            Self::RolledOver => "rolled over",
            Self::Collision => "collision",
            Self::Water => "water",
            Self::Stuck => "stuck",
            Self::OffRoute => "off route",
            Self::TimeLimit => "time limit",
        }
    }
}

/// What came of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Driven {
    pub end: End,
    pub time_s: f64,
    /// Farthest from the line [m].
    pub off_max_m: f64,
    /// Where it ended [m].
    pub at_m: [f64; 2],
}

/// Where on its line a vehicle is.
pub(super) struct Foot<'a> {
    pub points: &'a [RoutePoint],
    pub spacing_m: f64,
    pub index: usize,
}

impl<'a> Foot<'a> {
    pub fn new(plan: &'a Plan) -> Self {
        Self { points: &plan.points, spacing_m: plan.spacing_m, index: 0 }
    }

    /// Moves on to the point nearest to a place, and gives the place's distance to the left of the line there [m].
    pub fn follow(&mut self, at_m: [f64; 2]) -> f64 {
        let ahead = (AHEAD_M / self.spacing_m).ceil() as usize;
        let window = self.index..self.points.len().min(self.index + ahead + 1);
        let away_m = |index: &usize| {
            let [x_m, y_m] = self.points[*index].at_m;
            (at_m[0] - x_m).hypot(at_m[1] - y_m)
        };
        self.index = window.min_by(|a, b| away_m(a).total_cmp(&away_m(b))).unwrap_or(self.index);
        let point = &self.points[self.index];
        let (sine, cosine) = libm::sincos(point.yaw_rad);
        cosine * (at_m[1] - point.at_m[1]) - sine * (at_m[0] - point.at_m[0])
    }

    /// The point so far ahead along the line.
    pub fn ahead(&self, distance_m: f64) -> &'a RoutePoint {
        let index = self.index + (distance_m / self.spacing_m).round() as usize;
        &self.points[index.min(self.points.len() - 1)]
    }
}

/// Who drives along a line.
pub(super) trait Follower {
    /// What to do at a pose and speed, `off_m` to the left of the foot.
    fn command(&mut self, motion: &Motion, foot: &Foot<'_>, off_m: f64) -> Command;
}

/// Proportional and differential in the offset from the line, ahead of which its curvature is fed; the speed is the
/// plan's, to which the vehicle's own servo holds it.
pub(super) struct PdFollower {
    pub wheelbase_m: f64,
    pub steering_max_rad: f64,
}

impl PdFollower {
    pub fn of(vehicle: &Vehicle) -> Self {
        Self { wheelbase_m: vehicle.geometry.wheelbase_m, steering_max_rad: vehicle.limits.steering_max_rad }
    }
}

/// How fast offsets decay [rad/s], and over no less than so much way [m].
const DECAY_RADPS: f64 = 1.0;
const DECAY_MIN_M: f64 = 3.0;
/// Offsets act as if they were no larger than so many decay lengths.
const OFF_MAX: f64 = 1.5;
/// Steering and motor answer so late [s].
const STEERING_DELAY_S: f64 = 0.2;
const SPEED_DELAY_S: f64 = 0.3;
/// Slowest speed on the way: the plan stands still at its start [m/s].
const CREEPING_MPS: f64 = 0.8;

impl Follower for PdFollower {
    fn command(&mut self, motion: &Motion, foot: &Foot<'_>, off_m: f64) -> Command {
        let speed_mps = motion.velocity_mps[0].max(0.0);
        let length_m = (speed_mps / DECAY_RADPS).max(DECAY_MIN_M);
        let off_m = off_m.clamp(-OFF_MAX * length_m, OFF_MAX * length_m);
        let turned_rad = motion.pose.yaw_rad - foot.points[foot.index].yaw_rad;
        let fed = foot.ahead(speed_mps * STEERING_DELAY_S).bend.curvature_per_m;
        let curvature = fed - off_m / length_m.powi(2) - 2.0 * turned_rad.sin() / length_m;
        let steering_rad = (self.wheelbase_m * curvature).atan();
        let wanted_mps = foot.ahead(speed_mps * SPEED_DELAY_S).speed_mps.max(CREEPING_MPS);
        Command {
            speed_mps: wanted_mps as f32,
            steering_rad: steering_rad.clamp(-self.steering_max_rad, self.steering_max_rad) as f32,
        }
    }
}

/// Why a drive could not begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// The plant cannot be put there.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A command is no number.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// There is no such controller.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
}

/// Drives along a plan until the goal or until it is lost.
pub(super) fn drive(
    landscape: &Landscape,
    vehicle: &Vehicle,
    task: &RouteTask,
    plan: &Plan,
    follower: &mut impl Follower,
) -> Result<Driven, TrackError> {
    let [x_m, y_m] = task.start_m;
    let mut plant = Plant::new(vehicle, Arc::clone(&landscape.world), [x_m, y_m, task.yaw_rad])?;
    let mut foot = Foot::new(plan);
    let most_s = TIME_LIMIT.0 * plan.duration_s(ARRIVED_M) + TIME_LIMIT.1;
    let mut stillness = Stillness { at_m: task.start_m, since_s: 0.0 };
    let mut off_max_m = 0.0_f64;
    loop {
        let motion = plant.motion();
        let at_m = [motion.pose.x_m, motion.pose.y_m];
        let off_m = foot.follow(at_m);
        off_max_m = off_max_m.max(off_m.abs());
        let time_s = plant.time_s();
        let left_m = (task.goal_m[0] - at_m[0]).hypot(task.goal_m[1] - at_m[1]);
        let end = if left_m <= ARRIVED_M {
            Some(End::Goal)
        } else if stillness.is_stuck(at_m, time_s) {
            Some(End::Stuck)
        } else if time_s > most_s {
            Some(End::TimeLimit)
        } else {
            broken(&plant).or((off_m.abs() > LOST_M).then_some(End::OffRoute))
        };
        if let Some(end) = end {
            return Ok(Driven { end, time_s, off_max_m, at_m });
        }
        plant.set_command(follower.command(&motion, &foot, off_m))?;
        plant.advance(1.0 / CONTROL_HZ);
    }
}

/// What ends a drive whoever drives.
fn broken(plant: &Plant) -> Option<End> {
    if plant.rolled_over() || !plant.is_finite() {
        Some(End::RolledOver)
    } else if plant.collision().is_some() {
        Some(End::Collision)
    } else if plant.is_in_water() {
        Some(End::Water)
    } else {
        plant.left_world().then_some(End::OffRoute)
    }
}

struct Stillness {
    at_m: [f64; 2],
    since_s: f64,
}

impl Stillness {
    fn is_stuck(&mut self, at_m: [f64; 2], time_s: f64) -> bool {
        if (at_m[0] - self.at_m[0]).hypot(at_m[1] - self.at_m[1]) > STUCK.0 {
            *self = Self { at_m, since_s: time_s };
        }
        time_s - self.since_s > STUCK.1
    }
}
