//! One lap: the baseline's planner, a model behind it or none, walls, and what becomes of every turn.

use std::sync::Arc;

use bicycle::Vehicle;
use bicycle::lanes::Instructions;
use kinodynamics::{Checkpoint, Desired, ImuHistory, ImuRange, InverseModel, WINDOW};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::{Plant, World, seed_of, stream};
use serde::Serialize;

use super::KinodynamicsError;
use super::machine::Machine;
use super::surfaces::Layout;
use super::teleoperation::CURVATURE_MAX_PER_M;
use super::track::Track;

/// Distance at which the line of sight meets the path [m].
const LOOKAHEAD_M: f64 = 1.0;
/// Curvatures that the baseline tries.
const CANDIDATES: usize = 100;
/// Time that the car stands before a start: the unit's history fills [s].
const STANDING_TICKS: usize = 11;
/// Slower than this for so long is stuck [m/s, samples].
const STUCK_MPS: f64 = 0.1;
const STUCK_SAMPLES: usize = 300;
/// Further than this from the path's heading it has spun [rad].
const SPUN_RAD: f64 = 1.9;
/// A lap takes this many times as long as at the target speed at most.
const SLOW_FACTOR: f64 = 3.0;
/// How far ahead or behind the car may be of where it was thought to be [m].
const REACH_M: f64 = 0.7;
/// Beyond this a distance to the path counts as this, as in the paper's code [m].
const DISTANCE_MAX_M: f64 = 1.0;

/// What a model is told of the ground while it drives.
#[derive(Clone, Debug)]
pub enum Told {
    /// What the unit measures.
    Measured,
    /// Half seconds out of other drives, columns of [`WINDOW`] samples, one drawn at every command.
    Shuffled(Arc<Vec<Vec<f32>>>),
    /// The same half second always.
    Constant(Arc<Vec<f32>>),
    /// The truth about the ground under the wheels, and nothing that the unit measures.
    Known,
}

/// Who turns the wish into a command.
#[derive(Clone, Debug)]
pub enum Driver {
    /// The nominal model: the wish is the command.
    Baseline,
    /// A learned model.
    Model {
        /// Its weights.
        checkpoint: Arc<Checkpoint>,
        /// What it is told.
        told: Told,
    },
}

/// A lap to drive.
pub struct Lap<'a> {
    /// The car.
    pub vehicle: &'a Vehicle,
    /// The path.
    pub track: &'a Track,
    /// The middle between the walls.
    pub middle: &'a Track,
    /// The ground.
    pub world: Arc<World>,
    /// Where its surfaces lie.
    pub layout: Layout,
    /// Who drives.
    pub driver: &'a Driver,
    /// Target speed [m/s].
    pub speed_mps: f64,
    /// From there to the walls [m].
    pub half_width_m: f64,
    /// Decides the sensors' noise.
    pub seed: u64,
}

/// Why a turn failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Failure {
    /// Into the wall.
    Collision,
    /// Not moving, or not arriving.
    Stuck,
    /// Turned around, or over.
    Spun,
}

/// What became of a lap.
#[derive(Clone, Debug, Serialize)]
pub struct DrivenLap {
    /// Target speed [m/s].
    pub speed_mps: f64,
    /// Which of the laps at this speed.
    pub lap: u32,
    /// How each turn ended; none did well.
    pub turns: Vec<Option<Failure>>,
    /// Mean distance to the path [m].
    pub mean_distance_m: f64,
    /// Where it drove, a point a command; a break where it was put back [m].
    #[serde(skip)]
    pub path_m: Vec<Vec<[f32; 2]>>,
}

/// Drives a lap: after a failure the car is put back on the path where the next turn begins, at rest.
///
/// # Errors
/// A vehicle or checkpoint that cannot be.
pub fn drive_lap(
    lap: &Lap<'_>,
    index: u32,
    instructions: Instructions,
) -> Result<DrivenLap, KinodynamicsError> {
    let mut driven = DrivenLap {
        speed_mps: lap.speed_mps,
        lap: index,
        turns: vec![None; lap.track.n_turns()],
        mean_distance_m: 0.0,
        path_m: Vec::new(),
    };
    let mut distance = (0.0, 0.0);
    let mut turn = 0;
    while turn < lap.track.n_turns() {
        let mut attempt = Attempt::new(lap, turn, instructions)?;
        let end = attempt.run(lap)?;
        distance.0 += attempt.distance_m;
        distance.1 += attempt.n_samples;
        driven.path_m.push(attempt.path_m);
        let Some((failed, failure)) = end else { break };
        driven.turns[failed] = Some(failure);
        turn = failed + 1;
    }
    driven.mean_distance_m = distance.0 / f64::max(distance.1, 1.0);
    Ok(driven)
}

