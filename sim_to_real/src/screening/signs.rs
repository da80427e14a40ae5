//! Mirrored signs and axes: two measurements of the same turn against each other.

use bicycle::Column;
use std::f64::consts::{PI, TAU};

use super::Machine;
use super::signals::{Signals, unwrapped};
use super::statistics::{Pairs, quantile};
use super::suspicion::Suspicion;
use super::units::turns;

/// The steering may act this much later [s].
const LAGS_S: [f64; 9] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
/// Correlations beyond this are a sign; between, nothing is said.
const SURE: f64 = 0.5;
/// A mirrored steering's correlation is nowhere larger than this.
const CONTRADICTED: f64 = 0.15;
/// Motion and nose may point this far apart [rad].
const OFFSET_MAX_RAD: f64 = 0.5;

pub(super) fn check(runs: &[Signals<'_>], machine: &Machine) -> Vec<Suspicion> {
    let turning = [yaw_against_rate(runs), course_against_yaw(runs)];
    let mut found: Vec<_> = turning.into_iter().flatten().collect();
    if found.is_empty() {
        found.extend(steering(runs, machine));
        found.extend(offset(runs));
        found.extend(side_speed(runs));
    }
    found
}

fn steering(runs: &[Signals<'_>], machine: &Machine) -> Option<Suspicion> {
    let column = runs.iter().find_map(|run| run.steering)?.name();
    let signals: Vec<_> = runs
        .iter()
        .filter_map(|run| Some((run.kinematic_radps(machine.wheelbase_m)?, run.turning_radps()?)))
        .collect();
    let at_lag = |lag_s: f64| {
        let lag = (lag_s / runs[0].step_s).round() as usize;
        let late = signals
            .iter()
            .flat_map(|(asked, turned)| asked.iter().copied().zip(turned.iter().skip(lag).copied()));
        let pairs = Pairs::of(late);
        // A yaw rate of noise alone has no sign.
        (pairs.are_enough() && pairs.deviation(1) > 0.005).then(|| (lag_s, pairs.correlation()))
    };
    let correlations: Vec<_> = LAGS_S.into_iter().filter_map(at_lag).collect();
    let most = correlations.iter().map(|(_, correlation)| *correlation).fold(-1.0, f64::max);
    let (lag_s, correlation) = correlations.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let is_mirrored = correlation < -SURE && most < CONTRADICTED;
    is_mirrored.then_some(Suspicion::MirroredSteering { column, correlation, lag_s })
}

fn yaw_against_rate(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let both = run.yaw.zip(run.yaw_rate);
        both.map(|(yaw, rate)| turns(run, &unwrapped(yaw.values, TAU), rate.values)).unwrap_or_default()
    }));
    against("yaw", "wz", &pairs)
}

fn against(one: &'static str, other: &'static str, pairs: &Pairs) -> Option<Suspicion> {
    let correlation = pairs.correlation();
    let is_told = pairs.are_enough() && correlation < -SURE;
    is_told.then_some(Suspicion::AgainstEachOther { one, other, correlation })
}

/// Direction of motion between neighbouring windows, against the yaw.
fn course_against_yaw(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let courses = courses(run);
        let yaw = run.yaw.map(|yaw| unwrapped(yaw.values, TAU)).unwrap_or_default();
        let turn = |pair: &[(usize, f64)]| {
            let [(from, before), (to, after)] = [pair[0], pair[1]];
            (wrapped(after - before), yaw[to] - yaw[from])
        };
        if yaw.is_empty() { Vec::new() } else { courses.windows(2).map(turn).collect() }
    }));
    against("the path (x, y)", "yaw", &pairs)
}

/// Row and direction of motion of the nose in the middle of windows that went far enough, one after the other.
fn courses(run: &Signals<'_>) -> Vec<(usize, f64)> {
    let Some([x, y]) = run.position_m else { return Vec::new() };
    let mut end = 0;
    let apart = run.windows().filter(|(from, to)| {
        let is_next = *from >= end;
        end = if is_next { *to } else { end };
        is_next
    });
    let course = |(from, to): (usize, usize)| {
        let middle = usize::midpoint(from, to);
        let is_reverse = run.any_speed().is_some_and(|speed| speed.values[middle] < 0.0);
        let course = (y[to] - y[from]).atan2(x[to] - x[from]) + if is_reverse { PI } else { 0.0 };
        (run.moved_m(from, to)? > 0.15).then_some((middle, course))
    };
    apart.filter_map(course).collect()
}

fn offset(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let offsets = runs.iter().flat_map(|run| {
        let yaw = run.yaw.map(|yaw| yaw.values);
        courses(run).into_iter().filter_map(move |(row, course)| Some(wrapped(course - yaw?[row])))
    });
    let offsets: Vec<f64> = offsets.collect();
    // Around the mean direction, so that offsets near half a turn do not cancel.
    let sums = offsets.iter().fold([0.0, 0.0], |sum, offset| [sum[0] + offset.cos(), sum[1] + offset.sin()]);
    let mean = sums[1].atan2(sums[0]);
    let enough = offsets.len() >= 20;
    let offset_rad =
        wrapped(mean + quantile(offsets.iter().map(|offset| wrapped(offset - mean)).collect(), 0.5));
    (enough && offset_rad.abs() > OFFSET_MAX_RAD).then_some(Suspicion::YawOffset { offset_rad })
}

/// Velocity to the left, as it is told and as the path has it.
fn side_speed(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let told = run.run.column(Column::Vy);
        let both = move |(from, to)| Some((told?[usize::midpoint(from, to)], run.moved_left_mps(from, to)?));
        run.windows().filter_map(both)
    }));
    let correlation = pairs.correlation();
    let is_told = pairs.are_enough() && correlation < -SURE;
    is_told.then_some(Suspicion::SideSpeedAgainstPath { correlation })
}

fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}
