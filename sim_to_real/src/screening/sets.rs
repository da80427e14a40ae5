//! What only several drives together show: no excitation, the same drive twice.

use bicycle::DriveLog;

use super::holes;
use super::signals::Signals;
use super::statistics::mean_and_deviation;
use super::suspicion::Suspicion;

/// Below both there is nothing to learn from: steering [rad], speed as a share of its mean.
const STEERING_MIN_RAD: f64 = 0.003;
const SPEED_MIN_SHARE: f64 = 0.015;
/// Below one of them that half of the catalogue is out of reach.
const STEERING_LITTLE_RAD: f64 = 0.01;
const SPEED_LITTLE_SHARE: f64 = 0.04;

/// What is suspicious in simulated and real drives together, gravest first.
pub fn screen_sets(sim: &[DriveLog], real: &[DriveLog]) -> Vec<Suspicion> {
    let mut found = same_drives(sim, real);
    let bridged: Vec<DriveLog> = real.iter().map(holes::bridged).collect();
    let runs: Vec<Signals<'_>> = bridged.iter().flat_map(Signals::of).collect();
    found.extend(excitation(&runs));
    found.sort_by_key(Suspicion::gravity);
    found
}

fn same_drives(sim: &[DriveLog], real: &[DriveLog]) -> Vec<Suspicion> {
    let named = |kind: &str, logs: &[DriveLog]| {
        (1..=logs.len()).map(|n| format!("{kind} drive {n}")).collect::<Vec<_>>()
    };
    let names = [named("sim", sim), named("real", real)].concat();
    let logs: Vec<_> = sim.iter().chain(real).collect();
    let pairs = (0..logs.len()).flat_map(|other| (0..other).map(move |one| (one, other)));
    let same = pairs.filter(|(one, other)| logs[*one] == logs[*other]);
    same.map(|(one, other)| Suspicion::SameDrive { one: names[one].clone(), other: names[other].clone() })
        .collect()
}

fn excitation(runs: &[Signals<'_>]) -> Option<Suspicion> {
    // A skid-steered machine turns by other commands.
    let steering =
        runs.iter().filter_map(|run| run.steering).flat_map(|steering| steering.values.iter().copied());
    let has_steering = runs.iter().any(|run| run.steering.is_some());
    let speeds = runs.iter().filter_map(Signals::any_speed).flat_map(|speed| speed.values.iter().copied());
    let (_, steering_rad) = mean_and_deviation(steering);
    let (mean_mps, speed_mps) = mean_and_deviation(speeds);
    let share = speed_mps / mean_mps.abs().max(1e-6);
    if !has_steering {
        return None;
    }
    if steering_rad < STEERING_MIN_RAD && share < SPEED_MIN_SHARE {
        return Some(Suspicion::NoExcitation { steering_rad, speed_mps });
    }
    if steering_rad < STEERING_LITTLE_RAD {
        return Some(Suspicion::LittleSteering { deviation_rad: steering_rad });
    }
    let is_little = share < SPEED_LITTLE_SHARE && mean_mps != 0.0;
    is_little.then_some(Suspicion::LittleSpeedChange { share_percent: 100.0 * share })
}
