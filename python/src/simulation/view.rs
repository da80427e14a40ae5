//! The way so far as a picture.

use png::Decoder;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use report::drive::{DrivePicture, PathSample};
use scenarios::{Motion, Outcome};

use super::drive::Drive;

/// A picture, row by row from the north.
pub struct Frame {
    pub rgb: Vec<u8>,
    /// Rows, columns, three colours.
    pub shape: [usize; 3],
}

/// Draws the map with the way on it.
pub fn frame(drive: &Drive, side_px: u32) -> PyResult<Frame> {
    let task = drive.episode.task();
    let [x_m, y_m, _] = task.start;
    let failure = drive.episode.outcome().filter(|outcome| *outcome != Outcome::Goal);
    let failure = failure.map(|outcome| outcome.to_string());
    let picture = DrivePicture {
        title: "",
        subtitles: &[],
        world: &task.world,
        risk: None,
        known: None,
        unfamiliar: None,
        driven: &driven(drive),
        walked: &[],
        planned: &[],
        areas: None,
        start_m: [x_m, y_m],
        goal_m: task.goal_m,
        goal_radius_m: task.goal_tolerance_m,
        failure: failure.as_deref(),
        vehicle: &drive.vehicle,
    };
    pixels(&report::drive::frame(&picture, side_px).map_err(undrawn)?)
}

fn driven(drive: &Drive) -> Vec<PathSample> {
    let episode = &drive.episode;
    let rows = episode.trace().iter().map(|row| (row.time_s, row.motion));
    rows.chain([(episode.time_s(), episode.motion())]).map(sample).collect()
}

fn sample((time_s, motion): (f64, Motion)) -> PathSample {
    PathSample {
        time_s,
        x_m: motion.pose.x_m,
        y_m: motion.pose.y_m,
        yaw_rad: motion.pose.yaw_rad,
        speed_mps: motion.velocity_mps[0],
        roll_rad: motion.pose.roll_rad,
        pitch_rad: motion.pose.pitch_rad,
    }
}

fn pixels(png: &[u8]) -> PyResult<Frame> {
    let mut decoder = Decoder::new(std::io::Cursor::new(png));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(undrawn)?;
    let mut bytes = vec![0; reader.output_buffer_size().unwrap_or_default()];
    let info = reader.next_frame(&mut bytes).map_err(undrawn)?;
    let n_channels = info.color_type.samples();
    let rgb = bytes.chunks_exact(n_channels).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Ok(Frame { rgb, shape: [info.height as usize, info.width as usize, 3] })
}

fn undrawn(error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(format!("frame: {error}"))
}
