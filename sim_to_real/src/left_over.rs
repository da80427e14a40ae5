//! What is left once the announced effects act, as a shape: which quantity is off, and under which condition by how much.

use crate::comparison::Yardstick;
use crate::conditions::{LAID_OUT, MEASURED, StartRecord, Window, bin_of, edges};
use crate::drive::{HORIZONS, STEP_S};
use crate::findings::{LeftBin, LeftOver};
use crate::residual_table::STATES;
use crate::rollout::N_QUANTITIES;

/// Place of the horizon that is told among those that are laid out: long enough for what is wrong to add up.
const TOLD: usize = LAID_OUT.len() - 1;
/// A shape is told where it is this much of what is left, beyond what the same bins show of nominal drives.
const STANDS_OUT: f64 = 0.03;

/// Every quantity over the condition that it follows most, if it follows one; the largest share of what is left first.
pub(crate) fn left_over(real: &[StartRecord], null: &[StartRecord], yardstick: &Yardstick) -> Vec<LeftOver> {
    let windows = |records| Vec::from_iter(<[StartRecord]>::iter(records).map(|own| &own.windows[TOLD]));
    let (real, null) = (windows(real), windows(null));
    let of_quantity = |quantity: usize| {
        let shapes =
            (0..MEASURED.len()).filter_map(|place| shape((place, quantity), (&real, &null), yardstick));
        shapes.filter(|shape| shape.share > STANDS_OUT).max_by(|a, b| a.share.total_cmp(&b.share))
    };
    let mut shapes: Vec<LeftOver> = (0..N_QUANTITIES).filter_map(of_quantity).collect();
    shapes.sort_by(|a, b| b.share.total_cmp(&a.share));
    shapes
}

fn shape(
    (condition, quantity): (usize, usize),
    (real, null): (&[&Window], &[&Window]),
    yardstick: &Yardstick,
) -> Option<LeftOver> {
    let edges = edges(condition, real.iter().map(|window| window.values[condition]).collect())?;
    let horizon = LAID_OUT[TOLD];
    let unit = yardstick.0[horizon * N_QUANTITIES + quantity];
    let of = |windows: &[&Window]| {
        let mut sums = vec![Sum::default(); edges.len() - 1];
        for window in windows {
            sums[bin_of(window.values[condition], &edges)].add(window.residual[quantity]);
        }
        sums
    };
    let (own, nominal) = (of(real), of(null));
    let bins = edges.windows(2).zip(own.iter().zip(&nominal)).filter_map(|(edge, (own, nominal))| {
        // A residual is what was foretold less what was measured.
        let mean = |sum: &Sum| sum.mean().map(|mean| -unit * mean);
        Some(LeftBin { low: edge[0], high: edge[1], n: own.n, mean: mean(own)?, null_mean: mean(nominal) })
    });
    Some(LeftOver {
        quantity: STATES[quantity],
        condition: MEASURED[condition],
        horizon_s: HORIZONS[horizon] as f64 * STEP_S,
        share: share(&own, real) - share(&nominal, null),
        bins: bins.collect(),
    })
}

/// Residuals of a bin.
#[derive(Clone, Copy, Default)]
struct Sum {
    n: usize,
    sum: f64,
}

impl Sum {
    fn add(&mut self, residual: f64) {
        self.n += 1;
        self.sum += residual;
    }

    fn mean(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }
}

/// Of the square of all that is left, what the means of the bins make.
fn share(bins: &[Sum], windows: &[&Window]) -> f64 {
    let squares: f64 = windows.iter().flat_map(|window| window.residual).map(|left| left * left).sum();
    let of_means: f64 = bins.iter().filter_map(|bin| Some(bin.mean()? * bin.sum)).sum();
    of_means / squares.max(f64::MIN_POSITIVE)
}