/// From one start to the next failure or the end of the lap.
struct Attempt {
    machine: Machine,
    asker: Asker,
    way_m: f64,
    /// The same along the middle line.
    middle_m: f64,
    stuck: usize,
    distance_m: f64,
    n_samples: f64,
    path_m: Vec<[f32; 2]>,
}

impl Attempt {
    fn new(lap: &Lap<'_>, turn: usize, instructions: Instructions) -> Result<Self, KinodynamicsError> {
        let way_m = lap.track.turn_begin_m(turn);
        let (on_path, _) = lap.track.place(way_m);
        let (middle_m, _) = lap.middle.project(on_path, 0.0, lap.middle.length_m());
        let ([x_m, y_m], yaw_rad) = lap.middle.place(middle_m);
        let seed = seed_of(lap.seed, &[turn as u64]);
        let mut machine = Machine::new(lap.vehicle, Arc::clone(&lap.world), [x_m, y_m, yaw_rad], seed)?;
        let mut asker = Asker::new(lap.driver, seed, instructions)?;
        for _ in 0..STANDING_TICKS {
            machine.drive([0.0, 0.0], |_| {})?;
            asker.hear(&machine);
        }
        Ok(Self {
            machine,
            asker,
            way_m,
            middle_m,
            stuck: 0,
            distance_m: 0.0,
            n_samples: 0.0,
            path_m: Vec::new(),
        })
    }

    /// Drives until a turn fails or the lap ends.
    fn run(&mut self, lap: &Lap<'_>) -> Result<Option<(usize, Failure)>, KinodynamicsError> {
        let track = lap.track;
        let (first_m, begin_ns) = (self.way_m, self.machine.now_ns());
        loop {
            let wish = self.wish(lap);
            let command = self.asker.ask(wish, &self.machine, &lap.layout);
            let failure = self.advance(lap, command)?;
            self.asker.hear(&self.machine);
            if let Some(failure) = failure {
                return Ok(Some((track.turn_at(self.way_m), failure)));
            }
            if self.way_m >= track.lap_m() {
                return Ok(None);
            }
            let took_s = (self.machine.now_ns() - begin_ns) as f64 * 1e-9;
            let usual_s = (self.way_m - first_m) / lap.speed_mps + 2.0;
            if took_s > SLOW_FACTOR * usual_s {
                return Ok(Some((track.turn_at(self.way_m), Failure::Stuck)));
            }
        }
    }

    /// What the planner wants from where it thinks it is.
    fn wish(&mut self, lap: &Lap<'_>) -> Desired {
        let odometry = self.machine.measure();
        let [x_m, y_m, _] = odometry.position_m;
        let (way_m, _) = lap.track.project([x_m, y_m], self.way_m, REACH_M);
        let pose = [x_m, y_m, odometry.attitude_rad[2]];
        let curvature_per_m = nominal_curvature_per_m(lap.track, pose, way_m) as f32;
        Desired { speed_mps: lap.speed_mps as f32, curvature_per_m }
    }

    fn advance(&mut self, lap: &Lap<'_>, command: [f32; 2]) -> Result<Option<Failure>, KinodynamicsError> {
        let Self { machine, way_m, middle_m, stuck, distance_m, n_samples, path_m, .. } = self;
        let mut failure = None;
        let watch = |plant: &Plant| {
            let motion = plant.motion();
            let pose = motion.pose;
            let (at_m, off_m) = lap.track.project([pose.x_m, pose.y_m], *way_m, REACH_M);
            *way_m = way_m.max(at_m);
            let (beside_m, aside_m) = lap.middle.project([pose.x_m, pose.y_m], *middle_m, REACH_M);
            *middle_m = middle_m.max(beside_m);
            *distance_m += off_m.min(DISTANCE_MAX_M);
            *n_samples += 1.0;
            let is_slow = motion.velocity_mps[0].abs() < STUCK_MPS;
            *stuck = if is_slow { *stuck + 1 } else { 0 };
            let (_, heading_rad) = lap.track.place(*way_m);
            let off_rad = (pose.yaw_rad - heading_rad).sin().atan2((pose.yaw_rad - heading_rad).cos());
            let found = if aside_m > lap.half_width_m {
                Some(Failure::Collision)
            } else if plant.rolled_over() || off_rad.abs() > SPUN_RAD {
                Some(Failure::Spun)
            } else if *stuck > STUCK_SAMPLES {
                Some(Failure::Stuck)
            } else {
                None
            };
            failure = failure.or(found);
        };
        machine.drive(command, watch)?;
        let pose = machine.plant().pose();
        path_m.push([pose.x_m as f32, pose.y_m as f32]);
        Ok(failure)
    }
}

