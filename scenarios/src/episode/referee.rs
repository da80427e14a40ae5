//! Who says how an episode ends.

use std::collections::VecDeque;

use bicycle::{Decision, Limits};

use super::EpisodeError;
use crate::{Motion, Plant, Task};

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The rear axle's centre came within the tolerance of the goal.
    Goal,
    /// The vehicle lay on its side or roof, at once or within [`Rules::aftermath_s`] after it broke a limit.
    RolledOver,
    /// Roll or pitch went beyond the vehicle's limits.
    AttitudeLimit,
    /// The vehicle did not move though nobody stopped it.
    Stuck,
    /// It left the bounds.
    OutOfBounds,
    /// It took too long.
    Timeout,
    /// It stood still because it was told to stop, or the episode was broken off.
    Stopped,
    /// Body or wheels touched an obstacle; [`Plant::collision`] says how hard.
    Collision,
    /// A wheel stood in water, whose depth nobody knows.
    InWater,
    /// The moving vehicle touched somebody who walks; [`crate::Episode::strike`] says whether a stop would have spared him.
    WalkerStruck,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(match self {
            Self::Goal => "goal reached",
            Self::RolledOver => "rolled over",
            Self::AttitudeLimit => "attitude limit exceeded",
            Self::Stuck => "stuck",
            Self::OutOfBounds => "out of bounds",
            Self::Timeout => "time limit passed",
            Self::Stopped => "stopped",
            Self::Collision => "collision",
            Self::InWater => "in water",
            Self::WalkerStruck => "walker struck",
        })
    }
}

/// When an episode ends.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Longest time [s].
    pub time_limit_s: f64,
    /// Whoever moves less than this [m] ...
    pub immobile_m: f64,
    /// ... within this time [s] is stuck; what it was told to stop does not count.
    pub immobile_s: f64,
    /// Stop decisions for this long without a break end the episode once the vehicle stands [s].
    pub stopped_s: f64,
    /// How long a vehicle that broke an attitude limit is watched for rolling over, and one that struck an obstacle
    /// until it stands [s].
    pub aftermath_s: f64,
    /// How long a vehicle may stand before it is told to drive for the first time, as one does whose controller is
    /// still being started [s]: until then nobody is stuck or stopped.
    #[serde(default)]
    pub startup_s: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            time_limit_s: 120.0,
            immobile_m: 0.1,
            immobile_s: 5.0,
            stopped_s: 4.0,
            aftermath_s: 3.0,
            startup_s: 0.0,
        }
    }
}

impl Rules {
    pub(super) fn validate(&self) -> Result<(), EpisodeError> {
        let settings = [
            ("rules.time_limit_s", self.time_limit_s),
            ("rules.immobile_m", self.immobile_m),
            ("rules.immobile_s", self.immobile_s),
            ("rules.stopped_s", self.stopped_s),
            ("rules.aftermath_s", self.aftermath_s),
        ];
        if let Some((field, found)) = settings.into_iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
            return Err(EpisodeError::Setting { field, expected: "a finite number > 0", found });
        }
        if !(self.startup_s.is_finite() && self.startup_s >= 0.0) {
            let (field, found) = ("rules.startup_s", self.startup_s);
            return Err(EpisodeError::Setting { field, expected: "a finite number >= 0", found });
        }
        Ok(())
    }
}

/// Speed below which a vehicle that was told to stop stands [m/s].
pub(super) const STANDING_MPS: f64 = 0.05;

/// Watches the true motion.
#[derive(Clone, Debug)]
pub(super) struct Referee {
    rules: Rules,
    limits: Limits,
    outcome: Option<Outcome>,
    /// Time in which it was not told to stop [s].
    free_s: f64,
    /// That time and the place at the end of each cycle within its last `immobile_s`.
    places: VecDeque<(f64, [f64; 2])>,
    stopping_s: f64,
    /// Whether the vehicle was ever told to drive.
    has_begun: bool,
    last_m: Option<[f64; 3]>,
    path_length_m: f64,
    largest_roll_rad: f64,
    largest_pitch_rad: f64,
    /// Since when no wheel has touched the ground [s].
    airborne_since_s: Option<f64>,
    longest_flight_s: f64,
}

impl Referee {
    pub(super) fn new(rules: Rules, limits: Limits) -> Self {
        Self {
            rules,
            limits,
            outcome: None,
            free_s: 0.0,
            places: VecDeque::new(),
            stopping_s: 0.0,
            has_begun: false,
            last_m: None,
            path_length_m: 0.0,
            largest_roll_rad: 0.0,
            largest_pitch_rad: 0.0,
            airborne_since_s: None,
            longest_flight_s: 0.0,
        }
    }

    pub(super) fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    pub(super) fn path_length_m(&self) -> f64 {
        self.path_length_m
    }

