//! What is kept of a bag that is played: the recording, the ground as it was seen, every decision, and what was left out.

use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::path::Path;

use bicycle::{Applied, Decision, Odometry, State};
use bus::message::drive_row;
use formats::DriveRecorder;
use navigator::Navigator;
use report::drive::PathSample;
use scenarios::{Bounds, Patch, Stribeck, World};
use serde::Serialize;
use terrain::{GridMap, Pose};

use crate::UsageError;
use crate::arguments::PlayArguments;
use crate::drive::record::KnownRisk;
use crate::drive::scene::Machine;
use crate::summary::revision;

/// Rollouts shown per recorded decision.
const N_ROLLOUTS: usize = 12;
/// Decisions between two recorded maps.
const DECISIONS_PER_MAP: usize = 10;
/// Cells of the ground at the most: a drive that goes further is refused, as the picture shows all of it.
const CELLS_MAX: f64 = 16e6;
/// Farthest place that is believed [m].
const CORNER_MAX_M: f64 = 1e8;
/// Poses of the way that are shown with every map.
const POSES_SHOWN: usize = 600;

/// A decision, and what it was made from.
pub(super) struct Cycle<'a> {
    pub at_ns: u64,
    pub decision: Decision,
    pub navigator: &'a Navigator,
    pub goal_m: [f64; 2],
}

/// A decision beside what the vehicle did.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Decided {
    /// Since the first one [s].
    time_s: f64,
    /// drive, or hold or stop with the reason.
    decision: String,
    /// What would have been commanded [m/s].
    speed_mps: Option<f32>,
    /// What would have been commanded [rad].
    steering_rad: Option<f32>,
    /// What the bag says that was commanded, else what the vehicle did [m/s].
    was_speed_mps: f32,
    /// The same [rad].
    was_steering_rad: f32,
}

/// How a bag ended.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Ending {
    /// Where and why it breaks off; null of one that is whole.
    pub ended_early: Option<String>,
    /// Whether the user ended it before.
    pub is_interrupted: bool,
}

/// The result, as `play.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct PlaySummary {
    /// The bag as it was named.
    pub bag: String,
    /// How it ended.
    #[serde(flatten)]
    pub ending: Ending,
    /// Time between the first and the last decision [s].
    duration_s: f64,
    odometry: u64,
    scans: u64,
    decisions: usize,
    /// How often each was decided.
    decided: BTreeMap<String, u64>,
    /// Mean absolute difference of driving decisions to what was commanded or done [m/s].
    speed_difference_mps: Option<f64>,
    /// The same [rad].
    steering_difference_rad: Option<f64>,
    /// The goal that counted last [m].
    pub goal_m: [f64; 2],
    /// How near to it is there [m].
    pub tolerance_m: f64,
    /// Messages of topics that were left out, and why the first was.
    pub left_out: BTreeMap<String, String>,
    revision: &'static str,
    /// Every decision.
    each: Vec<Decided>,
}

/// What is kept.
pub(super) struct Kept {
    recorder: Option<DriveRecorder>,
    risk: KnownRisk,
    height_m: GridMap<f32>,
    driven: Vec<PathSample>,
    poses: Vec<Pose>,
    decided: Vec<Decided>,
    last: Option<(Odometry, Applied)>,
    began_ns: Option<u64>,
    n_odometry: u64,
    n_scans: u64,
    tolerance_m: f64,
    left_out: BTreeMap<String, (u64, String)>,
}

impl Kept {
    /// Of a drive within these bounds.
    pub(super) fn create(
        path: &Path,
        machine: &Machine,
        tolerance_m: f64,
        bounds: Bounds,
    ) -> anyhow::Result<Self> {
        let resolution_m = machine.config.risk_resolution_m();
        check_extent(&bounds, resolution_m)?;
        let risk = KnownRisk::new(bounds, resolution_m, &machine.vehicle.limits);
        let about = BTreeMap::from([("vehicle".to_owned(), machine.vehicle.name.clone())]);
        Ok(Self {
            recorder: Some(DriveRecorder::create(path, about).map_err(UsageError::from_input)?),
            height_m: GridMap::filled(*risk.traction.geometry(), f32::NAN),
            risk,
            driven: Vec::new(),
            poses: Vec::new(),
            decided: Vec::new(),
            last: None,
            began_ns: None,
            n_odometry: 0,
            n_scans: 0,
            tolerance_m,
            left_out: BTreeMap::new(),
        })
    }

    pub(super) fn left_out(&mut self, topic: &str, why: &dyn Display) {
        let note = || (0, why.to_string());
        self.left_out.entry(topic.to_owned()).or_insert_with(note).0 += 1;
    }

