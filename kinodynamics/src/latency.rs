//! How much later than a command the vehicle begins to turn, and has turned half-way, told by the drive itself.

use crate::history::PERIOD_NS;
use crate::recording::{RecordedRun, Recording};

/// Latencies that are tried [s].
const LATENCY_MAX_S: f64 = 0.5;
/// Commands slower than this ask for no yaw rate worth telling [m/s].
const SPEED_MIN_MPS: f32 = 0.3;
/// Below this correlation no latency explains the drive.
const CORRELATION_MIN: f64 = 0.5;
/// Time constants of a lag behind the dead time that are tried: so many, this far apart [s].
const TIME_CONSTANTS: usize = 16;
const TIME_CONSTANT_STEP_S: f64 = 0.02;

/// Latency of a drive.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// From a command to the middle of its effect on the yaw rate [s].
    pub seconds: f64,
    /// From a command to where its effect begins: of a dead time and a first-order lag that together foretell the yaw rate
    /// best, the dead time [s].
    pub dead_time_s: f64,
    /// Correlation of commanded and measured yaw rate at this latency.
    pub correlation: f64,
}

/// Why there is no latency.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LatencyError {
    /// The vehicle does not turn as commanded, whatever the latency.
    #[error(
        "latency: expected a yaw rate that follows the commands (correlation above {CORRELATION_MIN}), found {found:.2} at best"
    )]
    Unrelated {
        /// Largest correlation found.
        found: f64,
    },
    /// The largest correlation lies at the end of what was tried.
    #[error("latency: expected below {LATENCY_MAX_S} s, found the largest correlation there")]
    TooLong,
}

/// The latency at which commanded yaw rates, speed times curvature held from tick to tick, and the unit's upward rate
/// correlate most, between the 5 ms of the samples by a parabola.
///
/// # Errors
/// See [`LatencyError`].
pub fn estimate_latency(recording: &Recording) -> Result<Latency, LatencyError> {
    let n = (LATENCY_MAX_S * 1e9 / PERIOD_NS as f64) as usize;
    let correlations: Vec<f64> = (0..=n).map(|shift| correlation(recording, shift as u64, 0.0)).collect();
    let best = (0..=n).max_by(|a, b| correlations[*a].total_cmp(&correlations[*b])).unwrap_or(0);
    let correlation = correlations[best];
    if correlation.is_nan() || correlation < CORRELATION_MIN {
        return Err(LatencyError::Unrelated { found: correlation });
    }
    if best == n {
        return Err(LatencyError::TooLong);
    }
    let offset = if best == 0 { 0.0 } else { vertex([best - 1, best, best + 1].map(|k| correlations[k])) };
    let seconds = |samples: f64| samples * PERIOD_NS as f64 * 1e-9;
    let dead_time_s = seconds(dead_time(recording, best) as f64);
    Ok(Latency { seconds: seconds(best as f64 + offset), dead_time_s, correlation })
}

/// Samples of dead time, no longer than the latency, with which some lag correlates most.
fn dead_time(recording: &Recording, latency: usize) -> usize {
    let best_of = |shift: usize| {
        let lags = (0..TIME_CONSTANTS).map(|k| k as f64 * TIME_CONSTANT_STEP_S);
        lags.map(|lag_s| correlation(recording, shift as u64, lag_s)).fold(f64::NEG_INFINITY, f64::max)
    };
    let found: Vec<f64> = (0..=latency).map(best_of).collect();
    (0..=latency).max_by(|a, b| found[*a].total_cmp(&found[*b])).unwrap_or(0)
}

