//! What is left once the announced effects act, as a shape: which quantity is off, and under which condition by how much.

use crate::answer::Condition;
use crate::comparison::Yardstick;
use crate::conditions::{LAID_OUT, MEASURED, N_BINS, StartRecord, Window, bin_of, edges, quantiles};
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, STEP_S};
use crate::findings::{LeftBin, LeftOver};
use crate::residual_table::STATES;

/// Place of the horizon that is told among those that are laid out: long enough for what is wrong to add up.
const TOLD: usize = LAID_OUT.len() - 1;
/// A shape is told where it is this much of what is left, beyond what the same bins show of nominal drives.
const STANDS_OUT: f64 = 0.03;

/// Every quantity that is off everywhere, and over the condition that it follows most, if it follows one; the largest share of
/// what is left first.
pub(crate) fn left_over(
    (drives, real): (&[&Drive], &[StartRecord]),
    null: &[StartRecord],
    yardstick: &Yardstick,
) -> Vec<LeftOver> {
    let windows = |records| Vec::from_iter(<[StartRecord]>::iter(records).map(|own| &own.windows[TOLD]));
    let (real, null) = (windows(real), windows(null));
    let axes = axes(drives, &real, &null);
    let of_quantity = |quantity: usize| {
        let unit = yardstick.0[LAID_OUT[TOLD] * N_QUANTITIES + quantity];
        let shapes = axes.iter().map(|axis| shape(axis, (quantity, unit), (&real, &null)));
        let told = shapes.filter(|shape| shape.share > STANDS_OUT);
        let (mut told, followed): (Vec<_>, Vec<_>) =
            told.partition(|shape| shape.condition == Condition::Constant);
        told.extend(followed.into_iter().max_by(|a, b| a.share.total_cmp(&b.share)));
        told
    };
    let mut shapes: Vec<LeftOver> = (0..N_QUANTITIES).flat_map(of_quantity).collect();
    shapes.sort_by(|a, b| b.share.total_cmp(&a.share));
    shapes
}

/// A condition with its value at every window, and the edges of its bins.
struct Axis {
    condition: Condition,
    edges: Vec<f64>,
    real: Vec<f64>,
    null: Vec<f64>,
}

fn axes(drives: &[&Drive], real: &[&Window], null: &[&Window]) -> Vec<Axis> {
    let measured = MEASURED.into_iter().enumerate().filter_map(|(place, condition)| {
        let of =
            |windows: &[&Window]| windows.iter().map(|window| window.values[place]).collect::<Vec<f64>>();
        Some(Axis { condition, edges: edges(place, of(real))?, real: of(real), null: of(null) })
    });
    let n_starts = drives.iter().map(|drive| drive.starts.len());
    let driven: Vec<f64> = n_starts.flat_map(|n| (0..n).map(move |place| place as f64 / n as f64)).collect();
    let edges = quantiles(driven.clone(), N_BINS);
    let time = Axis { condition: Condition::Time, edges, real: driven, null: Vec::new() };
    let nothing = |windows: &[&Window]| vec![0.0; windows.len()];
    let constant = Axis {
        condition: Condition::Constant,
        edges: vec![0.0; 2],
        real: nothing(real),
        null: nothing(null),
    };
    measured.chain([time, constant]).collect()
}

fn shape(axis: &Axis, (quantity, unit): (usize, f64), (real, null): (&[&Window], &[&Window])) -> LeftOver {
    let of = |values: &[f64], windows: &[&Window]| {
        let mut sums = vec![Sum::default(); axis.edges.len() - 1];
        for (value, window) in values.iter().zip(windows) {
            sums[bin_of(*value, &axis.edges)].add(window.residual[quantity]);
        }
        sums
    };
    let (own, nominal) = (of(&axis.real, real), of(&axis.null, null));
    // What is the same in all bins is told as such, and of no other condition.
    let explained = |bins: &[Sum], windows: &[&Window]| {
        let constant = share(&[bins.iter().sum()], windows);
        if axis.condition == Condition::Constant { constant } else { share(bins, windows) - constant }
    };
    let bins = axis.edges.windows(2).zip(own.iter().zip(&nominal)).filter_map(|(edge, (own, nominal))| {
        // A residual is what was foretold less what was measured.
        let mean = |sum: &Sum| sum.mean().map(|mean| -unit * mean);
        Some(LeftBin { low: edge[0], high: edge[1], n: own.n, mean: mean(own)?, null_mean: mean(nominal) })
    });
    LeftOver {
        quantity: STATES[quantity],
        condition: axis.condition,
        horizon_s: HORIZONS[LAID_OUT[TOLD]] as f64 * STEP_S,
        share: explained(&own, real) - explained(&nominal, null),
        bins: bins.collect(),
    }
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

impl<'a> std::iter::Sum<&'a Self> for Sum {
    fn sum<I: Iterator<Item = &'a Self>>(bins: I) -> Self {
        bins.fold(Self::default(), |all, own| Self { n: all.n + own.n, sum: all.sum + own.sum })
    }
}

/// Of the square of all that is left, what the means of the bins make.
fn share(bins: &[Sum], windows: &[&Window]) -> f64 {
    let squares: f64 = windows.iter().flat_map(|window| window.residual).map(|left| left * left).sum();
    let of_means: f64 = bins.iter().filter_map(|bin| Some(bin.mean()? * bin.sum)).sum();
    of_means / squares.max(f64::MIN_POSITIVE)
}
