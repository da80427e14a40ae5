//! Degrees for radians, other units for metres per second: ratios between two measurements of the same motion.

use std::f64::consts::{PI, TAU};

use super::Machine;
use super::signals::{Signals, unwrapped};
use super::statistics::{Pairs, quantile};
use super::suspicion::Suspicion;

/// Degrees in a radian.
const DEGREES: f64 = 180.0 / PI;
/// A ratio within this factor of 57.3 is degrees; no effect comes near.
const DEGREES_BAND: f64 = 2.5;
/// A ratio this near to a unit's, relatively, is that unit.
const UNIT_BAND: f64 = 0.045;
/// Angle of a wheel or of a body that no vehicle has [rad].
const ANGLE_MAX_RAD: f64 = 1.5;
/// What a unit of speed is in m/s.
const UNITS: [(&str, f64); 5] =
    [("km/h", 1.0 / 3.6), ("mph", 0.447_04), ("feet", 0.3048), ("centimetres", 0.01), ("millimetres", 0.001)];
/// Path over integrated speed outside this range is no sensor's error.
const PATH_RATIO: [f64; 2] = [0.6, 1.6];
/// Less motion in a window is noise [m].
const WAY_MIN_M: f64 = 0.03;

pub(super) fn check(runs: &[Signals<'_>], machine: &Machine) -> Vec<Suspicion> {
    let angles = [steering(runs, machine), yaw(runs), attitude(runs)].into_iter().flatten();
    let mut found: Vec<_> = angles.collect();
    found.extend(path_against_speed(runs));
    found.extend(commanded_speed(runs));
    found
}

fn is_degrees(ratio: f64) -> bool {
    (DEGREES / DEGREES_BAND..DEGREES * DEGREES_BAND).contains(&ratio)
}

fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}

fn degrees(column: &'static str, evidence: String) -> Option<Suspicion> {
    Some(Suspicion::Degrees { column, evidence })
}

/// By its size, or by the yaw rate that it would give.
fn steering(runs: &[Signals<'_>], machine: &Machine) -> Option<Suspicion> {
    let column = runs.iter().find_map(|run| run.steering)?.name();
    let most = largest(runs.iter().filter_map(|run| run.steering).flat_map(|steering| steering.values));
    if most > ANGLE_MAX_RAD {
        return degrees(column, format!("the largest is {most:.1}"));
    }
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let kinematic = run.kinematic_radps(machine.wheelbase_m).unwrap_or_default();
        kinematic.into_iter().zip(run.turning_radps().unwrap_or_default())
    }));
    let ratio = pairs.ratio();
    if !pairs.are_enough() || pairs.correlation().abs() < 0.5 {
        return None;
    }
    let told =
        |what: &str| format!("the yaw rate is {ratio:.3} times speed x tan({column}) / wheelbase{what}");
    if is_degrees(ratio) {
        let rate = runs.iter().find_map(|run| run.yaw_rate.or(run.yaw))?.name();
        return degrees(rate, told(""));
    }
    if is_degrees(1.0 / ratio) { degrees(column, told("")) } else { None }
}

/// By leaps of 360, or against the yaw rate.
fn yaw(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let leap = |run: &Signals<'_>| {
        let steps = run.yaw?.values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.enumerate().find(|(_, step)| (step - 360.0).abs() < 30.0).map(|(row, _)| run.place(row))
    };
    if let Some(place) = runs.iter().find_map(leap) {
        return degrees("yaw", format!("it leaps by 360 after {place}"));
    }
    let against = |turn: f64| {
        Pairs::of(runs.iter().flat_map(|run| {
            let both = run.yaw.zip(run.yaw_rate);
            both.map(|(yaw, rate)| turns(run, &unwrapped(yaw.values, turn), rate.values)).unwrap_or_default()
        }))
    };
    let (in_radians, in_degrees) = (against(TAU), against(360.0));
    if !in_radians.are_enough() {
        return None;
    }
    let best = if in_radians.correlation() > in_degrees.correlation() { in_radians } else { in_degrees };
    let ratio = best.ratio();
    let told = format!("the yaw turns {ratio:.3} times as far as the yaw rate says");
    if best.correlation() < 0.5 {
        return None;
    }
    if is_degrees(ratio) {
        return degrees("yaw", told);
    }
    if is_degrees(1.0 / ratio) { degrees("wz", told) } else { None }
}

/// Turns over every window: by the yaw rate, by the yaw.
pub(super) fn turns(run: &Signals<'_>, yaw: &[f64], yaw_rate: &[f64]) -> Vec<(f64, f64)> {
    let turned = run.summed(yaw_rate);
    run.windows().map(|(from, to)| (turned[to] - turned[from], yaw[to] - yaw[from])).collect()
}