/// Where the parabola through three values at -1, 0, 1 has its vertex.
fn vertex([before, at, after]: [f64; 3]) -> f64 {
    let bend = before - 2.0 * at + after;
    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Of measured yaw rates with commanded ones behind a dead time in samples and a first-order lag [s].
fn correlation(recording: &Recording, shift: u64, lag_s: f64) -> f64 {
    let period_s = PERIOD_NS as f64 * 1e-9;
    let share = if lag_s > 0.0 { -(-period_s / lag_s).exp_m1() } else { 1.0 };
    let mut sums = [0.0; 3];
    for run in &recording.runs {
        add(run, (shift, share), &mut sums);
    }
    let [product, commanded, measured] = sums;
    product / (commanded * measured).sqrt()
}

/// Adds products and squares of commanded and measured yaw rates about zero: both turn left and right alike. The commanded
/// one comes nearer to its aim by a share with every sample.
fn add(run: &RecordedRun, (shift, share): (u64, f64), sums: &mut [f64; 3]) {
    let (mut next, mut commanded) = (0, 0.0);
    for sample in &run.imu {
        let asked_ns = sample.valid_at_ns.saturating_sub(shift * PERIOD_NS);
        while run.ticks.get(next + 1).is_some_and(|tick| tick.time_ns <= asked_ns) {
            next += 1;
        }
        let Some(tick) = run.ticks.get(next).filter(|tick| tick.time_ns <= asked_ns) else { continue };
        commanded += share * (f64::from(tick.speed_mps * tick.curvature_per_m) - commanded);
        if tick.speed_mps < SPEED_MIN_MPS {
            continue;
        }
        let measured = f64::from(sample.angular_rate_radps[2]);
        for (sum, term) in
            sums.iter_mut().zip([commanded * measured, commanded * commanded, measured * measured])
        {
            *sum += term;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Tick, VehicleSummary};
    use bicycle::ImuSample;

    /// Commands that change every tick, and a vehicle that answers `delay` samples later by a factor.
    fn recording(delay: usize, factor: f32) -> Recording {
        let command = |k: usize| (k as f32 * 0.9).sin() + (k as f32 * 0.37).cos();
        let ticks = (0..600).map(|k| Tick {
            time_ns: k as u64 * 10 * PERIOD_NS,
            speed_mps: 1.5,
            curvature_per_m: command(k),
            wheel_speed_mps: 1.5,
            yaw_rate_radps: 0.0,
            ground: None,
        });
        let imu = (0..6000).map(|k: usize| ImuSample {
            valid_at_ns: k as u64 * PERIOD_NS,
            acceleration_mps2: [0.0, 0.0, 9.81],
            angular_rate_radps: [0.0, 0.0, factor * 1.5 * command(k.saturating_sub(delay) / 10)],
        });
        Recording {
            vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.3, steering_max_rad: 0.5 },
            tick_s: 0.05,
            grounds: Vec::new(),
            runs: vec![RecordedRun { ticks: ticks.collect(), imu: imu.collect() }],
        }
    }

    #[test]
    fn pure_delay_is_found_whatever_the_vehicle_makes_of_the_size() {
        for (delay, factor) in [(0, 1.0), (8, 0.6), (16, 1.3), (50, 0.8)] {
            let found = estimate_latency(&recording(delay, factor)).unwrap();
            // A parabola is no triangle: half a sample.
            assert!((found.seconds - 0.005 * delay as f64).abs() <= 0.0025, "{delay}: {found:?}");
            assert!((found.dead_time_s - 0.005 * delay as f64).abs() < 1e-9, "{delay}: {found:?}");
            assert!(found.correlation > 0.99);
        }
    }

    /// A lag of 80 ms behind a dead time of 30 ms, and a stick that moves slower than the ticks.
    #[test]
    fn dead_time_is_told_apart_from_a_lag_behind_it() {
        let mut lagging = recording(0, 1.0);
        let run = &mut lagging.runs[0];
        let stick = |k: usize| (k as f32 * 0.31).sin() + (k as f32 * 0.17).cos();
        run.ticks.iter_mut().enumerate().for_each(|(k, tick)| tick.curvature_per_m = stick(k));
        let mut turning = 0.0;
        for (k, sample) in run.imu.iter_mut().enumerate() {
            turning += (1.0 - (-0.005_f32 / 0.08).exp()) * (1.5 * stick(k.saturating_sub(6) / 10) - turning);
            sample.angular_rate_radps[2] = turning;
        }
        let found = estimate_latency(&lagging).unwrap();
        assert!((found.dead_time_s - 0.03).abs() < 1e-9, "{found:?}");
        // At 0.31 rad a tick the lag's phase, atan(6.2 x 0.08), is 74 ms; at 0.17 it is 78.
        assert!((0.1..0.115).contains(&found.seconds), "{found:?}");
    }

    #[test]
    fn vehicle_that_turns_otherwise_has_no_latency() {
        let turned = estimate_latency(&recording(8, -1.0));
        assert!(matches!(turned, Ok(Latency { seconds, .. }) if seconds > 0.05) || turned.is_err());
        let mut unrelated = recording(8, 1.0);
        for (k, sample) in unrelated.runs[0].imu.iter_mut().enumerate() {
            sample.angular_rate_radps[2] = ((k * k) as f32 * 0.123).sin();
        }
        assert!(matches!(estimate_latency(&unrelated), Err(LatencyError::Unrelated { .. })));
    }
}