    pub(super) fn odometry(&mut self, odometry: &Odometry, applied: &Applied) {
        self.n_odometry += 1;
        self.last = Some((*odometry, *applied));
    }

    pub(super) fn scan(&mut self) {
        self.n_scans += 1;
    }

    /// Takes over a decision.
    pub(super) fn cycle(&mut self, cycle: &Cycle<'_>) -> anyhow::Result<()> {
        let Some((odometry, applied)) = self.last else { return Ok(()) };
        let began_ns = *self.began_ns.get_or_insert(cycle.at_ns);
        let time_s = cycle.at_ns.saturating_sub(began_ns) as f64 * 1e-9;
        self.driven.push(sample(time_s, &odometry));
        self.decided.push(decided(time_s, &cycle.decision, &applied));
        self.record(cycle, &odometry, &applied, time_s)?;
        if self.decided.len() % DECISIONS_PER_MAP == 1 {
            self.map(cycle, &odometry)?;
        }
        Ok(())
    }

    fn record(
        &mut self,
        cycle: &Cycle<'_>,
        odometry: &Odometry,
        applied: &Applied,
        time_s: f64,
    ) -> anyhow::Result<()> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        let (at_ns, pose) = (cycle.at_ns, pose(odometry));
        self.poses.push(pose);
        recorder.pose(at_ns, &pose)?;
        recorder.decision(at_ns, &cycle.decision)?;
        recorder.controller(at_ns, cycle.navigator.controller().diagnostics())?;
        let was = [applied.command.speed_mps, applied.command.steering_rad].map(f64::from);
        recorder.drive_row(at_ns, "", &drive_row(time_s, odometry, was))?;
        let Decision::Drive(command) = &cycle.decision else { return Ok(()) };
        recorder.command(at_ns, command)?;
        let Some(map) = cycle.navigator.risk_map() else { return Ok(()) };
        let best = cycle.navigator.controller().best_rollouts(N_ROLLOUTS, map);
        let place = |state: &State| [state.x_m, state.y_m, pose.z_m];
        let lines: Vec<Vec<[f64; 3]>> =
            best.iter().map(|rollout| rollout.states.iter().map(place).collect()).collect();
        Ok(recorder.rollouts(at_ns, &lines)?)
    }

    fn map(&mut self, cycle: &Cycle<'_>, odometry: &Odometry) -> anyhow::Result<()> {
        let (at_ns, pose) = (cycle.at_ns, pose(odometry));
        self.see(cycle.navigator);
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        let [x_m, y_m] = cycle.goal_m;
        recorder.goal(at_ns, &Pose { x_m, y_m, z_m: pose.z_m, ..Pose::default() })?;
        let shown = self.poses.len().saturating_sub(POSES_SHOWN);
        recorder.path(at_ns, &self.poses[shown..])?;
        recorder.elevation(at_ns, cycle.navigator.surface())?;
        if let Some(map) = cycle.navigator.risk_map() {
            recorder.risk(at_ns, &map, pose.yaw_rad)?;
        }
        Ok(())
    }

    /// Takes over what the windows show.
    fn see(&mut self, navigator: &Navigator) {
        if let Some(map) = navigator.risk_map() {
            self.risk.update(&map);
        }
        let (surface, ground) = (navigator.surface(), *self.height_m.geometry());
        for (index, cell) in surface.values().iter().enumerate() {
            let [x_m, y_m] = surface.geometry().centre_m(surface.geometry().cell(index));
            if let Some(place) = ground.cell_at(x_m, y_m).filter(|_| cell.height_m.is_finite()) {
                self.height_m[place] = cell.height_m;
            }
        }
    }

    /// Writes the recording to its end.
    pub(super) fn finish_recording(&mut self) -> anyhow::Result<()> {
        self.recorder.take().map_or(Ok(()), |recorder| Ok(recorder.finish()?))
    }

    pub(super) fn driven(&self) -> &[PathSample] {
        &self.driven
    }

    pub(super) fn traction(&self) -> &GridMap<f32> {
        &self.risk.traction
    }

    pub(super) fn unfamiliar(&self) -> &GridMap<bool> {
        &self.risk.unfamiliar
    }

    /// Where the ground was ever seen.
    pub(super) fn known(&self) -> Option<GridMap<bool>> {
        let seen = self.height_m.values().iter().map(|height_m| height_m.is_finite()).collect();
        GridMap::from_values(*self.height_m.geometry(), seen)
    }

    /// The ground as it was seen, level where it was not.
    pub(super) fn world(&self) -> anyhow::Result<World> {
        let known = self.height_m.values().iter().filter(|height_m| height_m.is_finite());
        let (n, sum) = known.fold((0_u64, 0.0), |(n, sum), height_m| (n + 1, sum + f64::from(*height_m)));
        let level_m = if n == 0 { 0.0 } else { sum / n as f64 };
        let at =
            |x_m: f64, y_m: f64| self.height_m.at(x_m, y_m).copied().filter(|height_m| height_m.is_finite());
        let height_m = |x_m: f64, y_m: f64| at(x_m, y_m).map_or(level_m, f64::from);
        Ok(World::from_fn("as seen", *self.height_m.geometry(), height_m, |_, _| {
            Patch::open(Stribeck::DIRT)
        })?)
    }

    pub(super) fn summary(&self, arguments: &PlayArguments, goal_m: [f64; 2], ending: Ending) -> PlaySummary {
        let mut counts: BTreeMap<String, u64> = BTreeMap::new();
        self.decided.iter().for_each(|decided| *counts.entry(decided.decision.clone()).or_default() += 1);
        let note = |(topic, (n, why)): (&String, &(u64, String))| {
            (topic.clone(), format!("{n} left out, the first for {why}"))
        };
        let differences = |difference: fn(&Decided) -> Option<f32>| {
            let found: Vec<f64> =
                self.decided.iter().filter_map(difference).map(f64::from).map(f64::abs).collect();
            (!found.is_empty()).then(|| found.iter().sum::<f64>() / found.len() as f64)
        };
        PlaySummary {
            bag: arguments.bag.display().to_string(),
            ending,
            duration_s: self.decided.last().map_or(0.0, |last| last.time_s),
            odometry: self.n_odometry,
            scans: self.n_scans,
            decisions: self.decided.len(),
            decided: counts,
            speed_difference_mps: differences(|one| Some(one.speed_mps? - one.was_speed_mps)),
            steering_difference_rad: differences(|one| Some(one.steering_rad? - one.was_steering_rad)),
            goal_m,
            tolerance_m: self.tolerance_m,
            left_out: self.left_out.iter().map(note).collect(),
            revision: revision(),
            each: self.decided.clone(),
        }
    }
}

