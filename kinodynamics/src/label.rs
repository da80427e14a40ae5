//! What a drive teaches: the command that led to a motion, and the history before it.
//!
//! The procedure of the paper's published code: a command and the mean yaw rate over its interval, shifted by the latency,
//! are one example; the yaw rate over the speed is the curvature that was driven, and the command is the answer to it.
//! Its filters keep understeer only. Each of them is an option here, and what each takes away is counted.

use bicycle::ImuSample;
use serde::{Deserialize, Serialize};

use crate::architecture::{AXES, CURVATURE_MAX_PER_M, WINDOW};
use crate::history::{PERIOD_NS, numbers};
use crate::latency::Latency;
use crate::recording::{RecordedRun, Recording};

/// Speeds below this have no curvature [m/s].
const STANDSTILL_MPS: f32 = 0.2;

/// What the driven curvature is the yaw rate over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpeedSource {
    /// The commanded speed, as in the paper's code.
    #[default]
    Commanded,
    /// The wheels' speed, as in the paper's text.
    Wheels,
}

/// Which part of a command's effect is the motion of its example.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectPart {
    /// Its middle, where commands and yaw rates correlate most: a command is the answer to where it has led half-way, and
    /// the vehicle's own lag stays as it is.
    #[default]
    Middle,
    /// Its beginning, from the dead time on: a command is the answer to what it changes at once in a vehicle that already
    /// turns, which leads the vehicle's lag. Who does not feel how the vehicle turns cannot learn it.
    Beginning,
}

/// How examples are made and which are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelConfig {
    /// Which part of a command's effect counts.
    pub effect: EffectPart,
    /// From a command to the interval in which it is driven [s].
    pub latency_s: f64,
    /// What the curvature is taken over.
    pub speed_source: SpeedSource,
    /// Least commanded speed [m/s].
    pub speed_min_mps: f32,
    /// Whether commanded and driven curvature must have one sign.
    pub same_sign: bool,
    /// Whether only understeer is kept: driven curvatures that are no larger than the commanded.
    pub understeer_only: bool,
    /// Largest difference of commanded and driven curvature [1/m]; none keeps all.
    pub difference_max_per_m: Option<f32>,
}

impl LabelConfig {
    /// The filters of the paper's code.
    pub fn paper(latency_s: f64) -> Self {
        Self {
            effect: EffectPart::Middle,
            latency_s,
            speed_source: SpeedSource::Commanded,
            speed_min_mps: 0.1,
            same_sign: true,
            understeer_only: true,
            difference_max_per_m: Some(0.2),
        }
    }

    /// No filter but the least speed.
    pub fn unfiltered(latency_s: f64) -> Self {
        Self {
            same_sign: false,
            understeer_only: false,
            difference_max_per_m: None,
            ..Self::paper(latency_s)
        }
    }

    /// The same with what a drive shows of its latency.
    #[must_use]
    pub fn after(self, latency: &Latency) -> Self {
        let latency_s = match self.effect {
            EffectPart::Middle => latency.seconds,
            EffectPart::Beginning => latency.dead_time_s,
        };
        Self { latency_s, ..self }
    }
}

/// One example.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// When the command was given, in its run [s].
    pub time_s: f64,
    /// Speed and curvature that were driven [m/s, 1/m].
    pub driven: [f32; 2],
    /// Curvature and speed that were commanded [1/m, m/s]: the order of the answers.
    pub commanded: [f32; 2],
    /// The unit's half second before the command, oldest first: a column of all samples for each of the rates and forces.
    pub window: Vec<f32>,
    /// Which run.
    pub run: usize,
    /// Which ground, if somebody knows.
    pub ground: Option<u32>,
}

/// How many commands became examples, and what took the others away, in the order of the filters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LabelCounts {
    /// Commands.
    pub ticks: usize,
    /// At the ends of runs, and where samples are missing.
    pub no_samples: usize,
    /// Too slow.
    pub slow: usize,
    /// Commanded to one side and driven to the other.
    pub other_sign: usize,
    /// Driven tighter than commanded.
    pub oversteer: usize,
    /// Driven too differently.
    pub different: usize,
    /// Examples.
    pub kept: usize,
}

