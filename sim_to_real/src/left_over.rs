//! What is left once the announced effects act, as a shape: which quantity is off, and under which condition by how much.

use crate::answer::Condition;
use crate::comparison::Yardstick;
use crate::conditions::{LAID_OUT, MEASURED, StartRecord, Window, between_classes, bin_of, quantiles};
use crate::drive::{HORIZONS, STEP_S};
use crate::findings::{LeftBin, LeftOver};
use crate::residual_table::STATES;
use crate::rollout::N_QUANTITIES;

/// Place of the horizon that is told among those that are laid out: long enough for what is wrong to add up.
const TOLD: usize = LAID_OUT.len() - 1;
/// A shape is told where it is this much of what is left, beyond what the same bins show of nominal drives.
const STANDS_OUT: f64 = 0.03;
/// So many are told.
const MOST: usize = 6;

/// Every quantity over every condition that it follows, the largest share of what is left first.
pub(crate) fn left_over(real: &[StartRecord], null: &[StartRecord], yardstick: &Yardstick) -> Vec<LeftOver> {
    let [own, nominal] = [real, null]
        .map(|records| records.iter().map(|record| &record.windows[TOLD]).collect::<Vec<&Window>>());
    let mut shapes: Vec<LeftOver> = (0..MEASURED.len())
        .flat_map(|condition| (0..N_QUANTITIES).map(move |quantity| (condition, quantity)))
        .filter_map(|place| shape(place, (&own, &nominal), yardstick))
        .filter(|shape| shape.share > STANDS_OUT)
        .collect();
    shapes.sort_by(|a, b| b.share.total_cmp(&a.share));
    // Speed, turning and their changes go together: of each quantity the condition that tells most.
    let mut told: Vec<LeftOver> = Vec::new();
    for shape in shapes {
        if told.len() < MOST && told.iter().all(|other| other.quantity != shape.quantity) {
            told.push(shape);
        }
    }
    told
}

fn shape(
    (condition, quantity): (usize, usize),
    (real, null): (&[&Window], &[&Window]),
    yardstick: &Yardstick,
) -> Option<LeftOver> {
    let values = real.iter().map(|window| window.values[condition]).collect();
    let is_class = MEASURED[condition] == Condition::TerrainClass;
    let edges = if is_class { between_classes(values) } else { quantiles(values) };
    if edges.len() < 3 {
        return None;
    }
    let horizon = LAID_OUT[TOLD];
    let unit = yardstick.0[horizon * N_QUANTITIES + quantity];
    let sums = |windows: &[&Window]| {
        let mut sums = vec![[0.0_f64; 2]; edges.len() - 1];
        for window in windows {
            let sum = &mut sums[bin_of(window.values[condition], &edges)];
            *sum = [sum[0] + 1.0, sum[1] + window.residual[quantity]];
        }
        sums
    };
    let (own, nominal) = (sums(real), sums(null));
    let explained = |sums: &[[f64; 2]], windows: &[&Window]| {
        let squares: f64 = windows.iter().flat_map(|window| window.residual).map(|r| r * r).sum();
        let of_means: f64 = sums.iter().map(|[n, sum]| sum * sum / n.max(1.0)).sum();
        of_means / squares.max(f64::MIN_POSITIVE)
    };
    let bins = edges.windows(2).zip(own.iter().zip(&nominal)).filter(|(_, (own, _))| own[0] > 0.0);
    // A residual is what was foretold less what was measured.
    let mean = |[n, sum]: [f64; 2]| (n > 0.0).then(|| -unit * sum / n);
    let bins = bins.map(|(edge, (own, nominal))| LeftBin {
        low: edge[0],
        high: edge[1],
        n: own[0] as usize,
        mean: mean(*own).unwrap_or_default(),
        null_mean: mean(*nominal),
    });
    Some(LeftOver {
        quantity: STATES[quantity],
        condition: MEASURED[condition],
        horizon_s: HORIZONS[horizon] as f64 * STEP_S,
        share: explained(&own, real) - explained(&nominal, null),
        bins: bins.collect(),
    })
}
