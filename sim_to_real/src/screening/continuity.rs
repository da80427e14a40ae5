//! Gaps in time, leaps of the pose, and the drive without them.

use std::f64::consts::TAU;

use bicycle::{Column, DriveLog, DriveLogError};

use super::Machine;
use super::holes;
use super::signals::Signals;
use super::statistics::quantile;
use super::suspicion::Suspicion;

/// Driving that is needed at least, over all runs [s].
const DURATION_MIN_S: f64 = 8.0;
/// Rows further apart are no control log [s].
const STEP_MAX_S: f64 = 0.5;
/// A gap is this many steps long, and at least this long [s].
const GAP_STEPS: f64 = 5.0;
const GAP_MIN_S: f64 = 0.15;
/// A leap is this many times what all but one in twenty steps miss.
const LEAP_FACTOR: f64 = 8.0;
/// And more than this share of the wheelbase, and this [m].
const LEAP_WHEELBASES: f64 = 0.25;
const LEAP_MIN_M: f64 = 0.1;
const YAW_LEAP_MIN_RAD: f64 = 0.5;
/// How near to the origin or to the start a reset goes [m].
const RESET_WITHIN_M: f64 = 0.1;
/// One break in this time is an accident, more are no drive [s].
const SECONDS_PER_BREAK: f64 = 5.0;
/// What is left of a run must be as long as the longest rollout after the settling time [s].
const PIECE_MIN_S: f64 = 4.0;