/// Makes the examples of a recording.
pub fn label(recording: &Recording, config: &LabelConfig) -> (Vec<Example>, LabelCounts) {
    let mut counts = LabelCounts::default();
    let mut examples = Vec::new();
    for (run, recorded) in recording.runs.iter().enumerate() {
        for (index, tick) in recorded.ticks.iter().enumerate() {
            counts.ticks += 1;
            let driven = driven_rate_radps(recorded, index, recording.tick_s, config.latency_s);
            let (Some(driven_radps), Some(samples)) = (driven, window(recorded, tick.time_ns)) else {
                counts.no_samples += 1;
                continue;
            };
            let speed_mps = match config.speed_source {
                SpeedSource::Commanded => tick.speed_mps,
                SpeedSource::Wheels => wheel_speed_mps(recorded, index, config.latency_s),
            };
            let driven_per_m = curvature_per_m(driven_radps, speed_mps);
            let commanded_per_m = tick.curvature_per_m;
            if let Some(filter) = refused(config, [tick.speed_mps, commanded_per_m, driven_per_m]) {
                *filter(&mut counts) += 1;
                continue;
            }
            counts.kept += 1;
            examples.push(Example {
                time_s: (tick.time_ns - recorded.ticks[0].time_ns) as f64 * 1e-9,
                driven: [speed_mps, driven_per_m],
                commanded: [commanded_per_m, tick.speed_mps],
                window: columns(samples.iter().map(numbers)),
                run,
                ground: tick.ground,
            });
        }
    }
    (examples, counts)
}

/// Yaw rate over speed; none at standstill, and none beyond what a model is asked for: so does the paper's code.
fn curvature_per_m(rate_radps: f32, speed_mps: f32) -> f32 {
    if speed_mps.abs() < STANDSTILL_MPS {
        return 0.0;
    }
    let curvature = rate_radps / speed_mps;
    if curvature.abs() > CURVATURE_MAX_PER_M { 0.0 } else { curvature }
}

type Filter = fn(&mut LabelCounts) -> &mut usize;

/// The first filter that takes an example away.
fn refused(config: &LabelConfig, [speed_mps, commanded, driven]: [f32; 3]) -> Option<Filter> {
    if speed_mps < config.speed_min_mps {
        return Some(|counts| &mut counts.slow);
    }
    if config.same_sign && commanded * driven < 0.0 {
        return Some(|counts| &mut counts.other_sign);
    }
    if config.understeer_only && commanded.abs() < driven.abs() {
        return Some(|counts| &mut counts.oversteer);
    }
    if config.difference_max_per_m.is_some_and(|most| (commanded - driven).abs() > most) {
        return Some(|counts| &mut counts.different);
    }
    None
}

/// Mean rate about the upward axis in the interval of a command [rad/s].
fn driven_rate_radps(run: &RecordedRun, index: usize, tick_s: f64, latency_s: f64) -> Option<f32> {
    let begin_ns = run.ticks[index].time_ns + (latency_s * 1e9) as u64;
    let end_ns = begin_ns + (tick_s * 1e9) as u64;
    let begin = run.imu.partition_point(|sample| sample.valid_at_ns < begin_ns);
    let end = run.imu.partition_point(|sample| sample.valid_at_ns < end_ns);
    let n_expected = ((end_ns - begin_ns) / PERIOD_NS) as usize;
    let samples = &run.imu[begin..end];
    if samples.len() < n_expected.div_ceil(2).max(1) {
        return None;
    }
    Some(samples.iter().map(|sample| sample.angular_rate_radps[2]).sum::<f32>() / samples.len() as f32)
}

/// Wheel speed of the tick nearest to a command's effect [m/s].
fn wheel_speed_mps(run: &RecordedRun, index: usize, latency_s: f64) -> f32 {
    let effect_ns = run.ticks[index].time_ns + (latency_s * 1e9) as u64;
    let later = run.ticks[index..].partition_point(|tick| tick.time_ns <= effect_ns);
    run.ticks[index + later.max(1) - 1].wheel_speed_mps
}

/// The samples up to a command, none of them missing.
fn window(run: &RecordedRun, time_ns: u64) -> Option<&[ImuSample]> {
    let end = run.imu.partition_point(|sample| sample.valid_at_ns <= time_ns);
    let samples = &run.imu[end.checked_sub(WINDOW)?..end];
    let (first, last) = (samples[0].valid_at_ns, samples[WINDOW - 1].valid_at_ns);
    let is_whole = last - first <= WINDOW as u64 * PERIOD_NS && time_ns - last <= 2 * PERIOD_NS;
    is_whole.then_some(samples)
}

/// One column of all samples for each component.
fn columns(samples: impl Iterator<Item = [f32; AXES]> + Clone) -> Vec<f32> {
    (0..AXES).flat_map(|axis| samples.clone().map(move |sample| sample[axis])).collect()
}

#[cfg(test)]
mod tests;
