//! What is kept of a simulated drive in a file, by the writer that `surefoot drive` uses.

use std::collections::BTreeMap;
use std::path::Path;

use formats::{DriveRecorder, RecordError};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use scenarios::{Episode, Observation};
use terrain::{GridMap, Pose, SurfaceCell};

use super::drive::Drive;

/// Cycles between two recorded maps: one a second at the usual rate.
const CYCLES_PER_MAP: u64 = 10;

/// A file that is being written.
pub struct Recording {
    recorder: DriveRecorder,
    driven: Vec<Pose>,
}

impl Recording {
    /// Creates the file with what is known before the first cycle.
    pub fn create(path: &Path, drive: &Drive) -> PyResult<Self> {
        let task = drive.episode.task();
        let about = [("vehicle", &drive.vehicle.name), ("world", &task.world.name)];
        let about: BTreeMap<String, String> =
            about.into_iter().map(|(key, value)| (key.to_owned(), value.clone())).collect();
        let mut recorder = DriveRecorder::create(path, about).map_err(unwritten)?;
        let [x_m, y_m] = task.goal_m;
        let z_m = task.world.height_m(x_m, y_m);
        recorder
            .goal(at_ns(drive.episode.time_s()), &Pose { x_m, y_m, z_m, ..Pose::default() })
            .map_err(unwritten)?;
        Ok(Self { recorder, driven: Vec::new() })
    }

    /// Notes the cycle that has just been driven, and what was measured when it began.
    pub fn cycle(
        &mut self,
        episode: &Episode,
        surface: &GridMap<SurfaceCell>,
        measured: &Observation,
    ) -> Result<(), RecordError> {
        let Some(row) = episode.trace().last() else { return Ok(()) };
        let at_ns = at_ns(row.time_s);
        self.driven.push(row.motion.pose);
        self.recorder.pose(at_ns, &row.motion.pose)?;
        self.recorder.command(at_ns, &row.command)?;
        self.recorder.decision(at_ns, &row.decision)?;
        self.recorder.drive_row(at_ns, "1", &row.measured_row(&measured.odometry))?;
        if (episode.n_cycles() - 1).is_multiple_of(CYCLES_PER_MAP) {
            self.recorder.path(at_ns, &self.driven)?;
            self.recorder.elevation(at_ns, surface)?;
            measured.scan.as_ref().map_or(Ok(()), |scan| self.recorder.scan(at_ns, scan))?;
        }
        Ok(())
    }

    /// Completes the file.
    pub fn finish(self) -> PyResult<()> {
        self.recorder.finish().map_err(unwritten)
    }
}

fn at_ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

/// What the file system said.
fn unwritten(error: RecordError) -> PyErr {
    PyOSError::new_err(error.to_string())
}