    pub(super) fn largest_roll_rad(&self) -> f64 {
        self.largest_roll_rad
    }

    pub(super) fn largest_pitch_rad(&self) -> f64 {
        self.largest_pitch_rad
    }

    pub(super) fn longest_flight_s(&self) -> f64 {
        self.longest_flight_s
    }

    pub(super) fn interrupt(&mut self) {
        self.outcome.get_or_insert(Outcome::Stopped);
    }

    pub(super) fn excuse_standing(&mut self) {
        self.places.clear();
        self.stopping_s = 0.0;
    }

    pub(super) fn saw_a_strike(&mut self) {
        self.outcome.get_or_insert(Outcome::WalkerStruck);
    }

    pub(super) fn saw_rolling_over(&mut self) {
        self.outcome = Some(Outcome::RolledOver);
    }

    /// Judges an instant.
    pub(super) fn watch(&mut self, task: &Task, motion: &Motion, plant: &Plant, time_s: f64) {
        let pose = &motion.pose;
        let here_m = [pose.x_m, pose.y_m, pose.z_m];
        let last_m = self.last_m.replace(here_m).unwrap_or(here_m);
        let squares = here_m.iter().zip(&last_m).map(|(a, b)| (a - b) * (a - b));
        self.path_length_m += squares.sum::<f64>().sqrt();
        self.largest_roll_rad = self.largest_roll_rad.max(pose.roll_rad.abs());
        self.largest_pitch_rad = self.largest_pitch_rad.max(pose.pitch_rad.abs());
        self.watch_flight(plant, time_s);
        if self.outcome.is_some() {
            return;
        }
        self.outcome = if plant.rolled_over() {
            Some(Outcome::RolledOver)
        } else if plant.collision().is_some() {
            Some(Outcome::Collision)
        } else if plant.is_in_water() {
            Some(Outcome::InWater)
        } else if self.largest_roll_rad > self.limits.roll_max_rad
            || self.largest_pitch_rad > self.limits.pitch_max_rad
        {
            Some(Outcome::AttitudeLimit)
        } else if !task.bounds.contains(pose.x_m, pose.y_m) || plant.left_world() {
            Some(Outcome::OutOfBounds)
        } else if task.distance_to_goal_m(pose.x_m, pose.y_m) <= task.goal_tolerance_m {
            Some(Outcome::Goal)
        } else if time_s >= self.rules.time_limit_s {
            Some(Outcome::Timeout)
        } else {
            None
        };
    }

    fn watch_flight(&mut self, plant: &Plant, time_s: f64) {
        if plant.wheels().iter().any(|wheel| wheel.contact_m.is_some()) {
            self.airborne_since_s = None;
            return;
        }
        let since_s = *self.airborne_since_s.get_or_insert(time_s);
        self.longest_flight_s = self.longest_flight_s.max(time_s - since_s);
    }

    /// Judges what only shows over several cycles.
    pub(super) fn judge_cycle(&mut self, decision: &Decision, motion: &Motion, time_s: f64, cycle_s: f64) {
        self.has_begun |= matches!(decision, Decision::Drive(_));
        if !self.has_begun && time_s < self.rules.startup_s {
            return;
        }
        let is_stop = matches!(decision, Decision::Stop(_));
        self.stopping_s = if is_stop { self.stopping_s + cycle_s } else { 0.0 };
        self.free_s += if is_stop { 0.0 } else { cycle_s };
        let here_m = [motion.pose.x_m, motion.pose.y_m];
        let is_immobile = !is_stop && self.is_immobile(here_m);
        if self.outcome.is_some() {
            return;
        }
        let stands = motion.velocity_mps[0].hypot(motion.velocity_mps[1]) < STANDING_MPS;
        // Half a cycle against the rounding of sums of cycles.
        if self.stopping_s > self.rules.stopped_s - 0.5 * cycle_s && stands {
            self.outcome = Some(Outcome::Stopped);
        } else if is_immobile {
            self.outcome = Some(Outcome::Stuck);
        }
    }

    /// Whether every place of the last `immobile_s` lies within `immobile_m` of here.
    fn is_immobile(&mut self, here_m: [f64; 2]) -> bool {
        // A thousandth against the rounding of sums of cycles.
        let since_s = self.free_s - 0.999 * self.rules.immobile_s;
        self.places.push_back((self.free_s, here_m));
        // One place from before stays: the window must be covered in full.
        while self.places.get(1).is_some_and(|(then_s, _)| *then_s <= since_s) {
            self.places.pop_front();
        }
        let covered = self.places.front().is_some_and(|(then_s, _)| *then_s <= since_s);
        let near = |place_m: &[f64; 2]| {
            (place_m[0] - here_m[0]).hypot(place_m[1] - here_m[1]) < self.rules.immobile_m
        };
        covered && self.places.iter().all(|(_, place_m)| near(place_m))
    }
}
