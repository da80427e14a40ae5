//! A recording as bytes: safetensors with what they mean as JSON in the header.

use std::collections::HashMap;

use bicycle::ImuSample;
use safetensors::tensor::{Dtype, SafeTensorError, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::{Deserialize, Serialize};

use super::{RecordedRun, Recording, Tick, VehicleSummary};

/// Entry of the header that holds what the tensors mean.
const HEADER_KEY: &str = "surefoot-kinodynamics";
/// The version that this program writes and reads.
const FORMAT: u32 = 1;
/// Stands for a ground that nobody knows.
const UNKNOWN: u32 = u32::MAX;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    recording_format: u32,
    vehicle: VehicleSummary,
    tick_s: f64,
    grounds: Vec<String>,
}

/// Bytes that hold no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingFileError {
    /// The bytes are truncated or something else.
    #[error("recording: expected safetensors of {n_bytes} bytes that fit their header, found: {source}")]
    Container {
        /// Bytes there.
        n_bytes: usize,
        /// What does not fit.
        source: SafeTensorError,
    },
    /// A part of the file is wrong.
    #[error("recording, {part}: expected {expected}, found {found}")]
    Part {
        /// Tensor or header entry.
        part: &'static str,
        /// What would do.
        expected: String,
        /// What is there.
        found: String,
    },
}

impl Recording {
    /// The recording as safetensors.
    ///
    /// For R runs of T ticks and N samples in all: `runs` [R, 2] u32 (ticks and samples of each), `tick_time` [T] u64 [ns],
    /// `tick` [T, 4] f32 (commanded speed and curvature, wheel speed, yaw rate), `ground` [T] u32, `imu_time` [N] u64 [ns],
    /// `imu` [N, 6] f32 (angular rate, specific force).
    ///
    /// # Errors
    /// More values than a file can hold.
    pub fn to_bytes(&self) -> Result<Vec<u8>, RecordingFileError> {
        let ticks = || self.runs.iter().flat_map(|run| &run.ticks);
        let samples = || self.runs.iter().flat_map(|run| &run.imu);
        let (n_ticks, n_samples) = (self.n_ticks(), samples().count());
        let counts = self.runs.iter().flat_map(|run| [run.ticks.len() as u32, run.imu.len() as u32]);
        let tick =
            |tick: &Tick| [tick.speed_mps, tick.curvature_per_m, tick.wheel_speed_mps, tick.yaw_rate_radps];
        let grounds = ticks().map(|tick| tick.ground.unwrap_or(UNKNOWN));
        let columns: [(&str, Dtype, Vec<usize>, Vec<u8>); 6] = [
            ("runs", Dtype::U32, vec![self.runs.len(), 2], counts.flat_map(u32::to_le_bytes).collect()),
            ("tick_time", Dtype::U64, vec![n_ticks], ticks().flat_map(|t| t.time_ns.to_le_bytes()).collect()),
            (
                "tick",
                Dtype::F32,
                vec![n_ticks, 4],
                ticks().flat_map(tick).flat_map(f32::to_le_bytes).collect(),
            ),
            ("ground", Dtype::U32, vec![n_ticks], grounds.flat_map(u32::to_le_bytes).collect()),
            (
                "imu_time",
                Dtype::U64,
                vec![n_samples],
                samples().flat_map(|s| s.valid_at_ns.to_le_bytes()).collect(),
            ),
            (
                "imu",
                Dtype::F32,
                vec![n_samples, 6],
                samples().flat_map(crate::history::numbers).flat_map(f32::to_le_bytes).collect(),
            ),
        ];
        let container = |source| RecordingFileError::Container { n_bytes: 0, source };
        let mut views = Vec::with_capacity(columns.len());
        for (name, dtype, shape, bytes) in &columns {
            views.push((*name, TensorView::new(*dtype, shape.clone(), bytes).map_err(container)?));
        }
        let header = Header {
            recording_format: FORMAT,
            vehicle: self.vehicle.clone(),
            tick_s: self.tick_s,
            grounds: self.grounds.clone(),
        };
        let told = serde_json::to_string(&header)
            .map_err(|error| part("header", "values that JSON can hold", error))?;
        serialize(views, Some(HashMap::from([(HEADER_KEY.to_owned(), told)]))).map_err(container)
    }

