//! Intervals of what is announced, from how the stretches of the drives differ about it.

use super::lever::Lever;
use super::replay::Setting;
use super::search::mean;
use super::trial::Trial;
use super::types::{CauseKind, SimulatorCause};
use crate::answer::Estimate;
use crate::drive::STEP_S;

/// Half the width of a 90 % interval in standard errors of a dozen stretches (Student).
const STUDENT_90: f64 = 1.8;
/// What is left open by a search that ends, in distances from what the simulator has.
const RESOLUTION: f64 = 0.02;
/// Whether a command that a robot delays or smooths changes early or late within a row of the log is not known [s].
const HALF_A_ROW_S: f64 = 0.5 * STEP_S;
/// The losses are seen this far to either side, in distances from what the simulator has.
const ASIDE: f64 = 0.1;
/// A limit's logarithm at most this far.
const FARTHEST: f64 = 0.15;

/// The levers of a setting with their values and intervals.
pub(super) fn causes<E>(trial: &Trial<'_, E>, setting: &Setting) -> Result<Vec<SimulatorCause>, E> {
    (0..setting.len()).map(|index| cause(trial, setting, index)).collect()
}

fn cause<E>(trial: &Trial<'_, E>, setting: &Setting, index: usize) -> Result<SimulatorCause, E> {
    let (lever, place) = &setting[index];
    let distance = (place - lever.neutral()).abs();
    let aside = (ASIDE * distance).clamp(1e-6, FARTHEST.max(ASIDE * distance.min(1.0)));
    let moved = |by: f64| {
        let mut moved = setting.clone();
        moved[index].1 += by;
        moved
    };
    let losses = trial.losses(&[moved(-aside), setting.clone(), moved(aside)])?;
    let [below, here, above] = &losses[..] else { return Ok(told(lever, *place, f64::INFINITY)) };
    let bend = (mean(above) - 2.0 * mean(here) + mean(below)) / aside.powi(2);
    let slopes: Vec<f64> =
        above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * aside)).collect();
    let (n, middle) = (slopes.len() as f64, mean(&slopes));
    let squares: f64 = slopes.iter().map(|slope| (slope - middle).powi(2)).sum();
    let error = if bend > 0.0 && n > 1.0 { (squares / (n * (n - 1.0))).sqrt() / bend } else { f64::INFINITY };
    let unknown = if lever.kind() == CauseKind::Effect && lever.unit() == "s" { HALF_A_ROW_S } else { 0.0 };
    Ok(told(lever, *place, (STUDENT_90 * error).hypot(RESOLUTION * distance) + unknown))
}

fn told(lever: &Lever, place: f64, half: f64) -> SimulatorCause {
    let [first, last] = lever.ends();
    let at = |place: f64| lever.value(place.clamp(first, last));
    SimulatorCause {
        name: lever.name().to_owned(),
        kind: lever.kind(),
        parameter: lever.parameter_name().to_owned(),
        unit: lever.unit().to_owned(),
        nominal: lever.nominal(),
        found: Estimate { value: at(place), low: at(place - half), high: at(place + half) },
    }
}