/// By its size, or by the heights driven over.
fn attitude(runs: &[Signals<'_>]) -> Option<Suspicion> {
    use bicycle::Column;
    let angles = |column| runs.iter().filter_map(move |run| run.run.column(column));
    for column in [Column::Roll, Column::Pitch] {
        let most = largest(angles(column).flatten());
        if most > ANGLE_MAX_RAD {
            return degrees(column.name(), format!("the largest is {most:.1}"));
        }
    }
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let both = run.run.column(Column::Z).zip(run.run.column(Column::Pitch));
        both.map(|(height_m, pitch)| slopes(run, height_m, pitch)).unwrap_or_default()
    }));
    let is_told = pairs.are_enough() && pairs.correlation() < -0.5 && is_degrees(pairs.ratio());
    let told = || format!("the pitch is {:.1} times the slope driven over", pairs.ratio());
    if is_told { degrees("roll and pitch", told()) } else { None }
}

/// Rise per metre and pitch over every window that went somewhere.
fn slopes(run: &Signals<'_>, height_m: &[f64], pitch: &[f64]) -> Vec<(f64, f64)> {
    let slope = |(from, to): (usize, usize)| {
        let moved_m = run.moved_m(from, to)?;
        let rise_m = height_m[to] - height_m[from];
        (moved_m > 0.3).then(|| (rise_m / moved_m, 0.5 * (pitch[from] + pitch[to])))
    };
    run.windows().filter_map(slope).collect()
}

/// The unit of speed that a ratio stands for, of the quantity that is too large by it.
fn unit(ratio: f64) -> Option<&'static str> {
    UNITS.iter().find(|(_, unit)| (ratio / unit - 1.0).abs() < UNIT_BAND).map(|(name, _)| *name)
}

fn path_against_speed(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let column = runs.iter().find_map(|run| run.speed)?.name();
    let ratio = path_ratio(runs, |run, from, to| run.moved_m(from, to))?;
    let is_usual = |ratio: f64| (PATH_RATIO[0]..PATH_RATIO[1]).contains(&ratio);
    if is_usual(ratio) {
        return None;
    }
    let evidence = format!("the path is {ratio:.4} times as long as {column} says");
    Some(match (unit(ratio), unit(1.0 / ratio)) {
        (Some(unit), _) => Suspicion::Unit { column, unit, evidence },
        (_, Some(unit)) => Suspicion::Unit { column: "x and y", unit, evidence },
        // Who slides sideways goes farther than the speed ahead says.
        _ if path_ratio(runs, |run, from, to| run.moved_ahead_m(from, to)).is_some_and(is_usual) => {
            return None;
        }
        _ => Suspicion::PathAgainstSpeed { ratio },
    })
}

/// Path over integrated speed: the median over windows with much speed, which leaps do not reach.
fn path_ratio(
    runs: &[Signals<'_>],
    moved_m: impl Fn(&Signals<'_>, usize, usize) -> Option<f64>,
) -> Option<f64> {
    let ways: Vec<[f64; 2]> = runs
        .iter()
        .flat_map(|run| {
            let travelled = run.speed.map(|speed| run.summed(speed.values)).unwrap_or_default();
            let way = |(from, to): (usize, usize)| {
                Some([(travelled.get(to)? - travelled.get(from)?).abs(), moved_m(run, from, to)?])
            };
            run.windows().filter_map(way).collect::<Vec<_>>()
        })
        .collect();
    let much_m = 0.3 * quantile(ways.iter().map(|[told, _]| *told).collect(), 0.9);
    let moving = ways.iter().filter(|[told, _]| *told > much_m.max(WAY_MIN_M));
    let ratios: Vec<f64> = moving.map(|[told, moved]| moved / told).collect();
    (ratios.len() >= 20).then(|| quantile(ratios, 0.5))
}

/// Only a unit's ratio is told: slower than commanded is what a diagnosis is for.
fn commanded_speed(runs: &[Signals<'_>]) -> Option<Suspicion> {
    let pairs = Pairs::of(runs.iter().flat_map(|run| {
        let both = run.commanded_speed.zip(run.speed);
        let values = both.map(|(commanded, speed)| commanded.values.iter().zip(speed.values));
        values.into_iter().flatten().map(|(commanded, speed)| (*commanded, *speed))
    }));
    let ratio = pairs.ratio();
    let unit = unit(ratio)?;
    let is_told = pairs.are_enough() && pairs.size_of_second() > 0.05;
    let evidence = format!("the vehicle drives {ratio:.4} times as fast as commanded");
    is_told.then_some(Suspicion::Unit { column: "cmd_speed", unit, evidence })
}
