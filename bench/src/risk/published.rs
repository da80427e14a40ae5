//! What EVORA's authors measured: the trials that lie beside their public planner (mppi_numba, forty worlds with five
//! draws of traction each), deterministic dynamics.

use serde::Serialize;

use crate::statistics::Count;

/// Trials of every cell.
const N: usize = 200;
/// Risk tolerances.
const LEVELS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// Share of bushes; success [%] by risk tolerance; least and largest of what is told of the time to the goal [s].
type Line = (f64, [f64; 5], [[f64; 2]; 5]);

const LINES: [Line; 4] = [
    (0.1, [100.0, 100.0, 99.0, 98.0, 98.5], [[7.3; 2]; 5]),
    (0.4, [96.0, 94.5, 77.0, 71.0, 69.0], [[8.6; 2], [8.4; 2], [9.0; 2], [9.2; 2], [9.1; 2]]),
    (0.7, [85.0, 81.0, 51.0, 46.0, 46.5], [[10.0, 10.8]; 5]),
    (1.0, [99.0, 98.5, 22.5, 20.0, 20.0], [[10.7; 2], [10.6; 2], [11.8; 2], [11.3; 2], [11.5; 2]]),
];

/// A cell of the published table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// How many reached the goal.
    #[serde(flatten)]
    pub count: Count,
    /// Share that reached the goal.
    pub success: f64,
    /// Time to the goal of those that did [s], as an interval where one is told for several cells. Made by another
    /// version of the planner than the trials of its authors' other set, which take one to two seconds longer.
    pub time_to_goal_s: [f64; 2],
}

impl Published {
    /// The cell of a density and a risk tolerance, where there is one.
    pub fn at(density: f64, alpha: f64) -> Option<Self> {
        let (_, percents, times_s) = LINES.iter().find(|(of, ..)| *of == density)?;
        let column = LEVELS.iter().position(|&level| level == alpha)?;
        let success = percents[column] / 100.0;
        let count = Count { n_hit: (success * N as f64).round() as usize, n: N };
        Some(Self { count, success, time_to_goal_s: times_s[column] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_whole_numbers_of_trials() {
        for (density, alpha) in LINES.iter().flat_map(|(density, ..)| LEVELS.map(|alpha| (*density, alpha))) {
            let cell = Published::at(density, alpha).unwrap();
            assert!((cell.count.share() - cell.success).abs() < 1e-12, "{density}, {alpha}");
        }
        assert_eq!(Published::at(1.0, 0.6).unwrap().count, Count { n_hit: 45, n: 200 });
        assert_eq!((Published::at(0.5, 0.6), Published::at(1.0, 0.5)), (None, None));
    }
}
