//! Drives through a simulator: what goes in, with effects wrapped around the commands, and what sensors with effects
//! would have said of what comes out, held against what was measured.

use super::lever::Lever;
use super::types::{Motion, RunSimulator, SimulatorDescription, SimulatorRun, StartState};
use crate::causes::composed;
use crate::comparison::Yardstick;
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, N_STEPS, STEP_S, VX, VY, WZ, X, Y, YAW, seen_from};
use crate::rollout::UNLIMITED;
use crate::signals::unwrapped;
use bicycle::lanes::{Real, Scalar};
use bicycle::{Effect, Model, SensorModel, Stepper};
use std::collections::BTreeMap;

/// What a simulator hides inside has settled after this long, whatever it began with [rows].
const SETTLED: usize = 150;
/// So many starts are enough to leave the others out.
const ENOUGH: usize = 25;
/// Runs of a stochastic simulator, whose mean is compared.
const N_REPEATS: u64 = 3;

/// What is moved, and where to.
pub(crate) type Setting = Vec<(Lever, f64)>;

/// The drive without the starts that come before a simulator has settled.
pub(super) fn settled(drive: Drive) -> Drive {
    let late: Vec<usize> = drive.starts.iter().copied().filter(|start| *start >= SETTLED).collect();
    if late.len() >= ENOUGH { Drive { starts: late, ..drive } } else { drive }
}

/// A drive for a simulator that nothing is moved in.
pub(super) fn as_it_is(simulator: &SimulatorDescription, drive: &Drive) -> SimulatorRun {
    run_of(drive, &[], knobs(simulator, &Setting::new()))
}

/// Residuals of every drive under every setting, drive by drive; in standard deviations, as those of a model's rollouts.
pub(super) fn replayed<E>(
    simulator: &SimulatorDescription,
    drives: &[Drive],
    settings: &[Setting],
    yardstick: &Yardstick,
    run: &RunSimulator<'_, E>,
) -> Result<Vec<Vec<Vec<f32>>>, E> {
    let n_repeats = if simulator.stochastic { N_REPEATS } else { 1 };
    let mut runs = Vec::new();
    for setting in settings {
        let (wrapped, knobs) = (wrapped(setting), knobs(simulator, setting));
        for drive in drives {
            let one = run_of(drive, &wrapped, knobs.clone());
            runs.extend((0..n_repeats).map(|seed| SimulatorRun { seed, ..one.clone() }));
        }
    }
    let motions = run(&runs)?;
    let mut repeats = motions.chunks(n_repeats as usize);
    let of_setting = |setting: &Setting| {
        let sensors = SensorModel::of(&wrapped(setting));
        let of_drive = |drive: &Drive| {
            let motions = repeats.next().unwrap_or_default();
            mean(motions.iter().map(|motion| residuals(drive, motion, &sensors, yardstick)))
        };
        drives.iter().map(of_drive).collect()
    };
    Ok(settings.iter().map(of_setting).collect())
}

fn mean(mut all: impl ExactSizeIterator<Item = Vec<f32>>) -> Vec<f32> {
    let share = 1.0 / all.len().max(1) as f32;
    let mut sum = all.next().unwrap_or_default();
    all.for_each(|other| sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other));
    sum.iter_mut().for_each(|sum| *sum *= share);
    sum
}

/// The effects of a setting in the order of a machine.
fn wrapped(setting: &Setting) -> Vec<Effect> {
    let effects: Vec<Effect> = setting.iter().filter_map(|(lever, place)| lever.effect(*place)).collect();
    composed(&[], &effects)
}

/// All knobs: as they are set, or as they are by default.
fn knobs(simulator: &SimulatorDescription, setting: &Setting) -> BTreeMap<String, f64> {
    let mut knobs: BTreeMap<String, f64> =
        simulator.knobs.iter().map(|knob| (knob.name.clone(), knob.default)).collect();
    let set = setting.iter().filter(|(lever, _)| matches!(lever, Lever::Knob(_)));
    knobs.extend(set.map(|(lever, place)| (lever.name().to_owned(), lever.value(*place))));
    knobs
}

