//! AnyNav's table 7 with a slow reference in the place of human drivers: our routes and its lines, planned and driven.

use bicycle::Vehicle;
use scenarios::{Landscape, LandscapeKind, RouteTask};
use serde::Serialize;

use super::method::{Method, known};
use super::plan::{MethodPlanner, Plan, config, limits};
use super::reference::ReferencePlanner;
use super::track::{self, ARRIVED_M, Driven, End, PdFollower, TrackError};
use super::{RouteBenchError, unbound};
use crate::statistics::Mean;
use crate::stopwatch::timed_ms;
use crate::sweep::in_turns;

/// A plan of a task, and its drive.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Attempt {
    /// Time that planning took [s].
    pub planning_s: f64,
    /// Length of the line [m].
    pub length_m: f64,
    /// What the plan takes to the place that counts as the goal [s].
    pub expected_s: f64,
    /// How the drive ended.
    pub end: End,
    /// Until then [s].
    pub time_s: f64,
}

/// Both on the same task.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pair {
    /// Where.
    pub landscape: LandscapeKind,
    /// Number of the task.
    pub task: usize,
    /// Our planner's.
    pub ours: Attempt,
    /// The slow one's.
    pub reference: Attempt,
}

/// A landscape.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ExpertRow {
    /// Where.
    pub landscape: LandscapeKind,
    /// Tasks to which our planner found a way.
    pub n: usize,
    /// Drives at the goal: ours, the reference's.
    pub n_success: [usize; 2],
    /// Times of those: ours, the reference's [s].
    pub time_s: [Option<Mean>; 2],
    /// Expected time of ours over the reference's, task by task [-].
    pub expected_ratio: Option<Mean>,
    /// Driven time of ours over the reference's, where both arrived [-].
    pub driven_ratio: Option<Mean>,
    /// Time that planning took: ours, the reference's [s].
    pub planning_s: [Option<Mean>; 2],
}

/// What came out.
#[derive(Clone, Debug, Serialize)]
pub struct ExpertReport {
    /// Who drove.
    pub vehicle: String,
    /// Of the landscapes and the tasks.
    pub seed: u64,
    /// By landscape.
    pub rows: Vec<ExpertRow>,
    /// Every task.
    pub pairs: Vec<Pair>,
}

/// Plans and drives `n_tasks` in each landscape of a seed; `after` is called after each.
///
/// # Errors
/// A landscape without enough tasks, or a vehicle that cannot be driven.
pub fn measure_reference(
    vehicle: &Vehicle,
    (seed, n_tasks, n_threads): (u64, usize, usize),
    after: impl Fn() + Sync,
) -> Result<ExpertReport, RouteBenchError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
    let free = unbound(vehicle);
    let mut pairs = Vec::new();
    for kind in LandscapeKind::ALL {
        let landscape = Landscape::new(kind, seed)?;
        let (tasks, known) = (landscape.tasks(n_tasks)?, known(&landscape));
        let ours = MethodPlanner::new(Method::Ours, &known, &landscape, &free)?;
        let reference = ReferencePlanner::new(&known, config(&free), limits(&free))?;
        let course = Course { landscape: &landscape, vehicle: &free };
        let of_landscape = in_turns(&pool, tasks.len(), |task| {
            let pair = course.pair(&ours, &reference, (task, &tasks[task]))?;
            after();
            Ok::<_, TrackError>(pair)
        })?;
        pairs.extend(of_landscape.into_iter().flatten());
    }
    let row = |kind: &LandscapeKind| ExpertRow::of(*kind, &pairs);
    let rows = LandscapeKind::ALL.iter().map(row).collect();
    Ok(ExpertReport { vehicle: vehicle.name.clone(), seed, rows, pairs })
}

/// Where is driven, and by whom.
struct Course<'a> {
    landscape: &'a Landscape,
    vehicle: &'a Vehicle,
}

impl Course<'_> {
    /// Both on a task; `None` where our planner finds no way.
    fn pair(
        &self,
        ours: &MethodPlanner,
        reference: &ReferencePlanner,
        (index, task): (usize, &RouteTask),
    ) -> Result<Option<Pair>, TrackError> {
        let planned = timed_ms(|| ours.plan(task).ok());
        let laid = timed_ms(|| reference.plan(task));
        let (Some(ours), Some(reference)) = (self.attempt(task, planned)?, self.attempt(task, laid)?) else {
            return Ok(None);
        };
        Ok(Some(Pair { landscape: self.landscape.kind, task: index, ours, reference }))
    }

    fn attempt(
        &self,
        task: &RouteTask,
        (planning_ms, plan): (f64, Option<Plan>),
    ) -> Result<Option<Attempt>, TrackError> {
        let Some(plan) = plan else { return Ok(None) };
        let mut follower = PdFollower::of(self.vehicle);
        let Driven { end, time_s, .. } =
            track::drive(self.landscape, self.vehicle, task, &plan, &mut follower)?;
        let length_m = plan.spacing_m * plan.points.len().saturating_sub(1) as f64;
        let expected_s = plan.duration_s(ARRIVED_M);
        Ok(Some(Attempt { planning_s: 1e-3 * planning_ms, length_m, expected_s, end, time_s }))
    }
}

impl ExpertRow {
    fn of(landscape: LandscapeKind, pairs: &[Pair]) -> Self {
        let pairs: Vec<&Pair> = pairs.iter().filter(|pair| pair.landscape == landscape).collect();
        let sides: [fn(&Pair) -> Attempt; 2] = [|pair| pair.ours, |pair| pair.reference];
        let arrived = |side: fn(&Pair) -> Attempt| {
            let attempts = pairs.iter().map(move |pair| side(pair));
            attempts.filter(|attempt| attempt.end == End::Goal).map(|attempt| attempt.time_s)
        };
        let over = |of: fn(&Attempt) -> f64| move |pair: &&&Pair| of(&pair.ours) / of(&pair.reference);
        let both = pairs.iter().filter(|pair| sides.iter().all(|side| side(pair).end == End::Goal));
        let mean = |values: Vec<f64>| Mean::of(&values);
        Self {
            landscape,
            n: pairs.len(),
            n_success: sides.map(|side| arrived(side).count()),
            time_s: sides.map(|side| mean(arrived(side).collect())),
            expected_ratio: mean(
                pairs.iter().map(|pair| over(|attempt| attempt.expected_s)(&pair)).collect(),
            ),
            driven_ratio: mean(both.map(|pair| over(|attempt| attempt.time_s)(&pair)).collect()),
            planning_s: sides.map(|side| mean(pairs.iter().map(|pair| side(pair).planning_s).collect())),
        }
    }
}