    /// Reads what [`Recording::to_bytes`] wrote.
    ///
    /// # Errors
    /// Truncated or other bytes, another format, tensors that are missing or of another type or shape, commands that are not
    /// finite. What the unit measured is judged by [`crate::check_imu`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RecordingFileError> {
        let container = |source| RecordingFileError::Container { n_bytes: bytes.len(), source };
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(container)?;
        let told = metadata.metadata().as_ref().and_then(|entries| entries.get(HEADER_KEY));
        let told = told.ok_or_else(|| part("header", format!("an entry '{HEADER_KEY}'"), "none"))?;
        let header: Header =
            serde_json::from_str(told).map_err(|error| part("header", "that of a recording", error))?;
        if header.recording_format != FORMAT {
            return Err(part("header, recording_format", FORMAT, header.recording_format));
        }
        if !(header.tick_s.is_finite() && header.tick_s > 0.0) {
            return Err(part("header, tick_s", "a time > 0 s", header.tick_s));
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(container)?;
        let runs = runs(&tensors)?;
        let Header { vehicle, tick_s, grounds, .. } = header;
        Ok(Self { vehicle, tick_s, grounds, runs })
    }
}

fn runs(tensors: &SafeTensors<'_>) -> Result<Vec<RecordedRun>, RecordingFileError> {
    let counts: Vec<u32> = column(tensors, "runs", Dtype::U32, 2)?.as_chunks().0.iter().map(u32_of).collect();
    let times: Vec<u64> =
        column(tensors, "tick_time", Dtype::U64, 1)?.as_chunks().0.iter().map(u64_of).collect();
    let values: Vec<f32> = column(tensors, "tick", Dtype::F32, 4)?.as_chunks().0.iter().map(f32_of).collect();
    let grounds: Vec<u32> =
        column(tensors, "ground", Dtype::U32, 1)?.as_chunks().0.iter().map(u32_of).collect();
    let imu_times: Vec<u64> =
        column(tensors, "imu_time", Dtype::U64, 1)?.as_chunks().0.iter().map(u64_of).collect();
    let imu: Vec<f32> = column(tensors, "imu", Dtype::F32, 6)?.as_chunks().0.iter().map(f32_of).collect();
    if let Some(found) = values.iter().find(|value| !value.is_finite()) {
        return Err(part("tick", "finite numbers", found));
    }
    let sum = |which: usize| counts.chunks_exact(2).map(|pair| pair[which] as usize).sum::<usize>();
    let found = [times.len(), values.len() / 4, grounds.len(), imu_times.len(), imu.len() / 6];
    let expected = [sum(0), sum(0), sum(0), sum(1), sum(1)];
    if found != expected {
        return Err(part("runs", format!("{found:?} rows as the tensors have"), format!("{expected:?}")));
    }
    let (mut tick, mut sample) = (0, 0);
    let mut runs = Vec::with_capacity(counts.len() / 2);
    for pair in counts.chunks_exact(2) {
        let (n_ticks, n_samples) = (pair[0] as usize, pair[1] as usize);
        let ticks = (tick..tick + n_ticks).map(|k| Tick {
            time_ns: times[k],
            speed_mps: values[4 * k],
            curvature_per_m: values[4 * k + 1],
            wheel_speed_mps: values[4 * k + 2],
            yaw_rate_radps: values[4 * k + 3],
            ground: (grounds[k] != UNKNOWN).then_some(grounds[k]),
        });
        let samples = (sample..sample + n_samples).map(|k| ImuSample {
            valid_at_ns: imu_times[k],
            angular_rate_radps: [imu[6 * k], imu[6 * k + 1], imu[6 * k + 2]],
            acceleration_mps2: [imu[6 * k + 3], imu[6 * k + 4], imu[6 * k + 5]],
        });
        runs.push(RecordedRun { ticks: ticks.collect(), imu: samples.collect() });
        (tick, sample) = (tick + n_ticks, sample + n_samples);
    }
    Ok(runs)
}

