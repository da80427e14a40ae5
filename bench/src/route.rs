//! AnyNav's table 6: routes planned with and without knowledge of friction, driven by the plant (Fu et al. 2025, section
//! 5.3).
//!
//! Two landscapes with 50 starts and goals each. Every row plans on the same heights, roughness and obstacles with what it
//! knows of friction; what it planned is driven on the true ground, whose friction is another. The plan knows the published
//! friction of each ground, the plant up to a tenth more or less of it.

mod experts;
pub mod grip;
mod method;
mod mppi_follower;
mod plan;
mod published;
mod reference;
mod row;
mod rules;
pub mod timing;
mod track;

use bicycle::Vehicle;
use route::{PlannerError, RouteError, RoutePoint};
use scenarios::{Landscape, LandscapeError, LandscapeKind, RouteTask};
use serde::Serialize;
use thiserror::Error;

use crate::Verdict;
use crate::sweep::in_turns;
pub use experts::{Attempt, ExpertReport, ExpertRow, Pair, measure_reference};
pub use method::Method;
use method::known;
use mppi_follower::MppiFollower;
use plan::{MethodPlanner, Plan};
pub use published::{Published, published};
pub use row::{Comparison, Drive, Row, Tracking};
use track::{ARRIVED_M, Driven, PdFollower};
pub use track::{End, TrackError};

/// Seeds below this are for development; what is published comes from this one.
pub const WITHHELD_SEED: u64 = 1000;
/// Tasks in a landscape.
pub const N_TASKS: usize = 50;

/// What to drive.
#[derive(Clone, Debug)]
pub struct Request {
    /// Who drives.
    pub vehicle: Vehicle,
    /// Of the landscapes and the tasks.
    pub seed: u64,
    /// Tasks in each landscape.
    pub n_tasks: usize,
    /// Of those, tasks that the controller drives, too, along our routes.
    pub n_mppi_tasks: usize,
    /// Rows of the table.
    pub methods: Vec<Method>,
    /// Threads.
    pub n_threads: usize,
}

/// What came out.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Who drove.
    pub vehicle: String,
    /// Of the landscapes and the tasks.
    pub seed: u64,
    /// Methods in landscapes.
    pub rows: Vec<Row>,
    /// Each of them beside ours.
    pub comparisons: Vec<Comparison>,
    /// The rules, where all rows were driven.
    pub verdicts: Vec<Verdict>,
    /// Every drive.
    pub drives: Vec<Drive>,
    /// A task of each landscape to look at.
    #[serde(skip)]
    pub shown: Vec<Shown>,
}

/// The routes of a task, on its landscape.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Where.
    pub landscape: Landscape,
    /// Number of the task.
    pub task: usize,
    /// Who planned, with which points and speeds, and how the drive ended.
    pub routes: Vec<ShownRoute>,
}

/// One line with speeds.
#[derive(Clone, Debug)]
pub struct ShownRoute {
    /// Who planned it.
    pub method: Method,
    /// Its points.
    pub points: Vec<RoutePoint>,
    /// The drive along it.
    pub drive: Drive,
}

/// Whose routes are shown: AnyNav's figures 15 to 17.
const SHOWN: [Method; 3] = [Method::Constant50, Method::NoSteering, Method::Ours];

/// Why there is no table.
#[derive(Debug, Error)]
pub enum RouteBenchError {
    /// There is no such landscape.
    #[error(transparent)]
    Landscape(#[from] LandscapeError),
    /// Its map cannot be searched.
    #[error(transparent)]
    Planner(#[from] PlannerError),
    /// The plant or the controller gave up.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// How many drives a request takes.
pub fn n_drives(request: &Request) -> usize {
    let has_ours = request.methods.contains(&Method::Ours);
    let n_mppi = if has_ours { request.n_mppi_tasks.min(request.n_tasks) } else { 0 };
    LandscapeKind::ALL.len() * (request.methods.len() * request.n_tasks + n_mppi)
}

/// A vehicle as the table's drives allow it to be driven: as fast and as hard as its ground and motor make it.
pub fn unbound(vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    vehicle.limits.speed_max_mps = vehicle.limits.speed_max_mps.max(12.0);
    vehicle.limits.acceleration_max_mps2 = vehicle.limits.acceleration_max_mps2.max(8.0);
    vehicle.limits.lateral_acceleration_max_mps2 = vehicle.limits.lateral_acceleration_max_mps2.max(8.0);
    vehicle
}

/// Plans and drives; `after` is called after each drive.
///
/// # Errors
/// A landscape without enough tasks, or a vehicle that cannot be driven.
pub fn measure(request: &Request, after: impl Fn() + Sync) -> Result<Report, RouteBenchError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let vehicle = unbound(&request.vehicle);
    let (mut drives, mut shown) = (Vec::new(), Vec::new());
    for kind in LandscapeKind::ALL {
        let landscape = Landscape::new(kind, request.seed)?;
        let tasks = landscape.tasks(request.n_tasks)?;
        let field = Field { landscape: &landscape, tasks: &tasks, vehicle: &vehicle };
        let known = known(&landscape);
        let mut of_landscape = Vec::new();
        for method in &request.methods {
            let planner = MethodPlanner::new(*method, &known, &landscape, &vehicle)?;
            let with = |tracking: Tracking, n: usize| {
                in_turns(&pool, n, |task| {
                    let drive = field.drive(&planner, *method, tracking, task)?;
                    after();
                    Ok::<_, TrackError>(drive)
                })
            };
            of_landscape.extend(with(Tracking::Pd, tasks.len())?);
            if *method == Method::Ours {
                of_landscape.extend(with(Tracking::Mppi, request.n_mppi_tasks.min(tasks.len()))?);
            }
        }
        drives.extend(of_landscape.iter().map(|(drive, _)| drive.clone()));
        shown.extend(show(landscape.clone(), &of_landscape));
    }
    Ok(report(request, drives, shown))
}

/// What all drives in a landscape have in common.
struct Field<'a> {
    landscape: &'a Landscape,
    tasks: &'a [RouteTask],
    vehicle: &'a Vehicle,
}

impl Field<'_> {
    fn drive(
        &self,
        planner: &MethodPlanner,
        method: Method,
        tracking: Tracking,
        index: usize,
    ) -> Result<(Drive, Option<Plan>), TrackError> {
        let task = &self.tasks[index];
        let plan = match planner.plan(task) {
            Ok(plan) => plan,
            Err(error) => return Ok((self.refused(method, tracking, index, &error), None)),
        };
        let driven = match tracking {
            Tracking::Pd => {
                let mut follower = PdFollower::of(self.vehicle);
                track::drive(self.landscape, self.vehicle, task, &plan, &mut follower)?
            }
            Tracking::Mppi => {
                let mut follower = MppiFollower::new(self.landscape, self.vehicle, index as u64)?;
                track::drive(self.landscape, self.vehicle, task, &plan, &mut follower)?
            }
        };
        let Driven { end, time_s, off_max_m, at_m } = driven;
        let expected_s = (method != Method::Appearance).then(|| plan.duration_s(ARRIVED_M));
        let length_m = plan.spacing_m * plan.points.len().saturating_sub(1) as f64;
        let landscape = self.landscape.kind;
        let drive = Drive {
            landscape,
            method,
            tracking,
            task: index,
            end,
            time_s,
            expected_s,
            length_m,
            off_max_m,
            at_m,
            refused: None,
        };
        Ok((drive, Some(plan)))
    }

