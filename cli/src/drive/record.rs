//! What is kept of a drive while it runs: the recording, and the map as it was known for the picture.

use std::collections::BTreeMap;
use std::path::Path;

use bench::closed_loop::{ClosedLoop, Cycle};
use bicycle::State;
use formats::{DriveRecorder, RecordError};
use scenarios::{Bounds, Observation, World};
use terrain::{GridGeometry, GridMap, Pose};
use traversability::{GroundFlags, RiskMapView};

use report::drive::PathSample;

/// Rollouts shown per recorded cycle.
const N_ROLLOUTS: usize = 12;
/// Cycles between two recorded maps: one a second.
const CYCLES_PER_MAP: u64 = 10;
/// Cycles between two recorded sets of rollouts.
const CYCLES_PER_ROLLOUTS: u64 = 2;

/// Writes every cycle into the recording.
pub(super) struct Recording {
    recorder: DriveRecorder,
    driven: Vec<Pose>,
}

impl Recording {
    pub fn create(path: &Path, about: BTreeMap<String, String>) -> Result<Self, RecordError> {
        Ok(Self { recorder: DriveRecorder::create(path, about)?, driven: Vec::new() })
    }

    /// Notes the goal once, at the height of the ground there.
    pub fn goal(&mut self, world: &World, goal_m: [f64; 2]) -> Result<(), RecordError> {
        let [x_m, y_m] = goal_m;
        self.recorder.goal(0, &Pose { x_m, y_m, z_m: world.height_m(x_m, y_m), ..Pose::default() })
    }

    /// Notes the cycle that has just been driven, and what was measured when it began.
    pub fn cycle(
        &mut self,
        closed: &ClosedLoop,
        cycle: &Cycle,
        measured: &Observation,
    ) -> Result<(), RecordError> {
        let Some(row) = closed.episode.trace().last() else { return Ok(()) };
        let at_ns = (row.time_s * 1e9).round() as u64;
        let pose = row.motion.pose;
        self.driven.push(pose);
        self.recorder.pose(at_ns, &pose)?;
        self.recorder.command(at_ns, &row.command)?;
        self.recorder.decision(at_ns, &cycle.decision)?;
        self.recorder.controller(at_ns, closed.navigator.controller().diagnostics())?;
        self.recorder.drive_row(at_ns, "1", &row.measured_row(&measured.odometry))?;
        let number = closed.episode.n_cycles() - 1;
        if number.is_multiple_of(CYCLES_PER_ROLLOUTS) {
            self.rollouts(at_ns, closed, pose.z_m)?;
        }
        if number.is_multiple_of(CYCLES_PER_MAP) {
            self.maps(at_ns, closed, &pose)?;
            measured.scan.as_ref().map_or(Ok(()), |scan| self.recorder.scan(at_ns, scan))?;
        }
        Ok(())
    }

    /// Completes the file.
    pub fn finish(self) -> Result<(), RecordError> {
        self.recorder.finish()
    }

    fn rollouts(&mut self, at_ns: u64, closed: &ClosedLoop, z_m: f64) -> Result<(), RecordError> {
        let Some(map) = closed.navigator.risk_map() else { return Ok(()) };
        let best = closed.navigator.controller().best_rollouts(N_ROLLOUTS, map);
        let place = |state: &State| [state.x_m, state.y_m, z_m];
        let lines: Vec<Vec<[f64; 3]>> =
            best.iter().map(|rollout| rollout.states.iter().map(place).collect()).collect();
        self.recorder.rollouts(at_ns, &lines)
    }

    fn maps(&mut self, at_ns: u64, closed: &ClosedLoop, pose: &Pose) -> Result<(), RecordError> {
        self.recorder.path(at_ns, &self.driven)?;
        self.recorder.elevation(at_ns, closed.navigator.surface())?;
        if let Some(map) = closed.navigator.risk_map() {
            self.recorder.risk(at_ns, &map, pose.yaw_rad)?;
        }
        Ok(())
    }
}

