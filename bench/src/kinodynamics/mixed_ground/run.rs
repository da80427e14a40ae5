//! One run: once around the line, and how far from it.

use std::sync::Arc;

use bicycle::lanes::Instructions;
use bicycle::{Command, Vehicle};
use kinodynamics::Checkpoint;
use scenarios::{Plant, World};
use serde::Serialize;

use super::super::lap::Failure;
use super::super::machine::Machine;
use super::super::surfaces::{Layout, SURFACES};
use super::super::track::Track;
use super::pilot::Pilot;
use super::{KinodynamicsError, Method};

/// Commands before the start: the unit's history fills.
const STANDING_TICKS: usize = 11;
/// Way from rest on which nothing is measured [m].
const LEAD_M: f64 = 2.0;
/// How far ahead or behind the car may be of where it was thought to be [m].
pub(super) const REACH_M: f64 = 0.7;
/// Farther from the line than this, or turned from it by more, it is lost [m, rad].
const LOST_M: f64 = 1.0;
const SPUN_RAD: f64 = 1.9;
/// A run takes this many times as long as at the target speed at most.
const SLOW_FACTOR: f64 = 3.0;

/// A run to drive.
pub(super) struct Run<'a> {
    pub vehicle: &'a Vehicle,
    /// The line to follow.
    pub middle: &'a Track,
    pub layout: Layout,
    pub world: Arc<World>,
    pub method: Method,
    pub checkpoint: Option<&'a Checkpoint>,
    pub speed_mps: f64,
    /// From the line to the walls [m].
    pub half_width_m: f64,
    /// Decides noise and samples.
    pub seed: u64,
}

/// What became of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MixedRun {
    /// Its number; runs of one number and speed have ground, noise and samples in common.
    pub run: u32,
    /// Why it did not come around; none did well.
    pub failure: Option<Failure>,
    /// Whether it stayed between the walls all the way.
    pub is_within_walls: bool,
    /// Root mean square of the distance to the line, to the end or the failure [m].
    pub distance_m: f64,
    /// Largest distance to the line [m].
    pub largest_distance_m: f64,
    /// Time once around, or to the failure [s].
    pub time_s: f64,
    /// The same root mean square on each of the surfaces alone; none where it was not [m].
    pub surface_distance_m: [Option<f64>; SURFACES.len()],
    /// Strengths of an adapted model at the end: effect and value.
    pub strengths: Vec<(&'static str, f64)>,
}

/// What is measured on the way.
#[derive(Default)]
struct Tally {
    way_m: f64,
    /// Sum of squared distances, and of samples: of all, then of each surface.
    squares_m2: [f64; 1 + SURFACES.len()],
    n_samples: [f64; 1 + SURFACES.len()],
    largest_m: f64,
    failure: Option<Failure>,
}

impl Run<'_> {
    pub(super) fn drive(
        &self,
        number: u32,
        instructions: Instructions,
    ) -> Result<MixedRun, KinodynamicsError> {
        let ([x_m, y_m], yaw_rad) = self.middle.place(0.0);
        let mut machine =
            Machine::new(self.vehicle, Arc::clone(&self.world), [x_m, y_m, yaw_rad], self.seed)?;
        let mut pilot = Pilot::new(self, instructions)?;
        for _ in 0..STANDING_TICKS {
            machine.drive([0.0; 2], |_| {})?;
            pilot.hear(&machine);
        }
        let (mut tally, mut began_ns) = (Tally::default(), machine.now_ns());
        let length_m = self.middle.length_m();
        let most_ns = (SLOW_FACTOR * (length_m + LEAD_M) / self.speed_mps * 1e9) as u64;
        while tally.way_m < LEAD_M + length_m && tally.failure.is_none() {
            if machine.now_ns() > most_ns {
                tally.failure = Some(Failure::Stuck);
                break;
            }
            if tally.way_m < LEAD_M {
                began_ns = machine.now_ns();
            }
            let odometry = machine.measure();
            let Command { speed_mps, steering_rad } = pilot.command(self, &odometry, machine.now_ns())?;
            let curvature_per_m = steering_rad.tan() / self.vehicle.geometry.wheelbase_m as f32;
            machine.drive([speed_mps, curvature_per_m], |plant| self.watch(plant, &mut tally))?;
            pilot.hear(&machine);
        }
        let took_s = (machine.now_ns() - began_ns) as f64 * 1e-9;
        Ok(tally.ended(number, took_s, self.half_width_m, pilot.strengths()))
    }

    fn watch(&self, plant: &Plant, tally: &mut Tally) {
        let pose = plant.pose();
        let (at_m, off_m) = self.middle.project([pose.x_m, pose.y_m], tally.way_m, REACH_M);
        tally.way_m = tally.way_m.max(at_m);
        let (_, heading_rad) = self.middle.place(tally.way_m);
        let off_rad = (pose.yaw_rad - heading_rad).sin().atan2((pose.yaw_rad - heading_rad).cos());
        if plant.rolled_over() || off_rad.abs() > SPUN_RAD {
            tally.failure = Some(Failure::Spun);
        } else if off_m > LOST_M {
            tally.failure = Some(Failure::Collision);
        }
        if tally.way_m >= LEAD_M {
            let surface = self.layout.surface_at(pose.x_m, pose.y_m).map(|index| 1 + index as usize);
            tally.note(surface, off_m);
        }
    }
}

impl Tally {
    fn note(&mut self, surface: Option<usize>, off_m: f64) {
        self.largest_m = self.largest_m.max(off_m);
        for place in [Some(0), surface].into_iter().flatten() {
            self.squares_m2[place] += off_m * off_m;
            self.n_samples[place] += 1.0;
        }
    }

    fn ended(
        self,
        run: u32,
        time_s: f64,
        half_width_m: f64,
        strengths: Vec<(&'static str, f64)>,
    ) -> MixedRun {
        let distance_m = |place: usize| {
            (self.n_samples[place] > 0.0).then(|| (self.squares_m2[place] / self.n_samples[place]).sqrt())
        };
        MixedRun {
            run,
            failure: self.failure,
            is_within_walls: self.failure.is_none() && self.largest_m <= half_width_m,
            distance_m: distance_m(0).unwrap_or(0.0),
            largest_distance_m: self.largest_m,
            time_s,
            surface_distance_m: std::array::from_fn(|surface| distance_m(1 + surface)),
            strengths,
        }
    }
}