/// What is missing; nothing else can be checked then.
pub(super) fn lacking(runs: &[Signals<'_>], log: &DriveLog) -> Vec<Suspicion> {
    let commands =
        [Column::CmdSpeed, Column::CmdSteer, Column::SteerMeas, Column::CmdAccel, Column::CmdThrottle];
    let skid = [Column::CmdWz, Column::CmdLeft, Column::CmdRight];
    let measured = [Column::X, Column::Yaw, Column::Vx, Column::Wz, Column::WheelSpeed];
    let has = |columns: &[Column]| log.columns().any(|column| columns.contains(&column));
    let mut found = Vec::new();
    if !has(&commands) && !has(&skid) {
        found.push(Suspicion::Lacking { expected: "a command: cmd_speed, cmd_steer or the like" });
    }
    if !has(&measured) {
        found.push(Suspicion::Lacking { expected: "a motion: x and y, yaw, vx or wz" });
    }
    let step_s = runs.first().map_or(0.0, |run| run.step_s);
    if step_s > STEP_MAX_S {
        let unit = if step_s > 1e5 { "microseconds or nanoseconds" } else { "milliseconds" };
        found.push(Suspicion::ClockUnit { step_s, unit });
        return found;
    }
    let found_s = runs.iter().map(Signals::duration_s).sum();
    if found_s < DURATION_MIN_S {
        found.push(Suspicion::TooShort { needed_s: DURATION_MIN_S, found_s });
    }
    found.extend(holes::mostly_missing(runs, log));
    found
}

/// Gaps and leaps, or that there are too many.
pub(super) fn breaks(runs: &[Signals<'_>], machine: &Machine) -> Vec<Suspicion> {
    let found: Vec<_> = located(runs, machine).into_iter().map(|(_, suspicion)| suspicion).collect();
    let duration_s: f64 = runs.iter().map(Signals::duration_s).sum();
    let n = found.len();
    match found.first() {
        Some(first) if n as f64 * SECONDS_PER_BREAK > duration_s => {
            vec![Suspicion::ManyBreaks { n, duration_s, first: Box::new(first.clone()) }]
        }
        _ => found,
    }
}

/// Breaks with the row of the log after which they lie, in order.
fn located(runs: &[Signals<'_>], machine: &Machine) -> Vec<(usize, Suspicion)> {
    let limits = Limits::of(runs, machine);
    let of_run = |run: &Signals<'_>| {
        let break_after = |row| Some((run.first_row + row, limits.break_after(run, row)?));
        (0..run.n() - 1).filter_map(break_after).collect::<Vec<_>>()
    };
    runs.iter().flat_map(of_run).collect()
}

/// What no step exceeds unless something broke.
struct Limits {
    gap_s: f64,
    leap_m: f64,
    yaw_leap_rad: f64,
}

impl Limits {
    fn of(runs: &[Signals<'_>], machine: &Machine) -> Self {
        let steps = || runs.iter().flat_map(|run| (0..run.n() - 1).map(move |row| (run, row)));
        let usual = |misses: Vec<f64>| LEAP_FACTOR * quantile(misses, 0.95);
        let leaps = steps().filter_map(|(run, row)| leap(run, row)).map(|[length, told]| length - told);
        let yaw_leaps =
            steps().filter_map(|(run, row)| yaw_leap(run, row)).map(|[angle, told]| (angle - told).abs());
        let least_m = LEAP_WHEELBASES * machine.wheelbase_m + LEAP_MIN_M;
        Self {
            gap_s: (GAP_STEPS * runs[0].step_s).max(GAP_MIN_S),
            leap_m: usual(leaps.map(f64::abs).collect()).max(least_m),
            yaw_leap_rad: usual(yaw_leaps.collect()).max(YAW_LEAP_MIN_RAD),
        }
    }

    fn break_after(&self, run: &Signals<'_>, row: usize) -> Option<Suspicion> {
        let length_s = run.time_s[row + 1] - run.time_s[row];
        let place = || run.place(row);
        if length_s > self.gap_s {
            return Some(Suspicion::Gap { place: place(), length_s, step_s: run.step_s });
        }
        if let Some([length_m, explained_m]) = leap(run, row)
            && (length_m - explained_m) > self.leap_m
        {
            return Some(leap_or_reset(run, row, length_m, explained_m));
        }
        let [angle_rad, explained_rad] = yaw_leap(run, row)?;
        let is_leap = (angle_rad - explained_rad).abs() > self.yaw_leap_rad;
        is_leap.then(|| Suspicion::YawLeap { place: place(), angle_rad, explained_rad })
    }
}

fn leap_or_reset(run: &Signals<'_>, row: usize, length_m: f64, explained_m: f64) -> Suspicion {
    let place = run.place(row);
    let [x_m, y_m] = run.position_m.map_or([f64::NAN; 2], |[x, y]| [x[row + 1], y[row + 1]]);
    let is_back = run.moved_m(0, row + 1).is_some_and(|way_m| way_m < RESET_WITHIN_M);
    if is_back || x_m.hypot(y_m) < RESET_WITHIN_M {
        Suspicion::Reset { place, length_m, x_m, y_m }
    } else {
        Suspicion::Leap { place, length_m, explained_m }
    }
}

/// Length of a step and what the speed explains of it [m].
fn leap(run: &Signals<'_>, row: usize) -> Option<[f64; 2]> {
    let length_s = run.time_s[row + 1] - run.time_s[row];
    let speed = run.any_speed().map_or(0.0, |speed| speed.values[row].abs().max(speed.values[row + 1].abs()));
    Some([run.moved_m(row, row + 1)?, speed * length_s])
}

/// Turn of a step and what the yaw rate explains of it [rad].
fn yaw_leap(run: &Signals<'_>, row: usize) -> Option<[f64; 2]> {
    let yaw = run.yaw?.values;
    let turn = yaw[row + 1] - yaw[row];
    let length_s = run.time_s[row + 1] - run.time_s[row];
    let explained =
        run.yaw_rate.map_or(0.0, |rate| 0.5 * (rate.values[row] + rate.values[row + 1]) * length_s);
    let turn = turn - TAU * ((turn - explained) / TAU).round();
    Some([turn, explained])
}

/// The drive with a new run after every gap and leap: what lies across one is no motion. Pieces of a split run that
/// are shorter than 4 s are left out; runs without a break stay as they are.
///
/// Errors: names of runs that clash once the pieces are numbered.
pub fn split_at_breaks(machine: &Machine, log: &DriveLog) -> Result<DriveLog, DriveLogError> {
    let bridged = holes::bridged(log);
    let breaks = located(&Signals::of(&bridged), machine).into_iter().map(|(row, _)| row).collect::<Vec<_>>();
    let runs = Signals::of(log);
    let mut split = DriveLog::default();
    for run in &runs {
        let own = run.first_row..run.first_row + run.n();
        let cuts: Vec<usize> =
            breaks.iter().filter(|row| own.contains(*row)).map(|row| row + 1 - run.first_row).collect();
        let rows: Vec<_> = run.run.drive_rows().collect();
        let starts = std::iter::once(0).chain(cuts.iter().copied());
        let ends = cuts.iter().copied().chain([run.n()]);
        for (piece, (start, end)) in starts.zip(ends).enumerate() {
            let length_s = run.time_s[end - 1] - run.time_s[start];
            if !cuts.is_empty() && length_s < PIECE_MIN_S {
                continue;
            }
            let name = match (cuts.is_empty(), run.run.name()) {
                (true, name) => name.to_owned(),
                (false, "") => format!("part {}", piece + 1),
                (false, name) => format!("{name}, part {}", piece + 1),
            };
            rows[start..end].iter().try_for_each(|row| split.push(&name, row))?;
        }
    }
    Ok(split)
}