/// The risk of every place as it was last known.
pub(crate) struct KnownRisk {
    /// Worst expected linear traction, zero in headings that break a limit, mean over all headings; NaN where the
    /// ground was never known.
    pub traction: GridMap<f32>,
    /// Where it was unlike what the networks were trained on.
    pub unfamiliar: GridMap<bool>,
    roll_max_rad: f32,
    pitch_max_rad: f32,
}

impl KnownRisk {
    pub fn new(bounds: Bounds, resolution_m: f64, limits: &bicycle::Limits) -> Self {
        let first = bounds.south_west_m.map(|edge_m| (edge_m / resolution_m).floor() as i64);
        let last = bounds.north_east_m.map(|edge_m| (edge_m / resolution_m).ceil() as i64);
        let [n_cols, n_rows] = [0, 1].map(|axis| (last[axis] - first[axis]) as usize);
        let geometry = GridGeometry { resolution_m, origin: first, n_rows, n_cols };
        Self {
            traction: GridMap::filled(geometry, f32::NAN),
            unfamiliar: GridMap::filled(geometry, false),
            roll_max_rad: limits.roll_max_rad as f32,
            pitch_max_rad: limits.pitch_max_rad as f32,
        }
    }

    /// Takes over what the window shows.
    pub fn update(&mut self, map: &RiskMapView<'_>) {
        let (all, window) = (*self.traction.geometry(), map.geometry);
        let offset = [0, 1].map(|axis| window.origin[axis] - all.origin[axis]);
        let place = |i: usize, by: i64, n: usize| usize::try_from(i as i64 + by).ok().filter(|&j| j < n);
        // The outermost ring is closed by construction and says nothing of the ground.
        for row in 1..window.n_rows - 1 {
            let Some(all_row) = place(row, offset[1], all.n_rows) else { continue };
            for col in 1..window.n_cols - 1 {
                let Some(all_col) = place(col, offset[0], all.n_cols) else { continue };
                let cell = terrain::Cell { row, col };
                let flags = map.ground[window.index(cell)].flags;
                if !flags.contains(GroundFlags::UNKNOWN) {
                    let place = terrain::Cell { row: all_row, col: all_col };
                    self.traction[place] = self.mean(map, cell);
                    self.unfamiliar[place] = flags.contains(GroundFlags::OUT_OF_DISTRIBUTION);
                }
            }
        }
    }

    /// Share of the ground that was ever known that was unlike the training data.
    pub fn unfamiliar_share(&self) -> f64 {
        let n_known = self.traction.values().iter().filter(|value| !value.is_nan()).count();
        let n_unfamiliar = self.unfamiliar.values().iter().filter(|is| **is).count();
        n_unfamiliar as f64 / n_known.max(1) as f64
    }

    fn mean(&self, map: &RiskMapView<'_>, cell: terrain::Cell) -> f32 {
        let allowed = |yaw_bin| {
            let risk = map.risk(cell, yaw_bin);
            let is_safe = risk.roll_rad <= self.roll_max_rad && risk.pitch_rad <= self.pitch_max_rad;
            if is_safe { risk.linear_traction } else { 0.0 }
        };
        (0..map.n_yaws).map(allowed).sum::<f32>() / map.n_yaws as f32
    }
}

/// The path driven, as the picture wants it.
pub(super) fn path_samples(closed: &ClosedLoop) -> Vec<PathSample> {
    let rows = closed.episode.trace().iter().map(|row| (row.time_s, row.motion));
    let end = std::iter::once((closed.episode.time_s(), closed.episode.motion()));
    rows.chain(end)
        .map(|(time_s, motion)| PathSample {
            time_s,
            x_m: motion.pose.x_m,
            y_m: motion.pose.y_m,
            yaw_rad: motion.pose.yaw_rad,
            speed_mps: motion.velocity_mps[0],
            roll_rad: motion.pose.roll_rad,
            pitch_rad: motion.pose.pitch_rad,
        })
        .collect()
}