    fn refused(&self, method: Method, tracking: Tracking, task: usize, error: &RouteError) -> Drive {
        Drive {
            landscape: self.landscape.kind,
            method,
            tracking,
            task,
            end: End::NoRoute,
            time_s: 0.0,
            expected_s: None,
            length_m: 0.0,
            off_max_m: 0.0,
            at_m: self.tasks[task].start_m,
            refused: Some(error.to_string()),
        }
    }
}

/// The task whose routes with and without knowledge of friction lie farthest apart, where ours arrives.
fn show(landscape: Landscape, drives: &[(Drive, Option<Plan>)]) -> Option<Shown> {
    let of = |method: Method, task: usize| {
        let is_it = |(drive, _): &&(Drive, Option<Plan>)| {
            (drive.method, drive.task, drive.tracking) == (method, task, Tracking::Pd)
        };
        let (drive, plan) = drives.iter().find(is_it)?;
        Some(ShownRoute { method, points: plan.as_ref()?.points.clone(), drive: drive.clone() })
    };
    let routes = |task: usize| SHOWN.into_iter().map(|method| of(method, task)).collect::<Option<Vec<_>>>();
    let n_tasks = drives.iter().map(|(drive, _)| drive.task + 1).max()?;
    let candidates = (0..n_tasks).filter_map(|task| Some((task, routes(task)?)));
    let arrived = candidates.filter(|(_, routes)| routes[2].drive.end == End::Goal);
    let apart = |routes: &[ShownRoute]| apart_m(&routes[0].points, &routes[2].points);
    let (task, routes) = arrived.max_by(|a, b| apart(&a.1).total_cmp(&apart(&b.1)))?;
    Some(Shown { landscape, task, routes })
}

/// How far a line strays from another at most [m].
fn apart_m(line: &[RoutePoint], other: &[RoutePoint]) -> f64 {
    let away_m = |point: &RoutePoint| {
        let to = |other: &RoutePoint| (point.at_m[0] - other.at_m[0]).hypot(point.at_m[1] - other.at_m[1]);
        other.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    line.iter().map(away_m).fold(0.0, f64::max)
}

fn report(request: &Request, drives: Vec<Drive>, shown: Vec<Shown>) -> Report {
    let of = |landscape: LandscapeKind, method: Method, tracking: Tracking| {
        let is_it = move |drive: &&Drive| {
            (drive.landscape, drive.method, drive.tracking) == (landscape, method, tracking)
        };
        drives.iter().filter(is_it).collect::<Vec<&Drive>>()
    };
    let kinds = LandscapeKind::ALL.into_iter().flat_map(|landscape| {
        let methods = request.methods.iter().map(move |method| (landscape, *method, Tracking::Pd));
        methods.chain([(landscape, Method::Ours, Tracking::Mppi)])
    });
    let (mut rows, mut comparisons) = (Vec::new(), Vec::new());
    for (landscape, method, tracking) in kinds {
        let drives = of(landscape, method, tracking);
        rows.extend(Row::of(&drives));
        if (method, tracking) != (Method::Ours, Tracking::Pd) {
            comparisons.extend(Comparison::of(&drives, &of(landscape, Method::Ours, Tracking::Pd)));
        }
    }
    let is_whole = Method::ALL.iter().all(|method| request.methods.contains(method));
    let table = rules::Table { rows: &rows, comparisons: &comparisons };
    let verdicts = if is_whole { table.verdicts() } else { Vec::new() };
    let vehicle = request.vehicle.name.clone();
    Report { vehicle, seed: request.seed, verdicts, rows, comparisons, drives, shown }
}
