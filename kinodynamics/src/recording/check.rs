//! Whether the unit's axes, signs, units and rate are what they should be, told from gravity and from the localisation.

use super::Recording;
use crate::agreement::{Agreement, Disagreement, Moment};
use crate::history::PERIOD_NS;

const AXIS: [&str; 3] = ["forward", "left", "up"];
/// How far the mean specific force may be off [m/s2].
const GRAVITY_MPS2: [f64; 2] = [8.0, 11.6];
/// How far the rate may be off as a factor.
const PERIOD: [f64; 2] = [0.9, 1.1];

/// What is wrong with the unit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImuCheckError {
    /// Nothing to judge by.
    #[error(
        "IMU: expected a drive with samples and turns, found {n_samples} samples and a yaw rate of {yaw_rate_radps:.3} rad/s (root mean square)"
    )]
    Nothing {
        /// Samples.
        n_samples: usize,
        /// Root mean square of the localisation's yaw rate [rad/s].
        yaw_rate_radps: f64,
    },
    /// A component is not finite.
    #[error("IMU: expected finite numbers, found {found} in sample {index} of run {run}")]
    NonFinite {
        /// Run.
        run: usize,
        /// Sample.
        index: usize,
        /// What stands there.
        found: f32,
    },
    /// Another rate.
    #[error("IMU: expected 200 Hz, found {found_hz:.1} Hz")]
    Rate {
        /// From the median distance of samples [Hz].
        found_hz: f64,
    },
    /// Gravity elsewhere or of another size.
    #[error("IMU: expected a mean specific force of 9.8 m/s2 up, found {0:.2} forward, {1:.2} left, {2:.2} up{hint}", mean_mps2[0], mean_mps2[1], mean_mps2[2], hint = hint(mean_mps2))]
    Gravity {
        /// Mean specific force [m/s2].
        mean_mps2: [f64; 3],
    },
    /// The upward rate is not the yaw rate.
    #[error("IMU: expected the rate about the upward axis to follow the localisation's yaw rate, found correlations of {0:.2} about forward, {1:.2} about left, {2:.2} about up and a factor of {factor:.2} about up{hint}", correlation[0], correlation[1], correlation[2], hint = rate_hint(correlation, *factor))]
    YawRate {
        /// Of the rates about the three axes with the localisation's yaw rate [-].
        correlation: [f64; 3],
        /// Upward rate over yaw rate [-].
        factor: f64,
    },
    /// The force to the left is not what it takes to turn.
    #[error("IMU: expected the force to the left to follow speed times yaw rate, found correlations of {0:.2} ahead and {1:.2} to the left{hint}", correlation[0], correlation[1], hint = force_hint(correlation))]
    Force {
        /// Of the forces ahead and to the left with speed times yaw rate [-].
        correlation: [f64; 2],
    },
}

impl From<Disagreement> for ImuCheckError {
    fn from(disagreement: Disagreement) -> Self {
        match disagreement {
            Disagreement::Rate { correlation, factor } => Self::YawRate { correlation, factor },
            Disagreement::Force { correlation } => Self::Force { correlation },
        }
    }
}

fn hint(mean_mps2: &[f64; 3]) -> String {
    let largest = (0..3).max_by(|a, b| mean_mps2[*a].abs().total_cmp(&mean_mps2[*b].abs())).unwrap_or(2);
    let size = mean_mps2[largest].abs();
    match (largest, mean_mps2[largest] > 0.0) {
        _ if (0.8..1.2).contains(&size) => "; is it in units of g?".to_owned(),
        (2, false) => "; the upward axis points down".to_owned(),
        (2, true) => String::new(),
        (axis, true) => format!("; the axis called {} points up", AXIS[axis]),
        (axis, false) => format!("; the axis called {} points down", AXIS[axis]),
    }
}

