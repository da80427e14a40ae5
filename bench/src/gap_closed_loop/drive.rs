//! One drive of the table.

use serde::Serialize;

use super::belief::Belief;
use super::gap::Gap;

/// What is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ground {
    /// A course to follow at speed, over known hills.
    Course,
    /// The rock field of `surefoot drive`, to a goal, with the map made from scans.
    Rocks,
}

impl Ground {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Course, Self::Rocks];

    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Course => "course",
            Self::Rocks => "rocks",
        }
    }
}

/// A drive to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Job {
    /// What is driven.
    pub ground: Ground,
    /// What the plant does and its simulator does not.
    pub gap: Gap,
    /// What the controller believes.
    pub belief: Belief,
    /// Decides course or world, sensor noise and samples.
    pub seed: u64,
}

/// How a drive ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// At the goal.
    Goal,
    /// Farther from the course than its corridor is wide.
    LeftCourse,
    /// It took too long.
    Timeout,
    /// It lay on its side.
    RolledOver,
    /// Roll or pitch went beyond the limits.
    AttitudeLimit,
    /// It did not move though nobody stopped it.
    Stuck,
    /// It left the world.
    OutOfBounds,
    /// It stood still because it was told to stop.
    Stopped,
    /// It touched an obstacle.
    Collision,
    /// It stood in water.
    InWater,
}

/// One drive in numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriveResult {
    /// Which.
    #[serde(flatten)]
    pub job: Job,
    /// How it ended.
    pub end: End,
    /// Simulated time until then [s].
    pub time_s: f64,
    /// Way driven [m].
    pub path_length_m: f64,
    /// Root mean square distance from the course [m].
    pub across_rms_m: Option<f64>,
    /// Largest distance from the course [m].
    pub across_max_m: Option<f64>,
    /// Root mean square difference from the speed to hold [m/s].
    pub speed_rms_mps: Option<f64>,
    /// Root mean square distance between where a plan put the vehicle half a second ahead and where it then was [m].
    pub plan_rms_m: f64,
}

/// Squares of errors, summed.
#[derive(Default)]
pub(super) struct Errors {
    n: usize,
    across_m2: f64,
    across_max_m: f64,
    speed_m2ps2: f64,
    plan_m2: f64,
    n_plans: usize,
}

impl Errors {
    pub fn across(&mut self, away_m: f64, speed_mps: f64) {
        self.n += 1;
        self.across_m2 += away_m * away_m;
        self.across_max_m = self.across_max_m.max(away_m);
        self.speed_m2ps2 += speed_mps * speed_mps;
    }

    pub fn plan(&mut self, away_m: f64) {
        self.n_plans += 1;
        self.plan_m2 += away_m * away_m;
    }

    pub fn result(&self, job: Job, end: End, (time_s, path_length_m): (f64, f64)) -> DriveResult {
        let root_mean = |sum: f64, n: usize| (sum / n.max(1) as f64).sqrt();
        let on_course = |value: f64| (self.n > 0).then_some(value);
        DriveResult {
            job,
            end,
            time_s,
            path_length_m,
            across_rms_m: on_course(root_mean(self.across_m2, self.n)),
            across_max_m: on_course(self.across_max_m),
            speed_rms_mps: on_course(root_mean(self.speed_m2ps2, self.n)),
            plan_rms_m: root_mean(self.plan_m2, self.n_plans),
        }
    }
}