impl Display for PlaySummary {
    fn fmt(&self, line: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { duration_s, odometry, scans, decisions, decided, .. } = self;
        write!(line, "{duration_s:.1} s: {odometry} odometry, {scans} clouds, {decisions} decisions\n  ")?;
        let counts: Vec<String> = decided.iter().map(|(decision, n)| format!("{decision} {n}")).collect();
        write!(line, "{}", counts.join(", "))?;
        if let (Some(speed_mps), Some(steering_rad)) =
            (self.speed_difference_mps, self.steering_difference_rad)
        {
            write!(
                line,
                "\n  away from what was driven by {speed_mps:.2} m/s and {steering_rad:.3} rad in the mean"
            )?;
        }
        Ok(())
    }
}

fn check_extent(bounds: &Bounds, resolution_m: f64) -> Result<(), UsageError> {
    let n_cells = |axis: usize| (bounds.north_east_m[axis] - bounds.south_west_m[axis]) / resolution_m;
    let [n_cols, n_rows] = [n_cells(0), n_cells(1)];
    let mut corners_m = bounds.south_west_m.into_iter().chain(bounds.north_east_m);
    if corners_m.all(|at_m| at_m.abs() <= CORNER_MAX_M) && n_cols.max(1.0) * n_rows.max(1.0) <= CELLS_MAX {
        return Ok(());
    }
    Err(UsageError(format!(
        "expected a drive within at most {CELLS_MAX:e} cells of {resolution_m} m and {CORNER_MAX_M:e} m from the origin, \
         found one over {n_cols:.0} x {n_rows:.0} cells; cut the bag into parts"
    )))
}

fn pose(odometry: &Odometry) -> Pose {
    let ([x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]) = (odometry.position_m, odometry.attitude_rad);
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
}

fn sample(time_s: f64, odometry: &Odometry) -> PathSample {
    let Pose { x_m, y_m, roll_rad, pitch_rad, yaw_rad, .. } = pose(odometry);
    PathSample { time_s, x_m, y_m, yaw_rad, speed_mps: odometry.velocity_mps[0], roll_rad, pitch_rad }
}

fn decided(time_s: f64, decision: &Decision, applied: &Applied) -> Decided {
    let (word, command) = match decision {
        Decision::Drive(command) => ("drive".to_owned(), Some(command)),
        Decision::Hold(reason) => (format!("hold: {reason:?}"), None),
        Decision::Stop(reason) => (format!("stop: {reason:?}"), None),
    };
    Decided {
        time_s,
        decision: word,
        speed_mps: command.map(|command| command.speed_mps),
        steering_rad: command.map(|command| command.steering_rad),
        was_speed_mps: applied.command.speed_mps,
        was_steering_rad: applied.command.steering_rad,
    }
}