fn rate_hint(correlation: &[f64; 3], factor: f64) -> String {
    let largest = (0..3).max_by(|a, b| correlation[*a].abs().total_cmp(&correlation[*b].abs())).unwrap_or(2);
    match largest {
        2 if correlation[2] < 0.0 => "; its sign is turned".to_owned(),
        2 if (50.0..65.0).contains(&factor) => "; is it in degrees per second?".to_owned(),
        2 => String::new(),
        axis if correlation[axis].abs() >= 0.6 => {
            format!("; the axis called {} is the upward one", AXIS[axis])
        }
        _ => String::new(),
    }
}

fn force_hint([ahead, left]: &[f64; 2]) -> &'static str {
    if ahead.abs() > left.abs() {
        "; forward and left are swapped"
    } else {
        "; the axis called left points right"
    }
}

/// Refuses a unit whose numbers do not mean what they should.
///
/// # Errors
/// See [`ImuCheckError`]; the first thing that is wrong, with what it looks like.
pub fn check_imu(recording: &Recording) -> Result<(), ImuCheckError> {
    for (run, recorded) in recording.runs.iter().enumerate() {
        for (index, sample) in recorded.imu.iter().enumerate() {
            let numbers = crate::history::numbers(sample);
            if let Some(&found) = numbers.iter().find(|value| !value.is_finite()) {
                return Err(ImuCheckError::NonFinite { run, index, found });
            }
        }
    }
    let (agreement, n_samples) = agreement(recording);
    if n_samples < 100 || agreement.turning_radps().is_none() {
        let yaw_rate_radps = agreement.mean_yaw_rate_radps();
        return Err(ImuCheckError::Nothing { n_samples, yaw_rate_radps });
    }
    check_rate(recording)?;
    let mean_mps2 = mean_force_mps2(recording, n_samples);
    if !(GRAVITY_MPS2[0]..=GRAVITY_MPS2[1]).contains(&mean_mps2[2]) {
        return Err(ImuCheckError::Gravity { mean_mps2 });
    }
    Ok(agreement.check()?)
}

fn check_rate(recording: &Recording) -> Result<(), ImuCheckError> {
    let pairs = recording.runs.iter().flat_map(|run| run.imu.windows(2));
    let mut distances_ns: Vec<u64> =
        pairs.map(|pair| pair[1].valid_at_ns.saturating_sub(pair[0].valid_at_ns)).collect();
    distances_ns.sort_unstable();
    let median_ns = distances_ns.get(distances_ns.len() / 2).copied().unwrap_or(0);
    if (PERIOD[0]..=PERIOD[1]).contains(&(median_ns as f64 / PERIOD_NS as f64)) {
        return Ok(());
    }
    Err(ImuCheckError::Rate { found_hz: 1e9 / median_ns.max(1) as f64 })
}

fn mean_force_mps2(recording: &Recording, n_samples: usize) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for sample in recording.runs.iter().flat_map(|run| &run.imu) {
        for (sum, force) in sums.iter_mut().zip(sample.acceleration_mps2) {
            *sum += f64::from(force);
        }
    }
    sums.map(|sum| sum / n_samples as f64)
}

/// Over all ticks, each with the few samples before it; and the number of samples.
fn agreement(recording: &Recording) -> (Agreement, usize) {
    let mut agreement = Agreement::new(1.0);
    for run in &recording.runs {
        let mut next = 0;
        for tick in &run.ticks {
            let begin = next;
            while run.imu.get(next).is_some_and(|sample| sample.valid_at_ns <= tick.time_ns) {
                next += 1;
            }
            let begin = begin.max(next.saturating_sub(4));
            if begin < next {
                let samples = run.imu[begin..next].iter().map(crate::history::numbers);
                let (rate_radps, force_mps2) = crate::history::means(samples);
                agreement.note(&Moment {
                    rate_radps,
                    force_mps2,
                    yaw_rate_radps: f64::from(tick.yaw_rate_radps),
                    speed_mps: f64::from(tick.wheel_speed_mps),
                });
            }
        }
    }
    (agreement, recording.runs.iter().map(|run| run.imu.len()).sum())
}

#[cfg(test)]
mod tests;
