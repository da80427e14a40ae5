//! What is wrong with a drive before any model is asked: gaps, leaps, units, signs, too little of everything.
//!
//! Every check is arithmetic between measurements of the same drive (path against speed, yaw against yaw rate, yaw rate
//! against speed times tan(steering) / wheelbase) and needs no model and no other drive. A log that fails one would
//! still be diagnosed, confidently and wrongly.

mod continuity;
mod excitation;
mod holes;
mod sets;
mod signals;
mod signs;
mod statistics;
mod suspicion;
mod units;

use bicycle::DriveLog;

use crate::Machine;
pub use continuity::split_at_breaks;
pub use sets::screen_sets;
use signals::Signals;
pub(crate) use statistics::quantile;
pub use suspicion::{Gravity, Hole, Place, Suspicion};

/// What is suspicious in one drive, gravest first; empty when nothing is.
pub fn screen(machine: &Machine, log: &DriveLog) -> Vec<Suspicion> {
    let missing = holes::some_missing(&Signals::of(log), log);
    let mut found = continuity::lacking(&Signals::of(log), log);
    let bridged = holes::bridged(log);
    let runs = Signals::of(&bridged);
    if found.is_empty() {
        found.extend(units::check(&runs, machine));
        found.extend(signs::check(&runs, machine));
        found.extend(excitation::standstill(&runs, machine));
    }
    // Wrong units look like leaps: they are named first, and alone.
    if found.is_empty() {
        found.extend(continuity::breaks(&runs, machine));
        found.extend(excitation::frozen(&runs));
        found.extend(excitation::stalled(&runs));
        found.extend(excitation::beyond(&runs, machine));
    }
    if found.iter().all(|suspicion| suspicion.gravity() == Gravity::Doubtful) {
        found.extend(missing);
    }
    found.sort_by_key(Suspicion::gravity);
    found
}

#[cfg(test)]
mod tests;