/// What the planner asks for: of a hundred curvatures the one whose arc ends nearest to the point of the path one metre ahead
/// in the line of sight (equation 8) [1/m].
pub(super) fn nominal_curvature_per_m(track: &Track, [x_m, y_m, yaw_rad]: [f64; 3], way_m: f64) -> f64 {
    let carrot = track.carrot([x_m, y_m], way_m, LOOKAHEAD_M);
    let (sin, cos) = yaw_rad.sin_cos();
    let [east_m, north_m] = [carrot[0] - x_m, carrot[1] - y_m];
    best_curvature(cos * east_m + sin * north_m, cos * north_m - sin * east_m)
}

/// The curvature whose arc of one metre ends nearest to a point ahead and to the left [1/m].
fn best_curvature(ahead_m: f64, left_m: f64) -> f64 {
    let candidate = |k: usize| CURVATURE_MAX_PER_M * (2.0 * k as f64 / (CANDIDATES - 1) as f64 - 1.0);
    let square = |curvature: f64| {
        let angle = curvature * LOOKAHEAD_M;
        let [x_m, y_m] = if angle.abs() < 1e-9 {
            [LOOKAHEAD_M, 0.0]
        } else {
            [angle.sin() / curvature, (1.0 - angle.cos()) / curvature]
        };
        (x_m - ahead_m).powi(2) + (y_m - left_m).powi(2)
    };
    (0..CANDIDATES).map(candidate).min_by(|a, b| square(*a).total_cmp(&square(*b))).unwrap_or(0.0)
}

/// A driver with what it has heard.
struct Asker {
    history: ImuHistory,
    model: Option<(InverseModel, Told)>,
    rng: Xoshiro256PlusPlus,
}

impl Asker {
    fn new(driver: &Driver, seed: u64, instructions: Instructions) -> Result<Self, KinodynamicsError> {
        let model = match driver {
            Driver::Baseline => None,
            Driver::Model { checkpoint, told } => {
                Some((InverseModel::new(checkpoint, instructions)?, told.clone()))
            }
        };
        let range = ImuRange::default();
        Ok(Self { history: ImuHistory::new(range), model, rng: stream(seed, &[9]) })
    }

    fn hear(&mut self, machine: &Machine) {
        machine.samples().iter().for_each(|sample| self.history.push(sample));
    }

    /// Speed and curvature to command.
    fn ask(&mut self, wish: Desired, machine: &Machine, layout: &Layout) -> [f32; 2] {
        let Some((model, told)) = &mut self.model else { return [wish.speed_mps, wish.curvature_per_m] };
        match told {
            Told::Measured if model.senses() => match self.history.window(machine.now_ns(), 50_000_000) {
                Ok(samples) => model.sense(samples),
                Err(_) => return [wish.speed_mps, wish.curvature_per_m],
            },
            Told::Measured => {}
            Told::Known => model.tell(&layout.coefficients_under(machine.plant())),
            Told::Shuffled(windows) => {
                let drawn = self.rng.random_range(0..windows.len());
                model.sense_columns(&windows[drawn]);
            }
            Told::Constant(window) => model.sense_columns(window),
        }
        let commanded = model.command(wish);
        [commanded.speed_mps, commanded.curvature_per_m]
    }
}

const _: () = assert!(STANDING_TICKS * 10 > WINDOW, "the history is full before the start");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_curvature_meets_the_carrot() {
        // The arc of curvature c and length 1 m ends at (sin c / c, (1 - cos c) / c).
        for curvature in [-1.2, -0.4, 0.3, 0.9f64] {
            let found = best_curvature(curvature.sin() / curvature, (1.0 - curvature.cos()) / curvature);
            assert!((found - curvature).abs() <= 0.5 * 2.7 / 99.0 + 1e-9, "{curvature} {found}");
        }
        assert!((best_curvature(0.0, 1.0) - CURVATURE_MAX_PER_M).abs() < 1e-9, "as tight as it may");
    }
}