fn u32_of(bytes: &[u8; 4]) -> u32 {
    u32::from_le_bytes(*bytes)
}

fn u64_of(bytes: &[u8; 8]) -> u64 {
    u64::from_le_bytes(*bytes)
}

fn f32_of(bytes: &[u8; 4]) -> f32 {
    f32::from_le_bytes(*bytes)
}

/// The bytes of a tensor of the given type with rows of this width.
fn column<'a>(
    tensors: &SafeTensors<'a>,
    name: &'static str,
    dtype: Dtype,
    width: usize,
) -> Result<&'a [u8], RecordingFileError> {
    let expected = || format!("{dtype:?} of width {width}");
    let tensor = tensors.tensor(name).map_err(|_| part(name, expected(), "no such tensor"))?;
    let found = match tensor.shape() {
        [_] => 1,
        [_, found] => *found,
        _ => 0,
    };
    if tensor.dtype() != dtype || found != width {
        return Err(part(name, expected(), format!("{:?} {:?}", tensor.dtype(), tensor.shape())));
    }
    Ok(tensor.data())
}

fn part(part: &'static str, expected: impl ToString, found: impl ToString) -> RecordingFileError {
    RecordingFileError::Part { part, expected: expected.to_string(), found: found.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording {
        let run = |n: u64| RecordedRun {
            ticks: (0..n)
                .map(|k| Tick {
                    time_ns: k * 50,
                    speed_mps: k as f32,
                    curvature_per_m: -0.5,
                    wheel_speed_mps: 0.25,
                    yaw_rate_radps: 0.125,
                    ground: (k % 2 == 0).then_some(1),
                })
                .collect(),
            imu: (0..3 * n)
                .map(|k| ImuSample {
                    valid_at_ns: k,
                    acceleration_mps2: [k as f32, 2.0, 9.81],
                    angular_rate_radps: [0.1, f32::NAN, -0.3],
                })
                .collect(),
        };
        Recording {
            vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.3, steering_max_rad: 0.5 },
            tick_s: 0.05,
            grounds: vec!["grass".into(), "mud".into()],
            runs: vec![run(4), run(0), run(3)],
        }
    }

    #[test]
    fn what_was_written_is_read_again() {
        let written = recording();
        let bytes = written.to_bytes().unwrap();
        let read = Recording::from_bytes(&bytes).unwrap();
        // NaN is no number to compare: bytes are.
        assert_eq!(read.to_bytes().unwrap(), bytes);
        assert_eq!((read.runs[2].ticks.clone(), read.n_ticks()), (written.runs[2].ticks.clone(), 7));
    }

    #[test]
    fn other_bytes_and_counts_that_contradict_each_other_are_refused() {
        let bytes = recording().to_bytes().unwrap();
        assert!(matches!(Recording::from_bytes(&bytes[..40]), Err(RecordingFileError::Container { .. })));
        let mut broken = recording();
        broken.runs[0].ticks[1].speed_mps = f32::INFINITY;
        let told = Recording::from_bytes(&broken.to_bytes().unwrap()).unwrap_err().to_string();
        assert_eq!(told, "recording, tick: expected finite numbers, found inf");
        // The first count of the first run is a 4 at the end of the header: the tensor `runs` is named there.
        let header_end = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let place =
            (header_end..bytes.len() - 4).find(|k| bytes[*k..*k + 8] == [4, 0, 0, 0, 12, 0, 0, 0]).unwrap();
        let mut other = bytes.clone();
        other[place] = 5;
        assert!(
            Recording::from_bytes(&other).unwrap_err().to_string().starts_with("recording, runs: expected")
        );
    }
}