fn run_of(drive: &Drive, effects: &[Effect], knobs: BTreeMap<String, f64>) -> SimulatorRun {
    let n_rows = drive.starts.last().map_or(0, |last| last + N_STEPS + 1).min(drive.commands.len());
    let [command_speed_mps, command_steering_rad] = wrapped_commands(drive, effects, n_rows);
    let [slope_ahead, slope_left] = slopes(drive, n_rows);
    let [x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps, _] = drive.smooth.each_ref().map(|values| values[0]);
    SimulatorRun {
        start: StartState { x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps },
        step_s: STEP_S,
        command_speed_mps,
        command_steering_rad,
        slope_ahead,
        slope_left,
        terrain_class: drive.class[..n_rows].iter().map(|class| *class as u8).collect(),
        seed: 0,
        knobs,
    }
}

/// Speed and steering angle of every row after the effects on commands, which know the whole history.
fn wrapped_commands(drive: &Drive, effects: &[Effect], n_rows: usize) -> [Vec<f64>; 2] {
    let model = Model { wheelbase_m: 1.0, limits: UNLIMITED, effects: effects.to_vec() };
    let stepper = Stepper::new(&model, STEP_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.fill_steady_state(drive.commands[0], &mut memory);
    let real = |value: f64| Real(Scalar, value);
    let rows = drive.commands[..n_rows].iter().enumerate().map(|(row, command)| {
        let command = [command.speed_mps, command.steering_rad].map(|value| real(f64::from(value)));
        let asked = stepper.asked(command, real(drive.smooth[VX][row]), &mut memory, row);
        (asked.speed.1, asked.steering.1)
    });
    let (speeds, angles) = rows.unzip();
    [speeds, angles]
}

/// Rise per metre ahead and to the left, as the robot stood.
fn slopes(drive: &Drive, n_rows: usize) -> [Vec<f64>; 2] {
    let at = |row: usize| {
        let [east, north] = drive.gradient.each_ref().map(|values| f64::from(values[row]));
        let (sine, cosine) = drive.smooth[YAW][row].sin_cos();
        (east * cosine + north * sine, north * cosine - east * sine)
    };
    let (ahead, left) = (0..n_rows).map(at).unzip();
    [ahead, left]
}

/// Simulated less measured at every horizon of every start; exactly 0 where nothing was measured, or simulated.
fn residuals(drive: &Drive, motion: &Motion, sensors: &SensorModel, yardstick: &Yardstick) -> Vec<f32> {
    let seen = seen(motion, sensors);
    let per_sigma = yardstick.per_sigma();
    let mut residuals = Vec::with_capacity(drive.starts.len() * per_sigma.len());
    for &start in &drive.starts {
        let origin = [X, Y, YAW].map(|quantity| seen[quantity][start]);
        let pairs = HORIZONS.iter().flat_map(|&steps| {
            let simulated = seen_from(origin, seen.each_ref().map(|values| values[start + steps]));
            simulated.into_iter().zip(drive.outcome(start, steps))
        });
        residuals.extend(pairs.zip(&per_sigma).map(|((simulated, measured), per_sigma)| {
            let difference = (simulated - measured) as f32 * per_sigma;
            if difference.is_nan() { 0.0 } else { difference }
        }));
    }
    residuals
}

/// What the sensors say of a motion.
fn seen(motion: &Motion, sensors: &SensorModel) -> [Vec<f64>; N_QUANTITIES] {
    let late = sensors.pose_latency_s / STEP_S;
    let aged = |values: &[f64]| -> Vec<f64> {
        let at = |row: usize| {
            let place = (row as f64 - late).max(0.0);
            let (below, share) = (place as usize, place.fract());
            let above = (below + 1).min(values.len() - 1);
            values[below] + share * (values[above] - values[below])
        };
        (0..values.len()).map(at).collect()
    };
    let yaw = unwrapped(&motion.yaw_rad);
    let mut seen = [aged(&motion.x_m), aged(&motion.y_m), aged(&yaw), Vec::new(), Vec::new(), Vec::new()];
    seen[YAW].iter_mut().for_each(|yaw| *yaw += sensors.yaw_offset_rad);
    seen[VX] = motion.speed_mps.iter().map(|speed| speed * sensors.velocity_ratio).collect();
    seen[WZ] = motion.yaw_rate_radps.iter().map(|rate| rate + sensors.yaw_rate_bias_radps).collect();
    let untold = || vec![f64::NAN; yaw.len()];
    seen[VY] = motion.side_speed_mps.clone().unwrap_or_else(untold);
    seen
}
