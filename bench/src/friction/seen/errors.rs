//! Errors of predicted motion, and the tables that they make.

use friction::State;
use serde::Serialize;

use crate::statistics::Mean;

/// Errors of one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WindowError {
    pub ate_m: f64,
    pub rre_deg: f64,
    pub rte_m: f64,
}

impl WindowError {
    /// Root mean square of the distance over the steps; turn and distance at the last.
    pub(super) fn of(states: &[State], truth: &[State]) -> Self {
        let off_m = |(a, b): (&State, &State)| (a.at_m[0] - b.at_m[0]).hypot(a.at_m[1] - b.at_m[1]);
        let squares: f64 = states.iter().zip(truth).map(|pair| off_m(pair).powi(2)).sum();
        let (last, end) = (&states[states.len() - 1], &truth[truth.len() - 1]);
        let turned_rad = last.heading_rad - end.heading_rad;
        Self {
            ate_m: (squares / states.len() as f64).sqrt(),
            rre_deg: turned_rad.sin().atan2(turned_rad.cos()).abs().to_degrees(),
            rte_m: off_m((last, end)),
        }
    }
}

/// Mean errors, of drives first.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Windows.
    pub n: usize,
    /// Absolute trajectory error [m].
    pub ate_m: Mean,
    /// Relative rotation error at the last step [deg].
    pub rre_deg: Mean,
    /// Relative translation error at the last step [m].
    pub rte_m: Mean,
}

/// Windows' errors with their drive and ground.
pub(super) type Located = (usize, u8, WindowError);

impl Errors {
    /// Means over windows; intervals of 95 % by drawing drives anew.
    pub(super) fn of<'a>(errors: impl Iterator<Item = &'a Located>) -> Option<Self> {
        let errors: Vec<&Located> = errors.collect();
        let mean = |which: fn(&WindowError) -> f64| {
            let mut drives: std::collections::BTreeMap<usize, (f64, f64)> = Default::default();
            for (drive, _, error) in errors.iter().copied() {
                let sum = drives.entry(*drive).or_default();
                *sum = (sum.0 + which(error), sum.1 + 1.0);
            }
            Mean::of_ratios(&drives.into_values().collect::<Vec<_>>())
        };
        Some(Self {
            n: errors.len(),
            ate_m: mean(|error| error.ate_m)?,
            rre_deg: mean(|error| error.rre_deg)?,
            rte_m: mean(|error| error.rte_m)?,
        })
    }
}

/// A method's row.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub method: &'static str,
    /// All windows.
    pub overall: Errors,
    /// By ground in the order of the published table.
    pub grounds: Vec<Option<Errors>>,
}

impl Row {
    pub(super) fn of(method: &'static str, errors: &[Located]) -> Option<Self> {
        let ground = |ground: u8| Errors::of(errors.iter().filter(|(_, other, _)| *other == ground));
        Some(Self { method, overall: Errors::of(errors.iter())?, grounds: (0..7).map(ground).collect() })
    }
}

/// What was seen of a ground by the network that learned from both losses, over the pixels of the test worlds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SeenGround {
    /// Its name.
    pub ground: &'static str,
    /// Mean friction at a sliding speed of 1 m/s [-], as seen, and by the plant's coefficients under the same law.
    pub friction: [f64; 2],
    /// Mean viscous coefficient [s/m], likewise.
    pub viscous: [f64; 2],
}
