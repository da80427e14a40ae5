//! Whether a drive shows anything: standstill, frozen measurements, commands and places beyond the description.

use bicycle::Column;

use super::Machine;
use super::signals::{Signal, Signals};
use super::statistics::quantile;
use super::suspicion::Suspicion;

/// Way that is a drive, in wheelbases.
const WAY_MIN_WHEELBASES: f64 = 2.0;
/// A value that repeats exactly for this long is no measurement [s], if the vehicle moved this far meanwhile [m].
const HOLD_S: f64 = 1.0;
const HOLD_WAY_M: f64 = 1.0;
/// Driven over commanded speed above which the vehicle moves, and below which it stands.
const MOVES_SHARE: f64 = 0.5;
const STANDS_SHARE: f64 = 0.03;
/// A drive that stands for this long is stuck and not slow [s].
const STALL_S: f64 = 3.0;
/// Commands may exceed the description by rounding only.
const LIMIT_MARGIN: f64 = 1.05;
/// Share of positions that may lie beside the map.
const OFF_MAP_MAX: f64 = 0.2;

pub(super) fn standstill(runs: &[Signals<'_>], machine: &Machine) -> Option<Suspicion> {
    let way = |run: &Signals<'_>| {
        let travelled = run.any_speed().map(|speed| way_m(run, speed));
        let apart = run.windows().filter_map(|(from, to)| run.moved_m(from, to)).fold(0.0, f64::max);
        travelled.unwrap_or(0.0).max(if run.speed.is_none() { apart } else { 0.0 })
    };
    let path_m: f64 = runs.iter().map(way).sum();
    // A log of yaw rates alone cannot tell.
    let is_known = runs.iter().any(|run| run.any_speed().is_some() || run.position_m.is_some());
    let duration_s = runs.iter().map(Signals::duration_s).sum();
    let stands = is_known && path_m < WAY_MIN_WHEELBASES * machine.wheelbase_m;
    stands.then_some(Suspicion::Standstill { path_m, duration_s })
}

fn way_m(run: &Signals<'_>, speed: Signal<'_>) -> f64 {
    let speeds: Vec<f64> = speed.values.iter().map(|speed| speed.abs()).collect();
    run.summed(&speeds).last().copied().unwrap_or(0.0)
}

/// Measurements that repeat exactly while the vehicle moves.
pub(super) fn frozen(runs: &[Signals<'_>]) -> Vec<Suspicion> {
    let columns = [Column::X, Column::Yaw, Column::Vx, Column::Wz];
    columns.into_iter().filter_map(|column| runs.iter().find_map(|run| longest_hold(run, column))).collect()
}

fn longest_hold(run: &Signals<'_>, column: Column) -> Option<Suspicion> {
    let values = run.run.column(column)?;
    // Driving straight along an axis keeps x or yaw; only the steering tells that it should change.
    let steering = run.steering?.values;
    let witness = if column == Column::Vx { run.commanded_speed? } else { run.any_speed()? };
    let travelled = run.summed(witness.values);
    let (mut start, mut longest) = (0, (0, 0));
    for row in 1..run.n() {
        start = if values[row] == values[start] { start } else { row };
        longest = if row - start > longest.1 - longest.0 { (start, row) } else { longest };
    }
    let (start, end) = longest;
    let hold_s = run.time_s[end] - run.time_s[start];
    let way_m = (travelled[end] - travelled[start]).abs();
    let steers = steering[start..=end].iter().any(|angle| angle.abs() > 0.02);
    let is_frozen = hold_s > HOLD_S && way_m > HOLD_WAY_M && steers;
    let (value, place, speed_mps) = (values[start], run.place(start), way_m / hold_s);
    is_frozen.then(|| Suspicion::Frozen { column: column.name(), value, place, hold_s, speed_mps })
}

/// Stretches in which the vehicle stands although it is asked for a speed at which it moves elsewhere.
pub(super) fn stalled(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let rows = runs.iter().filter_map(|run| Some((run.commanded_speed?.values, run.speed?.values)));
    let pairs = rows.flat_map(|(asked, driven)| asked.iter().zip(driven));
    let moved = pairs.filter(|(asked, driven)| driven.abs() > MOVES_SHARE * asked.abs() && asked.abs() > 0.0);
    let moves_mps = quantile(moved.map(|(asked, _)| asked.abs()).collect(), 0.25);
    let stall = |run: &Signals<'_>| {
        let (asked, driven) = (run.commanded_speed?.values, run.speed?.values);
        let stands =
            |row: usize| asked[row].abs() > moves_mps && driven[row].abs() < STANDS_SHARE * asked[row].abs();
        let (start, end) = longest_stretch(run.n(), stands)?;
        let length_s = run.time_s[end] - run.time_s[start];
        let (place, asked_mps) = (run.place(start), asked[start]);
        (length_s > STALL_S).then_some(Suspicion::Stalled { place, length_s, asked_mps })
    };
    runs.iter().find_map(stall)
}

/// First and last row of the longest stretch of rows that `is_in`.
fn longest_stretch(n: usize, is_in: impl Fn(usize) -> bool) -> Option<(usize, usize)> {
    let mut longest: Option<(usize, usize)> = None;
    let mut start = None;
    for row in 0..n {
        start = if is_in(row) { start.or(Some(row)) } else { None };
        if let Some(start) = start
            && longest.is_none_or(|(from, to)| row - start > to - from)
        {
            longest = Some((start, row));
        }
    }
    longest
}

/// Commands and places that the vehicle's description does not allow.
pub(super) fn beyond(runs: &[Signals<'_>], machine: &Machine) -> Vec<Suspicion> {
    let limits = [(Column::CmdSteer, machine.steering_max_rad), (Column::CmdSpeed, machine.speed_max_mps)];
    let mut found: Vec<_> = limits.iter().filter_map(|(column, limit)| over(runs, *column, *limit)).collect();
    found.extend(off_map(runs, machine));
    found
}

fn over(runs: &[Signals<'_>], column: Column, limit: f64) -> Option<Suspicion> {
    let rows = runs.iter().flat_map(|run| {
        let values = run.run.column(column).unwrap_or_default();
        values.iter().enumerate().map(move |(row, value)| (run, row, value.abs()))
    });
    let (run, row, found) = rows.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let is_over = found > LIMIT_MARGIN * limit;
    is_over.then(|| Suspicion::BeyondLimit { column: column.name(), limit, found, place: run.place(row) })
}

fn off_map(runs: &[Signals<'_>], machine: &Machine) -> Option<Suspicion> {
    let ground = machine.ground.as_ref()?;
    let is_on = |position_m: [f64; 2]| {
        (0..2).all(|axis| {
            let node = (position_m[axis] - ground.origin_m[axis]) / ground.resolution_m;
            (-0.5..ground.n_nodes[axis] as f64 - 0.5).contains(&node)
        })
    };
    let positions = runs.iter().filter_map(|run| run.position_m);
    let on_map: Vec<bool> = positions
        .flat_map(|[x, y]| x.iter().zip(y).map(|(x, y)| is_on([*x, *y])).collect::<Vec<_>>())
        .collect();
    let n_off = on_map.iter().filter(|is_on| !**is_on).count();
    let share = n_off as f64 / on_map.len().max(1) as f64;
    (share > OFF_MAP_MAX).then_some(Suspicion::OffMap { share_percent: 100.0 * share })
}
